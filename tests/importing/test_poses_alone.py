"""X and Y from poses alone."""

import json
from pathlib import Path

import numpy as np
import pytest

from commands import Handeye
from datasets.test_pose_pairs import X, Y, easy_samples, moveit_samples, stations
from handeye.datasets import PosePairs
from handeye.datasets.pose_pairs import numbered
from handeye.errors import DegenerateError, InputError, SolveError
from handeye.importing import open_folder, solve_poses
from handeye.robots.displaced import displaced, random_displacements
from handeye.simulation.cells import POSTURE_RAD, simulated_arm
from handeye.types import Mounting, Pose
from handeye.validation import metrics


def noisy(mounting: Mounting, sigma: float, count: int = 12, seed: int = 1) -> PosePairs:
    rng = np.random.default_rng(seed)
    poses = [(pose, Pose.exp(rng.normal(0, sigma, 6)) @ seen) for pose, seen in stations(mounting, count)]
    return PosePairs("noisy", "test", mounting, numbered(poses))


@pytest.mark.parametrize("mounting", Mounting)
def test_exact_poses_give_the_truth(mounting: Mounting) -> None:
    solved = solve_poses(noisy(mounting, 0.0))
    assert np.abs(solved.X.matrix - X.matrix).max() < 1e-4
    assert solved.rms_m < 1e-4


@pytest.mark.parametrize("mounting", Mounting)
def test_noise_shows_in_the_misfit(mounting: Mounting) -> None:
    errors = []
    for seed in range(20):
        solved = solve_poses(noisy(mounting, 1e-3, seed=seed))
        assert 0.5e-3 < solved.rms_m < 3e-3
        errors.append(np.linalg.norm((solved.X.inverse() @ X).translation))
    assert np.median(errors) < 2e-3


@pytest.mark.parametrize("mounting", Mounting)
def test_the_stated_radius_holds(mounting: Mounting) -> None:
    held = []
    for seed in range(12):
        solved = solve_poses(noisy(mounting, 1e-3, seed=seed))
        off = 1e3 * float(np.linalg.norm((X @ solved.X.inverse()).log()[:3]))
        held.append(off <= solved.within_95.translation_mm)
        assert 0.1 < solved.within_95.translation_mm < 20
    assert np.mean(held) > 0.8


def test_a_detector_that_does_not_see_depth_is_found() -> None:
    rng = np.random.default_rng(3)
    poses = []
    for pose, seen in stations(Mounting.EYE_IN_HAND, 30):
        matrix = seen.matrix.copy()
        matrix[:3, 3] *= 1 + rng.normal(0, 4e-3) / np.linalg.norm(matrix[:3, 3])
        poses.append((pose, Pose(matrix)))
    levels = solve_poses(PosePairs("deep", "test", Mounting.EYE_IN_HAND, numbered(poses))).levels
    assert 2e-3 < levels["detector_along_m"] < 8e-3
    assert levels["detector_across_m"] < 0.5e-3


def wrongly_built(seed: int, length_m: float, angle_deg: float) -> PosePairs:
    """Stations of an arm whose links are off by so much, under a detector that is off by a millimetre."""
    random = np.random.default_rng(seed)
    arm = simulated_arm()
    joints = POSTURE_RAD + random.uniform(-0.7, 0.7, (24, 6))
    by = random_displacements(random, arm, length_m, float(np.deg2rad(angle_deg)))
    truly = displaced(arm, by).forward(joints)
    poses = []
    for reported, true in zip(arm.forward(joints), truly, strict=True):
        seen = (X @ Pose(true).inverse() @ Y).matrix.copy()
        seen[:3, 3] += random.normal(0, [1e-3, 1e-3, 3e-3])
        seen[:3, :3] = seen[:3, :3] @ Pose.exp([0, 0, 0, *random.normal(0, 2e-3, 3)]).rotation
        poses.append((Pose(reported), Pose(seen)))
    return PosePairs("wrongly built", "test", Mounting.EYE_IN_HAND, numbered(poses))


@pytest.mark.parametrize(("length_m", "angle_deg"), [(0.5e-3, 0.1), (3e-3, 0.01)])
def test_an_arm_that_nobody_vouches_for_may_be_wrongly_built(length_m: float, angle_deg: float) -> None:
    held = []
    for seed in range(16):
        solved = solve_poses(wrongly_built(seed, length_m, angle_deg))
        squared = metrics.nees(solved.X, solved.covariance, X)
        held.append(metrics.region_holds(squared, solved.degrees_of_freedom))
        assert solved.within_95.translation_mm < 60
    assert sum(held) >= 11


@pytest.mark.parametrize("wrong", [1, 3])
def test_samples_that_contradict_the_others_are_left_out(wrong: int) -> None:
    good = noisy(Mounting.EYE_IN_HAND, 2e-4)
    poses = [(pair.T_base_flange, pair.T_camera_target) for pair in good.pairs]
    for k in range(wrong):
        pose, seen = poses[3 * k]
        poses[3 * k] = pose, Pose.exp([0.03, 0, 0.05, 0.1, 0, 0]) @ seen
    solved = solve_poses(PosePairs("wrong", "test", good.mounting, numbered(poses)))
    assert list(solved.left_out) == [f"sample_{3 * k + 1:02d}" for k in range(wrong)]
    assert np.linalg.norm((X @ solved.X.inverse()).log()[:3]) < 2e-3


def test_what_cannot_be_solved_is_refused() -> None:
    good = noisy(Mounting.EYE_IN_HAND, 0.0)
    with pytest.raises(InputError, match="at least 3"):
        solve_poses(PosePairs("few", "test", good.mounting, good.pairs[:2]))
    shuffled = numbered(
        [(p.T_base_flange, q.T_camera_target) for p, q in zip(good.pairs, good.pairs[::-1], strict=True)]
    )
    with pytest.raises((SolveError, DegenerateError), match=r"contradict|do not report the same"):
        solve_poses(PosePairs("shuffled", "test", good.mounting, shuffled))
    slid = [(Pose.exp([0.1 * k, 0, 0, 0, 0, 0]), Pose.exp([0.1 * k, 0, 0.5, 0, 0, 0])) for k in range(6)]
    with pytest.raises(DegenerateError):
        solve_poses(PosePairs("slid", "test", good.mounting, numbered(slid)))


@pytest.mark.parametrize("mounting", Mounting)
def test_the_mounting_with_which_they_agree_is_named(mounting: Mounting) -> None:
    good = noisy(mounting, 1e-4)
    other = next(m for m in Mounting if m is not mounting)
    with pytest.raises(SolveError) as caught:
        solve_poses(PosePairs("turned", "test", other, good.pairs))
    assert f"with --mounting {mounting.value} half of them agree" in str(caught.value.hint)


def test_the_command_answers_and_says_what_poses_do_not_show(tmp_path: Path, handeye: Handeye) -> None:
    path = tmp_path / "demo.samples"
    path.write_text(easy_samples(Mounting.EYE_TO_HAND))
    answer = handeye.json("solve", str(path), "--mounting", "eye_to_hand")
    assert np.abs(np.array(answer["T_base_camera"]) - X.inverse().matrix).max() < 1e-4
    assert answer["within_95"]["translation_mm"] < 0.5
    assert "shows in none of them" in answer["warnings"][-1]
    with pytest.raises(InputError, match="without pictures"):
        open_folder_of_samples(tmp_path)
    assert json.dumps(answer)


def open_folder_of_samples(folder: Path) -> None:
    (folder / "samples.yaml").write_text(moveit_samples(stations(Mounting.EYE_IN_HAND)))
    open_folder(folder / "samples.yaml")
