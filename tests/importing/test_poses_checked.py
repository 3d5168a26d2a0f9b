"""Replay and check of poses without pictures, in every layout that has them."""

from pathlib import Path

import numpy as np
import pytest

import folders
from commands import Handeye
from datasets.test_hostile import LAYOUTS, poses_alone
from datasets.test_pose_pairs import X, Y, stations
from handeye.datasets import PosePairs
from handeye.datasets.pose_pairs import numbered
from handeye.errors import ExitCode, InputError
from handeye.estimation.shift import Moved
from handeye.importing import Posed, check_poses, plan_pose_check, solve_poses
from handeye.planning.hindsight import hindsight
from handeye.types import Mounting, Pose
from importing.test_streams import certifiable
from poses_written import some_poses

SIGMA = np.array([2e-4, 2e-4, 6e-4, 1e-3, 1e-3, 1e-3])


def seen_from(
    poses: list[Pose], mounting: Mounting, random: np.random.Generator, camera: Pose, target: Pose
) -> PosePairs:
    """A detector's noise: of the place in the camera's axes, of the turn about the target."""
    pairs = []
    for pose in poses:
        matrix = (camera @ X @ mounting.chain(pose) @ Y @ target).matrix.copy()
        noise = random.normal(0, SIGMA)
        matrix[:3, :3] = Pose.exp([0, 0, 0, *noise[3:]]).rotation @ matrix[:3, :3]
        matrix[:3, 3] += noise[:3]
        pairs.append((pose, Pose(matrix)))
    return PosePairs("posed", "test", mounting, numbered(pairs))


def same(mounting: Mounting, seed: int, count: int = 20) -> PosePairs:
    nothing = Pose.identity()
    poses = some_poses(count, seed)
    return seen_from(poses, mounting, np.random.default_rng([seed, 1]), nothing, nothing)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    random = np.random.default_rng(2)
    listed = [
        (pose, Pose.exp(random.normal(0, 2e-4, 6)) @ seen)
        for pose, seen in stations(Mounting.EYE_IN_HAND, 12)
    ]
    folders_by_name = poses_alone(tmp_path_factory.mktemp("posed"), listed)
    # Files of Wise et al. lead from the station to what stands still.
    certifiable(folders_by_name["certifiable"], [(pose.inverse(), seen) for pose, seen in listed])
    # A set that is one file is given as that file.
    files = {name: sorted(folder.iterdir()) for name, folder in folders_by_name.items()}
    return {name: some[0] if len(some) == 1 else folders_by_name[name] for name, some in files.items()}


@pytest.fixture
def cell_folder(tmp_path: Path) -> Path:
    return folders.written(folders.made_recording(6), tmp_path / "pictures")


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_layout_is_gone_through_and_checked(
    handeye: Handeye, written: dict[str, Path], name: str
) -> None:
    stated = ("--mounting", "eye_in_hand")
    found = handeye.json("replay", written[name], *stated)
    assert len(found["steps"]) == found["views"] - 2 > 5
    assert found["steps"][-1]["within_95"]["translation_mm"] < 3
    assert len(found["repeat"]) == 3
    planned = handeye.json("check", written[name], *stated, "--plan", "3")
    assert len(planned["poses"]) == 3
    checked = handeye.json("check", written[name], written[name], *stated)
    assert checked["moved"] == "nothing"


@pytest.mark.parametrize("mounting", Mounting)
def test_what_moved_is_found(mounting: Mounting) -> None:
    alarms, right = 0, 0
    trials = 24
    for seed in range(trials):
        solved = solve_poses(same(mounting, seed))
        chosen, _ = plan_pose_check(solved, 3)
        poses = [solved.pairs.pairs[k].T_base_flange for k in chosen]
        random = np.random.default_rng([seed, 2])
        still = seen_from(poses, mounting, random, Pose.identity(), Pose.identity())
        alarms += check_poses(solved, still).alarm
        shift = Pose.exp([0.004, 0.002, 0, 0, 0.01, 0])
        moved = Moved.CAMERA if seed % 2 else Moved.BOARD
        camera, target = (shift, Pose.identity()) if seed % 2 else (Pose.identity(), shift)
        check = check_poses(solved, seen_from(poses, mounting, random, camera, target))
        assert check.detectable_mm < 8
        right += check.moved is moved
    assert alarms <= 2
    assert right >= 0.9 * trials


@pytest.mark.parametrize("mounting", Mounting)
def test_samples_in_hindsight(mounting: Mounting) -> None:
    found = hindsight(Posed(same(mounting, 40)))
    first, last, then = found.steps[2].within, found.steps[-1].within, found.then
    assert first is not None
    assert last is not None
    assert then is not None
    assert then.translation_mm < last.translation_mm < first.translation_mm
    assert found.enough is not None
    assert found.enough <= 20
    planned = [step.within for step in found.planned[4:12]]
    taken = [step.within for step in found.steps[4:12]]
    ratio = [a.translation_mm / b.translation_mm for a, b in zip(planned, taken, strict=True) if a and b]
    assert np.median(ratio) < 1.0


def test_stations_that_do_not_turn_leave_it_open() -> None:
    good = same(Mounting.EYE_IN_HAND, 3)
    slid = [
        (pose, X @ Mounting.EYE_IN_HAND.chain(pose) @ Y)
        for pose in (Pose.exp([0.1 * k, 0, 0, 0, 0, 0]) @ good.pairs[0].T_base_flange for k in range(5))
    ]
    both = [*slid, *((pair.T_base_flange, pair.T_camera_target) for pair in good.pairs)]
    found = hindsight(Posed(PosePairs("slid first", "test", good.mounting, numbered(both))))
    assert found.steps[0].within is None
    assert found.steps[-1].within is not None


def test_what_does_not_go_together_is_refused(
    handeye: Handeye, written: dict[str, Path], cell_folder: Path
) -> None:
    solved = solve_poses(same(Mounting.EYE_IN_HAND, 1))
    with pytest.raises(InputError, match="eye_to_hand"):
        check_poses(solved, same(Mounting.EYE_TO_HAND, 1))
    old = written["easy_handeye2"]
    stated = ("--mounting", "eye_in_hand")
    assert "pictures" in handeye.fails("check", old, cell_folder, *stated)["message"]
    assert handeye("check", old, old, *stated, "--at", "sample_01").code == ExitCode.USAGE
    assert handeye("replay", old, *stated, "--ui").code == ExitCode.USAGE
