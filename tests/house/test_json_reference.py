"""The reference of the JSON keys and the commands agree: no key undocumented, none documented that is not there."""

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bags_written import Journey, write
from cli.test_verify import touched
from commands import Handeye
from datasets.test_pose_pairs import easy_samples
from folders import made_recording, parallel_recording, written
from handeye.datasets import write_recording, write_rig
from handeye.datasets.shipped import shipped_recording
from handeye.datasets.toml_text import toml_text
from handeye.simulation import example_folder
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.simulation.rigs import simulate_rig
from handeye.studies.planted import Mistake, made_up, plant
from handeye.types import Charuco, Mounting
from scenes import scene

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = (ROOT / "docs" / "json.md").read_text()
ROW = re.compile(r"^\| `([^`]+)` \|", re.MULTILINE)


def documented(title: str) -> list[str]:
    """The keys of a section's table."""
    section = re.split(r"^## ", REFERENCE, flags=re.MULTILINE)
    (body,) = [text for text in section if text.startswith(title + "\n")]
    return ROW.findall(body)


def keys(value: object, path: str = "") -> Iterator[str]:
    """The paths of all values that are not objects, and of lists of objects also the lists."""
    if isinstance(value, dict) and value:
        for key, item in value.items():
            yield from keys(item, f"{path}.{key}" if path else key)
        return
    yield path
    if isinstance(value, list):
        for item in value:
            if isinstance(item, dict):
                yield from keys(item, f"{path}[]")


def at(value: Any, key: str) -> object:
    """The value at a path; nothing where the path leads through a list, or nowhere."""
    for name in key.split("."):
        value = value.get(name, ...) if isinstance(value, dict) else ...
    return value


def matches(pattern: str, key: str) -> bool:
    return re.fullmatch(re.sub(r"<[a-z]+>", r"[^.]+", re.escape(pattern)), key) is not None


def compare(title: str, *answers: dict[str, Any]) -> None:
    rows = documented(title)
    found = {key for answer in answers for key in keys(answer)}
    # What lies inside an object of free form is not listed.
    free = tuple(row for row in rows if row.endswith("evidence"))
    unknown = [
        key
        for key in sorted(found)
        if not any(matches(row, key) for row in [*rows, *(p for row in rows for p in prefixes(row))])
        and not any(matches(row, key[: len(row)]) and key[len(row) : len(row) + 1] == "." for row in free)
    ]
    assert not unknown, unknown
    objects = {prefix for key in found for prefix in prefixes(key)}
    # What an empty list would hold is not there to be seen.
    empty = tuple(f"{key}[]." for key in found if all(at(answer, key) == [] for answer in answers))
    missing = [
        row
        for row in rows
        if not any(matches(row, key) for key in found | objects) and not row.startswith(empty)
    ]
    assert not missing, missing


def prefixes(key: str) -> Iterator[str]:
    parts = key.split(".")
    return (".".join(parts[:i]) for i in range(1, len(parts)))


@pytest.fixture
def shipped(tmp_path: Path) -> Path:
    """The shipped recording, with one view spoiled so that something is left out."""
    folder = tmp_path / "recording"
    shutil.copytree(shipped_recording(), folder)
    corners = folder / "corners" / "im_01.csv"
    corners.write_text("\n".join(corners.read_text().splitlines()[:4]))
    return folder


def test_solve(handeye: Handeye, shipped: Path, tmp_path: Path) -> None:
    open_directions = written(parallel_recording(), tmp_path / "parallel")
    links_off = simulate(ErrorKind.SMOOTH_KINEMATIC, 2, CellOptions(length_sigma_m=(5e-4, 5e-4)))
    of_arm = written(links_off, tmp_path / "arm")
    journey = Journey(stations=3, picture_hz=4)
    (tmp_path / "board.json").write_text(json.dumps(journey.target.to_dict()))
    bag = write(tmp_path / "bag", "mcap", journey)
    compare(
        "handeye solve",
        handeye.json("solve", shipped),
        handeye.json("solve", shipped, "--model", "paper", "--certify"),
        handeye.json("solve", open_directions, "--reduced"),
        handeye.json("solve", of_arm, "--robot", "ur5e"),
        handeye.json("solve", bag, "--target", tmp_path / "board.json", "--reduced"),
    )


def test_solve_several_cameras(handeye: Handeye, tmp_path: Path) -> None:
    write_rig(simulate_rig(ErrorKind.MIXTURE_CELL, 1), tmp_path / "rig")
    data = handeye.json("solve", tmp_path / "rig", "--robot", "ur5e", "--certify")
    one = documented("handeye solve")
    for camera in data["cameras"].values():
        target = camera.pop("target")
        unknown = [key for key in keys(camera) if not any(matches(row, key) for row in one)]
        assert {key for key in unknown if not key.startswith(("T_base_camera", "T_flange_target"))} <= {
            key for key in unknown if "evidence" in key
        }
        camera.clear()
        camera["target"] = target
    compare("handeye solve, several cameras", data)
    planned = handeye.json("plan", tmp_path / "rig", "--touch-mm", "1")
    planned["touch"] = {camera: {} for camera in planned["touch"]}
    compare("handeye plan, several cameras", planned)
    halved = handeye.json("validate", tmp_path / "rig", "--splits", "2")
    compare("handeye validate, several cameras", halved)


def test_solve_poses_alone(handeye: Handeye, tmp_path: Path) -> None:
    path = tmp_path / "demo.samples"
    path.write_text(easy_samples(Mounting.EYE_IN_HAND))
    answer = handeye.json("solve", path, "--mounting", "eye_in_hand")
    # One sample says what another has seen.
    path.write_text(easy_samples(Mounting.EYE_IN_HAND, wrong=1))
    one_out = handeye.json("solve", path, "--mounting", "eye_in_hand")
    compare("handeye solve, poses alone", answer, one_out)


def test_demo_of_a_rig(handeye: Handeye, tmp_path: Path) -> None:
    data = handeye.json("demo", "--rig", tmp_path / "rig")
    data["calibration"] = {}
    compare("handeye run --rig", data)


def test_demo_of_a_folder(handeye: Handeye, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(example_folder, "VIEWS", 2)
    compare("handeye demo --folder", handeye.json("demo", "--folder", tmp_path / "pictures"))


def test_plan(handeye: Handeye, shipped: Path, tmp_path: Path) -> None:
    poses = tmp_path / "poses.csv"
    poses.write_text("x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,1\n")
    open_directions = written(parallel_recording(), tmp_path / "parallel")
    compare(
        "handeye plan",
        handeye.json("plan", shipped),
        handeye.json("plan", shipped, "--together", "3"),
        handeye.json("plan", shipped, "--candidates", poses),
        handeye.json("plan", open_directions),
    )


def test_expect(handeye: Handeye) -> None:
    compare("handeye expect", handeye.json("expect", "--views", "4", "--cells", "1"))


def test_validate(handeye: Handeye, shipped: Path, tmp_path: Path) -> None:
    without_truth = made_recording(8)
    object.__setattr__(without_truth, "truth", None)
    compare(
        "handeye validate",
        handeye.json("validate", shipped, "--splits", "2"),
        handeye.json("validate", written(without_truth, tmp_path / "made"), "--splits", "2"),
    )


def test_export(handeye: Handeye, shipped: Path) -> None:
    compare(
        "handeye export",
        handeye.json("export", shipped, "--format", "urdf"),
        handeye.json("export", shipped, "--format", "moveit_samples"),
    )


def test_devices(handeye: Handeye) -> None:
    compare("handeye devices", handeye.json("devices"))


def test_target(handeye: Handeye, tmp_path: Path) -> None:
    compare("handeye target", handeye.json("target", "chessboard", "--output", tmp_path / "board.svg"))


def test_detect(handeye: Handeye, tmp_path: Path) -> None:
    board = Charuco(6, 8, 0.03, 0.0225, "DICT_4X4_50")
    for name, shown in (("a", board), ("b", board.changed(rows=7))):
        cv2.imwrite(str(tmp_path / f"{name}.png"), scene(shown).picture())
    described = tmp_path / "board.toml"
    described.write_text(toml_text(board.to_dict()))
    compare("handeye detect", handeye.json("detect", tmp_path, "--target", described))


def test_demo(handeye: Handeye, tmp_path: Path) -> None:
    compare("handeye demo", handeye.json("demo", "--starts", "1", "--picture", tmp_path / "demo.png"))
    assert (tmp_path / "demo.png").stat().st_size > 10_000


def test_demo_of_a_cell(handeye: Handeye, tmp_path: Path) -> None:
    folder, picture = tmp_path / "cell", tmp_path / "demo.png"
    options = ("--cell", folder, "--picture", picture, "--starts", "1", "--points-only", "0.1")
    compare("handeye demo --cell", handeye.json("demo", *options))
    assert picture.stat().st_size > 10_000
    assert (folder / "report.html").stat().st_size > 10_000


def test_run(handeye: Handeye, tmp_path: Path) -> None:
    session = handeye.json("run", "--session", tmp_path / "cell", "--points-only", "0.1", "--seed", "5")
    unknown = ("--uncalibrated", "--points-only", "0.1", "--max-views", "6")
    learnt = handeye.json("run", "--session", tmp_path / "learnt", *unknown)
    # Its keys are those of solve.
    session["calibration"] = learnt["calibration"] = None
    compare("handeye run", session, learnt, handeye.json("run", "--dry-run"))


@pytest.mark.parametrize("study", ["table1", "curves", "holdout", "injected"])
def test_studies(handeye: Handeye, study: str) -> None:
    arguments = ("--data", shipped_recording().parent, "--sets", shipped_recording().name)
    options = ("--trials", "1", "--workers", "1")
    compare(f"handeye study {study}", handeye.json("study", study, *arguments, *options))


def test_doctor(handeye: Handeye, tmp_path: Path) -> None:
    recording, _ = plant(made_up(0, 3), Mistake.GROSS_POSE, np.random.default_rng(0))
    write_recording(recording, tmp_path / "made")
    compare("handeye doctor", handeye.json("doctor", tmp_path / "made"))


def test_mistakes(handeye: Handeye) -> None:
    arguments = ("--trials", "1", "--workers", "1", "--kinds", "flip", "wrong_unit")
    compare("handeye study mistakes", handeye.json("study", "mistakes", *arguments))


def test_twin(handeye: Handeye) -> None:
    options = ("--sets", "1", "--trials", "1", "--models", "paper", "auto", "--workers", "1")
    compare("handeye study twin", handeye.json("study", "twin", *options))


def test_simulated_studies(handeye: Handeye) -> None:
    data = handeye.json("study", "methods", "--trials", "1", "--workers", "1")
    compare("handeye study methods", data)
    scale = handeye.json("study", "scale", "--trials", "40", "--workers", "1", "--no-cluster")
    compare("handeye study scale", scale)
    few = ("--trials", "1", "--workers", "1")
    compare("handeye study rigs", handeye.json("study", "rigs", "--trials", "1", "--workers", "1"))
    compare("handeye study policies", handeye.json("study", "policies", "--budgets", "5", *few))
    one_step = ("--candidates", "3", "--draws", "2", "--arm", "exact")
    compare("handeye study gains", handeye.json("study", "gains", *one_step, *few))
    data = handeye.json("study", "coverage", "--trials", "1", "--workers", "1")
    compare("handeye study coverage", data)


def test_check_and_diff(handeye: Handeye, shipped: Path, tmp_path: Path) -> None:
    log = tmp_path / "nights.jsonl"
    compare(
        "handeye check",
        handeye.json("check", shipped),
        handeye("check", shipped, shipped, "--log", log, "--json").data,
    )
    compare("handeye diff", handeye.json("diff", shipped, shipped))


def test_replay(handeye: Handeye, tmp_path: Path) -> None:
    compare("handeye replay", handeye.json("replay", written(made_recording(8), tmp_path / "made")))


def test_arm(handeye: Handeye, tmp_path: Path) -> None:
    links_off = simulate(ErrorKind.SMOOTH_KINEMATIC, 2, CellOptions(length_sigma_m=(5e-4, 5e-4)))
    of_arm = written(links_off, tmp_path / "arm")
    urdf = tmp_path / "corrected.urdf"
    compare("handeye arm", handeye.json("arm", of_arm, "--robot", "ur5e", "--output", urdf))
    assert urdf.stat().st_size > 1000


def test_touch(handeye: Handeye) -> None:
    options = ("--cells", "1", "--touches", "3", "--workers", "1")
    compare("handeye study touch", handeye.json("study", "touch", *options))


def test_verify(handeye: Handeye, tmp_path: Path) -> None:
    recording, touches = touched(tmp_path, 0.0)
    compare("handeye verify", handeye("verify", recording, touches, "--json").data)


def test_studies_of_work(handeye: Handeye) -> None:
    one = ("--workers", "1")
    compare("handeye study shift", handeye.json("study", "shift", "--trials", "1", *one))
    nights = ("--trials", "1", "--nights", "4")
    compare("handeye study shift --nights", handeye.json("study", "shift", *nights, *one))
    compare("handeye study probing", handeye.json("study", "probing", "--cells", "1", *one))
    few = ("--arms", "1", "--views", "9", "--postures", "20")
    compare("handeye study arm", handeye.json("study", "arm", *few, *one))
    few = ("--only", "arm", "--cells", "1")
    compare("handeye study questions", handeye.json("study", "questions", *few, *one))
    compare("handeye study cheap-arms", handeye.json("study", "cheap-arms", "--cells", "1", *one))


def test_bench(handeye: Handeye) -> None:
    compare("handeye bench", handeye.json("bench", "--quick", "--no-peers", "--budget-s", "0.002"))


def test_errors(handeye: Handeye) -> None:
    outcome = handeye("solve", "nowhere", "--json")
    compare("Errors", outcome.data)


def test_paths_are_understood() -> None:
    data = {"a": {"b": 1, "c": {}}, "d": [{"e": 1}, {"f": [1, 2]}], "g": [[1], [2]], "h": []}
    assert sorted(set(keys(data))) == ["a.b", "a.c", "d", "d[].e", "d[].f", "g", "h"]
    assert matches("a[].<any>.c", "a[].b.c")
    assert not matches("a.<any>", "a.b.c")
