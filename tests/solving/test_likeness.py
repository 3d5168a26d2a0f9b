"""How alike a smooth error of the robot is in two views: a correlation, however the views are turned."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from handeye.solving.auto import LIKENESS_CHORD, LIKENESS_M, posture_likeness
from handeye.types import Pose


def likeness(poses: list[Pose]) -> Any:
    views = [SimpleNamespace(T_base_flange=pose) for pose in poses]
    return posture_likeness(cast("Any", SimpleNamespace(views=views)))


def test_it_falls_off_with_distance_and_angle() -> None:
    angle = 2 * np.arcsin(LIKENESS_CHORD / 2)
    turned = Pose.exp([LIKENESS_M, 0, 0, 0, 0, 0]) @ Pose.exp([0, 0, 0, 0, angle, 0])
    found = likeness([Pose.identity(), Pose.exp([LIKENESS_M, 0, 0, 0, 0, 0]), turned])
    assert found[0, 1] == pytest.approx(np.exp(-0.5))
    assert found[1, 2] == pytest.approx(np.exp(-0.5))
    assert found[0, 2] == pytest.approx(np.exp(-1.0))


@pytest.mark.parametrize("seed", range(5))
def test_it_is_a_correlation_whatever_the_turns(seed: int) -> None:
    random = np.random.default_rng(seed)
    axes = random.normal(size=(25, 3))
    axes *= random.uniform(0, np.pi, (25, 1)) / np.linalg.norm(axes, axis=1, keepdims=True)
    found = likeness([Pose.exp([0, 0, 0, *axis]) for axis in axes])
    assert np.array_equal(found, found.T)
    assert np.array_equal(np.diag(found), np.ones(25))
    assert np.linalg.eigvalsh(found)[0] > -1e-9
