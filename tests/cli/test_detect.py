"""`handeye detect`: what is seen in each picture, in words, as JSON, and drawn."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from commands import Handeye
from handeye.datasets.toml_text import toml_text
from handeye.errors import ExitCode
from handeye.types import ArucoGrid, Charuco, Chessboard, Target
from scenes import scene

BOARD = Charuco(6, 8, 0.03, 0.0225, "DICT_4X4_50")


def pictures(folder: Path, boards: dict[str, Target]) -> Path:
    folder.mkdir()
    for name, board in boards.items():
        cv2.imwrite(str(folder / name), scene(board).picture())
    return folder


def described(board: Target, path: Path) -> Path:
    path.write_text(toml_text({"target": board.to_dict()}))
    return path


def test_each_picture_has_its_line(handeye: Handeye, tmp_path: Path) -> None:
    folder = pictures(
        tmp_path / "in",
        {"a.png": BOARD, "b.webp": BOARD.changed(legacy_pattern=True), "c.pgm": BOARD.changed(rows=7)},
    )
    cv2.imwrite(str(folder / "d.png"), np.full((200, 300), 3, dtype=np.uint8))
    (folder / "e.jpg").write_bytes(b"no picture")
    target = described(BOARD, tmp_path / "board.toml")
    data = handeye.json("detect", folder, "--target", target, "--show", tmp_path / "out")
    assert (data["found"], data["total"]) == (2, 5)
    a, b, c, d, e = data["images"]
    assert a["points"] == len(a["pixels"]) == len(a["point_ids"]) == 35
    assert a["note"] is None
    assert "legacy_pattern = true" in b["note"]
    assert c["code"] == "wrong_size"
    assert "rows = 7" in c["hint"]
    assert d["code"] == "underexposed"
    assert e["code"] == "not_an_image"
    for image in data["images"]:
        drawn = cv2.imread(image["drawing"])
        assert drawn is not None
    # What was found is drawn in colour where it is.
    drawn = cv2.imread(a["drawing"]).astype(int)
    u, v = np.rint(a["pixels"][-1]).astype(int)
    patch = drawn[v - 4 : v + 5, u - 4 : u + 5]
    assert np.ptp(patch, axis=2).max() > 60


def test_a_person_reads_what_to_do(handeye: Handeye, tmp_path: Path) -> None:
    folder = pictures(tmp_path / "in", {"a.png": Chessboard(6, 9, 0.03)})
    outcome = handeye("detect", folder, "--rows", "7", "--columns", "10")
    assert outcome.code == ExitCode.SUCCESS
    words = " ".join(outcome.out.split())
    assert "found in 0 of 1 pictures" in words
    assert "--rows 6 --columns 9" in words


def test_without_a_description_any_board_is_looked_for(handeye: Handeye, tmp_path: Path) -> None:
    folder = pictures(
        tmp_path / "in", {"a.png": BOARD, "b.png": ArucoGrid(3, 4, 0.04, 0.01, "DICT_6X6_250", first_id=9)}
    )
    data = handeye.json("detect", folder)
    assert data["target"] is None
    boards = [image["board"] for image in data["images"]]
    assert [(board["family"], board["rows"], board["columns"]) for board in boards] == [
        ("charuco", 6, 8),
        ("aruco_grid", 3, 4),
    ]
    assert boards[1]["first_id"] == 9
    assert handeye.json("detect", folder / "a.png")["total"] == 1


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ("missing", ExitCode.UNUSABLE_INPUT),
        (".", ExitCode.UNUSABLE_INPUT),
        (". --rows 3", ExitCode.USAGE),
        (". --rows 3 --columns 4 --target x.toml", ExitCode.USAGE),
    ],
)
def test_what_cannot_be_looked_at_is_refused(
    handeye: Handeye, arguments: str, code: ExitCode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "--" in arguments:
        pictures(tmp_path / "in", {"a.png": BOARD})
        monkeypatch.chdir(tmp_path / "in")
    else:
        monkeypatch.chdir(tmp_path)
    outcome = handeye("detect", *arguments.split())
    assert outcome.code == code
