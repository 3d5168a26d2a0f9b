"""`handeye plan` ranks what is left, or poses from a file."""

from pathlib import Path

import numpy as np
import pytest

from commands import Handeye
from folders import made_cell, made_recording, written
from handeye.types import Pose, Recording


@pytest.fixture(scope="module")
def recording() -> Recording:
    return made_recording(9)


@pytest.fixture(scope="module")
def folder(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(recording, tmp_path_factory.mktemp("plan") / "made")


def csv(path: Path, poses: dict[str, Pose]) -> Path:
    rows = ["name,x,y,z,qx,qy,qz,qw"]
    for name, pose in poses.items():
        rows.append(",".join([name, *(f"{v:.12g}" for v in [*pose.translation, *pose.quaternion_xyzw])]))
    path.write_text("\n".join(rows) + "\n")
    return path


def test_views_left(handeye: Handeye, recording: Recording, folder: Path) -> None:
    data = handeye.json("plan", folder)
    names = [view.name for view in recording.views]
    assert data["used"] == names[:3]
    assert sorted(entry["name"] for entry in data["ranking"]) == names[3:]
    assert [entry["rank"] for entry in data["ranking"]] == list(range(1, 7))
    gains = [entry["gain"] for entry in data["ranking"]]
    assert gains == sorted(gains, reverse=True)
    for entry in data["ranking"]:
        assert 0 < entry["sigma_translation_mm"] < data["sigma_translation_mm"]
        assert 0 < entry["sigma_rotation_deg"] < data["sigma_rotation_deg"]
    assert (data["feasible_count"], data["infeasible"]) == (6, [])
    assert data["determined"] is True


def test_first_and_used(handeye: Handeye, folder: Path) -> None:
    assert handeye.json("plan", folder, "--first", "5")["used"] == [f"view_{i:02d}" for i in range(5)]
    chosen = ["view_07", "view_01", "view_04", "view_02"]
    data = handeye.json("plan", folder, "--used", *chosen)
    assert data["used"] == chosen
    assert "view_07" not in [entry["name"] for entry in data["ranking"]]
    assert handeye.fails("plan", folder, "--first", "3", "--used", "view_01")["exit_code"] == 2


@pytest.mark.parametrize(
    "criterion", ["entropy", "entropy_handeye", "trace", "eigenvalue_sum", "min_eigenvalue"]
)
@pytest.mark.parametrize("model", ["auto", "paper"])
def test_criteria(handeye: Handeye, folder: Path, criterion: str, model: str) -> None:
    data = handeye.json("plan", folder, "--criterion", criterion, "--model", model)
    assert (data["criterion"], data["model"]) == (criterion, model)
    assert all(entry["gain"] > 0 for entry in data["ranking"])


def test_tool_point(handeye: Handeye, folder: Path) -> None:
    data = handeye.json("plan", folder, "--criterion", "tool_point", "--tool-point-mm", "0", "0", "300")
    assert data["criterion"] == "tool_point"
    assert handeye.fails("plan", folder, "--criterion", "tool_point")["exit_code"] == 2
    assert handeye.fails("plan", folder, "--tool-point-mm", "0", "0", "300")["exit_code"] == 2


def test_candidates_from_a_file(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    cell = made_cell()
    good = cell.look(0.3, 0.3)
    away = Pose.exp([0, 0, 0, 0, np.pi, 0]) @ good
    path = csv(tmp_path / "c.csv", {"good": cell.robot_pose(good), "away": cell.robot_pose(away)})
    data = handeye.json("plan", folder, "--candidates", path)
    assert len(data["used"]) == 9
    assert [entry["name"] for entry in data["ranking"]] == ["good"]
    assert data["infeasible"] == [{"name": "away", "reason": "the target would lie behind the camera"}]
    np.testing.assert_allclose(data["ranking"][0]["T_base_flange"], cell.robot_pose(good).matrix, atol=1e-9)
    text = handeye("plan", folder, "--candidates", path).out
    assert "away: the target would lie behind the camera" in text


def test_no_candidate_can_be_taken(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    cell = made_cell()
    away = Pose.exp([0, 0, 0, 0, np.pi, 0]) @ cell.look()
    path = csv(tmp_path / "c.csv", {"away": cell.robot_pose(away)})
    data = handeye.json("plan", folder, "--candidates", path)
    assert (data["ranking"], data["feasible_count"]) == ([], 0)
    assert "no view can be taken" in handeye("plan", folder, "--candidates", path).out


def test_candidate_with_the_name_of_a_taken_view_is_taken(
    handeye: Handeye, folder: Path, tmp_path: Path
) -> None:
    cell = made_cell()
    path = csv(tmp_path / "c.csv", {"view_01": cell.robot_pose(cell.look(0.3, 0.3))})
    data = handeye.json("plan", folder, "--candidates", path)
    assert data["ranking"] == []
    assert data["infeasible"] == [{"name": "view_01", "reason": "a view of this name is taken already"}]


def test_top(handeye: Handeye, folder: Path) -> None:
    data = handeye.json("plan", folder, "--top", "2")
    assert (len(data["ranking"]), data["feasible_count"]) == (2, 6)
    assert "and 4 more" in handeye("plan", folder, "--top", "2").out
    assert handeye.fails("plan", folder, "--top", "0")["exit_code"] == 2


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--first", "2"], "too_few_views"),
        (["--first", "9"], "no_candidates"),
        (["--used", "view_00", "view_01", "nowhere"], "unknown_view"),
        (["--candidates", "nowhere.csv"], "missing_file"),
    ],
)
def test_wrong_input(handeye: Handeye, folder: Path, arguments: list[str], code: str) -> None:
    error = handeye.fails("plan", folder, *arguments)
    assert (error["exit_code"], error["code"]) == (3, code)


def test_text(handeye: Handeye, folder: Path) -> None:
    outcome = handeye("plan", folder)
    best = handeye.json("plan", folder)["ranking"][0]
    assert outcome.code == 0
    first = next(line for line in outcome.out.splitlines() if line.strip().startswith("1 "))
    assert best["name"] in first
    assert f"{best['gain']:.3f}" in first


def test_several_at_once_in_a_short_order(handeye: Handeye, folder: Path) -> None:
    data = handeye.json("plan", folder, "--together", "3")["together"]
    names = [view["name"] for view in data["views"]]
    assert len(set(names)) == 3
    assert set(names) <= {entry["name"] for entry in handeye.json("plan", folder)["ranking"]}
    assert sum(view["leg"] for view in data["views"]) == pytest.approx(data["total"])
    assert data["total"] <= data["total_as_chosen"] + 1e-12
    assert (data["measure"], data["unit"], data["speed_deg_s"]) == ("pose_distance", "m", None)
    assert data["from"] == "view_02"
    text = handeye("plan", folder, "--together", "3").out
    assert "as the joints of some are not known" in " ".join(text.split())
    assert handeye.json("plan", folder)["together"] is None
    for bad in (("--together", "0"), ("--together", "2", "--criterion", "trace"), ("--speed-deg-s", "0")):
        assert handeye.fails("plan", folder, *bad)["exit_code"] == 2
    assert handeye.fails("plan", folder, "--together", "99")["code"] == "too_few_candidates"
