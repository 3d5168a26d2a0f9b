"""Drivers are closed when a session is over, however it ends, and never while a call into them runs."""

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from handeye.cameras.protocol import Frame
from handeye.errors import DeviceError, InputError
from handeye.robots.protocol import Goal, Reading
from handeye.session import configuration as configuring
from handeye.session import opening
from handeye.session.attempt import Cell
from handeye.session.closing import HURRIED_S, close_all, closing
from handeye.session.configuration import begin, go_on, prepare
from handeye.session.settings import Configuration
from sessions import configured


class Noted:
    """Drivers over those of a simulated cell; what is asked of them is noted in one list."""

    def __init__(self, cell: Cell, called: list[str]) -> None:
        self._cell, self._called = cell, called
        self.moving: Callable[[], None] = lambda: None
        self.stopping: Callable[[], None] = lambda: None
        self.reading: Callable[[], None] = lambda: None

    def move_to(self, goal: Goal) -> None:
        self._called.append("move")
        self.moving()
        self._cell.robot.move_to(goal)

    def read_pose(self) -> Reading:
        self.reading()
        return self._cell.robot.read_pose()

    def stop(self) -> None:
        self._called.append("stop")
        self.stopping()

    def close(self) -> None:
        self._called.append("close robot")


class NotedCamera:
    def __init__(self, cell: Cell, called: list[str]) -> None:
        self._cell, self._called = cell, called
        self.grabbing: Callable[[], None] = lambda: None

    def grab(self, label: str) -> Frame:
        self.grabbing()
        return self._cell.source.grab(label)

    def close(self) -> None:
        self._called.append("close camera")
        raise RuntimeError("of no consequence")


def noted() -> tuple[Cell, Noted, NotedCamera, list[str]]:
    cell = prepare(configured(0)).cell
    called = list[str]()
    robot, camera = Noted(cell, called), NotedCamera(cell, called)
    cell = replace(cell, robot=robot, source=camera)
    return (
        replace(cell, timeouts=replace(cell.timeouts, move_s=5.0, read_s=1.0, grab_s=1.0)),
        robot,
        camera,
        called,
    )


@pytest.mark.parametrize("error", [None, ValueError, KeyboardInterrupt])
def test_the_robot_stops_and_both_are_closed_once(error: type[BaseException] | None) -> None:
    cell, _, _, called = noted()

    def work() -> None:
        with closing(cell):
            if error is not None:
                raise error

    if error is None:
        work()
    else:
        with pytest.raises(error):
            work()
    assert called == ["stop", "close robot", "close camera"]


def test_a_camera_of_several_eyes_is_closed_once() -> None:
    cell, _, camera, called = noted()
    eye = replace(cell.eyes[0], source=camera)
    close_all(replace(cell, several=(eye, replace(eye, name=("camera", "second")))))
    assert called.count("close camera") == 1


def test_a_robot_that_does_not_confirm_the_stop_is_not_closed() -> None:
    cell, robot, _, called = noted()

    def refusing() -> None:
        raise DeviceError("no")

    robot.stopping = refusing
    close_all(cell)
    assert called == ["stop", "close camera"]


def test_devices_whose_last_call_hangs_are_not_closed_and_nobody_waits_long() -> None:
    cell, robot, camera, called = noted()
    back = threading.Event()
    robot.reading = camera.grabbing = back.wait
    for calls, call in ((cell.robot_calls, robot.read_pose), (cell.camera_calls, lambda: camera.grab("a.1"))):
        with pytest.raises(DeviceError, match="no answer"):
            calls.run(0.01, call)
    began = time.monotonic()
    close_all(cell, HURRIED_S)
    assert called == ["stop"]
    assert time.monotonic() - began < 20 * HURRIED_S
    back.set()
    cell.robot_calls.wait(5.0)


def test_a_motion_that_is_interrupted_has_come_back_before_its_driver_is_closed() -> None:
    cell, robot, _, called = noted()
    stopped = threading.Event()

    def turning() -> None:
        stopped.wait()
        called.append("moved")

    robot.moving, robot.stopping = turning, stopped.set
    goal = Goal("a.1", cell.robot.read_pose().T_base_flange, cell.robot.read_pose().joints_rad)
    with pytest.raises(DeviceError, match="no answer"):
        cell.robot_calls.run(0.01, robot.move_to, goal)
    close_all(cell, 5.0)
    assert called == ["move", "stop", "moved", "close robot", "close camera"]


def real(monkeypatch: pytest.MonkeyPatch) -> tuple[Configuration, Cell, Noted, NotedCamera, list[str]]:
    """A run whose drivers are not simulated, as far as it can tell."""
    cell, robot, camera, called = noted()
    monkeypatch.setattr(opening, "open_robot", lambda *_, **__: robot)
    monkeypatch.setattr(configuring, "open_camera", lambda *_, **__: camera)
    assert cell.workspace is not None
    low, high = cell.workspace.lower_m, cell.workspace.upper_m
    asked = replace(
        configured(0),
        driver="noted",
        images="noted",
        workspace_m=(tuple(low.tolist()), tuple(high.tolist())),
        floor_m=cell.workspace.floor_m,
    )
    return asked, cell, robot, camera, called


def test_what_was_opened_is_closed_when_the_run_cannot_begin(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, cell, robot, camera, called = real(monkeypatch)

    def refusing(*_: Any, **__: Any) -> None:
        raise DeviceError("not there")

    robot.reading = refusing
    with pytest.raises(DeviceError):
        prepare(asked, camera=cell.camera, target=cell.target)
    assert called == ["close camera", "close robot"]
    called.clear()
    camera.grabbing = refusing
    with pytest.raises(DeviceError):
        prepare(asked, target=cell.target)
    assert called == ["close camera", "close robot"]
    called.clear()
    monkeypatch.setattr(configuring, "open_camera", refusing)
    with pytest.raises(DeviceError):
        prepare(asked, camera=cell.camera, target=cell.target)
    assert called == ["close robot"]


def test_what_was_opened_is_closed_when_a_session_cannot_go_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked, cell, _, _, called = real(monkeypatch)
    prepared = prepare(asked, camera=cell.camera, target=cell.target)
    _, store = begin(prepared, tmp_path / "s")
    store.close()
    assert called == []

    def changed(*_: Any, **__: Any) -> None:
        raise InputError("another arm")

    monkeypatch.setattr(configuring, "check_fingerprints", changed)
    with pytest.raises(InputError):
        go_on(tmp_path / "s")
    assert called == ["stop", "close robot", "close camera"]
    monkeypatch.undo()
    # The folder was let go of too.
    configuring.open_session(tmp_path / "s").close()
