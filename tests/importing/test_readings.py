"""Which way of reading poses agrees with the pictures, and what is said about it."""

from pathlib import Path

import numpy as np
import pytest

from handeye.datasets import read_pose_rows
from handeye.importing.readings import CLEARLY, compare, distinct
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray
from poses_written import WAYS, Way, some_poses


def seen(poses: list[Pose], mounting: Mounting, seed: int, sigma: float = 3e-4) -> FloatArray:
    """Poses of the target in the camera: noise at the arm and in the pictures, one view altogether wrong."""
    rng = np.random.default_rng(seed)
    X, Y = (Pose.exp([*rng.uniform(-0.2, 0.2, 3), *rng.uniform(-2, 2, 3)]) for _ in range(2))

    def off() -> Pose:
        return Pose.exp(rng.normal(0, sigma, 6))

    views = [off() @ X @ mounting.chain(pose @ off()) @ Y for pose in poses]
    views[2] = Pose.exp(rng.normal(0, 0.3, 6)) @ views[2]
    return np.array([view.matrix for view in views])


@pytest.mark.parametrize("mounting", Mounting)
@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.name)
def test_the_right_reading_is_found(way: Way, mounting: Mounting, tmp_path: Path) -> None:
    poses = some_poses(10, 7)
    path = tmp_path / f"poses{way.suffix}"
    path.write_text(way.text([f"im_{k}.png" for k in range(10)], poses), newline="")
    rows = read_pose_rows(path)
    best, *others = compare(rows, rows.readings(), seen(poses, mounting, 8), (mounting,))
    assert best.fits
    assert not [o for o in distinct(best, others) if o.fits and o.misfit < CLEARLY * best.misfit]
    expected = np.array([pose.matrix for pose in poses])
    assert np.abs(rows.matrices(best.reading) - expected).max() < 1e-3


def test_no_reading_fits_poses_of_other_pictures(tmp_path: Path) -> None:
    poses = some_poses(10, 7)
    way = WAYS[0]
    path = tmp_path / "poses.csv"
    path.write_text(way.text([f"im_{k}.png" for k in range(10)], poses))
    rows = read_pose_rows(path)
    agreements = compare(rows, rows.readings(), seen(some_poses(10, 70), Mounting.EYE_IN_HAND, 8))
    assert not any(agreement.fits for agreement in agreements)


def test_of_equals_the_usual_way_comes_first(tmp_path: Path) -> None:
    poses = some_poses(10, 7)
    way = WAYS[0]
    path = tmp_path / "poses.csv"
    path.write_text(way.text([f"im_{k}.png" for k in range(10)], poses))
    rows = read_pose_rows(path)
    for mounting in Mounting:
        best = compare(rows, rows.readings(), seen(poses, mounting, 8))[0]
        assert best.mounting is mounting
        assert best.reading.options == ("--notation", "ur", "--unit", "mm")
