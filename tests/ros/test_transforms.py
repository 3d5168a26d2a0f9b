"""Frames at one moment, through moving and static edges, up and down."""

import numpy as np
import pytest

from handeye.errors import DeviceError
from handeye.ros import Transforms
from handeye.types import Pose

RNG = np.random.default_rng(5)
MOUNT, WORLD = Pose.exp(RNG.normal(size=6)), Pose.exp(RNG.normal(size=6))
FIRST = Pose.exp(0.3 * RNG.normal(size=6))
TWIST = 0.1 * RNG.normal(size=6)


@pytest.fixture
def frames() -> Transforms:
    made = Transforms(lambda: 100.0)
    made.put("world", "base", 0.0, WORLD, static=True)
    made.put("wrist", "tool0", 0.0, MOUNT, static=True)
    for share in (0.0, 1.0):
        made.put("base", "wrist", 99.0 + 0.1 * share, FIRST @ Pose.exp(share * TWIST), static=False)
    return made


@pytest.mark.parametrize("share", [0.0, 0.25, 0.7, 1.0])
def test_between_two_it_goes_along_a_screw(frames: Transforms, share: float) -> None:
    expected = FIRST @ Pose.exp(share * TWIST) @ MOUNT
    found = frames.at("base", "tool0", 99.0 + 0.1 * share, 0.0)
    assert np.allclose(found.matrix, expected.matrix, atol=1e-9)
    above = frames.at("world", "tool0", 99.0 + 0.1 * share, 0.0)
    assert np.allclose(above.matrix, (WORLD @ expected).matrix, atol=1e-9)
    back = frames.at("tool0", "base", 99.0 + 0.1 * share, 0.0)
    assert np.allclose(back.matrix, expected.inverse().matrix, atol=1e-9)


def test_beyond_what_was_said_nothing_is_made_up(frames: Transforms) -> None:
    with pytest.raises(DeviceError, match="no message made after"):
        frames.at("base", "tool0", 99.2, 0.02)
    with pytest.raises(DeviceError, match="nothing from before"):
        frames.at("base", "tool0", 98.9, 0.02)


def test_frames_that_are_not_connected_are_named(frames: Transforms) -> None:
    with pytest.raises(DeviceError, match="does not connect base with camera; the frames are base, tool0"):
        frames.at("base", "camera", 99.0, 0.02)


def test_a_ring_ends() -> None:
    frames = Transforms(lambda: 100.0)
    frames.put("a", "b", 0.0, MOUNT, static=True)
    frames.put("b", "a", 0.0, MOUNT, static=True)
    with pytest.raises(DeviceError, match="does not connect"):
        frames.at("a", "c", 99.0, 0.0)
