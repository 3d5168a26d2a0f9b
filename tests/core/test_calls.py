"""Calls into the core: wrong ones are refused, panics are ordinary exceptions, Ctrl-C is heard while it works."""

import os
import signal
import threading
from collections.abc import Callable

import numpy as np
import pytest

from cells import Cell
from handeye import _core
from handeye.errors import InputError
from handeye.estimation import Measurements
from handeye.robots import open_arm


def inverse_kinematics() -> None:
    far = np.tile(np.eye(4), (100_000, 1, 1))
    far[:, 0, 3] = 5.0
    open_arm("ur5e").inverse_all(far)


def selection() -> None:
    roots = np.random.default_rng(0).standard_normal((20_000, 12, 2))
    _core.select_views(1e-3 * np.eye(12), roots @ roots.transpose(0, 2, 1), 15_000, "entropy")


@pytest.mark.skipif(os.name != "posix", reason="sends a signal to itself")
@pytest.mark.parametrize("work", [inverse_kinematics, selection])
def test_work_that_takes_an_hour_can_be_interrupted(work: Callable[[], None]) -> None:
    # A shell's background jobs are started deaf to Ctrl-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)


def many_things() -> dict[str, Callable[[], object]]:
    """Return calls that go over many things, half a second each."""
    random = np.random.default_rng(0)
    lens = np.array([900.0, 900, 500, 500, -0.2, 0.05, 0, 0, 0])
    pixels = random.uniform(0, 1000, (800_000, 2))
    places, angles = random.uniform(0, 1000, (40_000, 2)), np.tile([0.1, 1.6], (40_000, 1))
    centres, shapes = random.uniform(0, 1e6, (16_000, 2)), np.tile(np.eye(2), (16_000, 1, 1))
    arm, joints = open_arm("ur5e"), random.uniform(-3, 3, (800_000, 6))
    return {
        "unproject": lambda: _core.unproject("brown_conrady_5", lens, pixels),
        "neighbours": lambda: _core.crossing_neighbours(places, angles, 0.3),
        "gaps": lambda: _core.free_gaps(centres, shapes),
        "jacobians": lambda: arm.jacobian(joints),
    }


@pytest.mark.skipif(os.name != "posix", reason="sends signals to itself")
@pytest.mark.parametrize("name", ["unproject", "neighbours", "gaps", "jacobians"])
def test_signals_are_heard_while_many_things_are_gone_over(name: str) -> None:
    work, heard = many_things()[name], list[int]()
    before = signal.signal(signal.SIGPROF, lambda *_: heard.append(1))
    # Of processor time: how busy the machine is does not matter.
    signal.setitimer(signal.ITIMER_PROF, 0.01, 0.01)
    try:
        work()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
    # Signals that nobody hears until the end are one.
    assert len(heard) > 2


def test_a_panic_is_an_ordinary_exception() -> None:
    for _ in range(2):
        with pytest.raises(RuntimeError, match="the core failed: no such number"):
            _core.panic("no such number")


def test_a_start_has_a_transform_for_each_camera_and_target() -> None:
    cell = Cell(np.random.default_rng(0))
    views = cell.views([cell.robot_pose(cell.look()) for _ in range(4)], sigma_px=0.1)
    measurements = Measurements.of(cell.mounting, cell.camera, cell.target, views)
    seen = _core.PoseMeasurements(measurements.problem, measurements.camera_poses, free_camera=None)
    poses, one = measurements.motions, np.eye(4)[np.newaxis]
    measured = [(0, 0, seen, [0, 1, 2, 3], [1.0] * 4)]
    for start in ((one[:0], one[:0]), (one, one[:0]), (one[:0], one), (np.tile(one, (2, 1, 1)), one)):
        with pytest.raises(InputError, match=r"a start of .* expected 1 and 1"):
            _core.estimate_cell(
                poses, [(True, 0, False, None)], [False], measured, start=start, pairs=2, most_rounds=2
            )
