"""Whole calibrations through the protocol of a device, with connections that are cut, judged by the truth."""

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handeye.cameras.protocol import Frame
from handeye.errors import DeviceError
from handeye.session import configuration as sessions
from handeye.session.attempt import Timeouts
from handeye.session.deciding import EndReason
from handeye.session.entry import Failure
from handeye.session.loop import End
from handeye.session.settings import Configuration
from handeye.testing import MockCell
from handeye.testing.universal_robots import MockUniversalRobot

SPACE = ((-1.1, -1.1, 0.02), (1.1, 1.1, 1.3))


class Camera:
    """The camera of the cell, with a cable of its own."""

    def __init__(self, cell: MockCell) -> None:
        self.cell = cell
        self.connected = True
        self.grabs = 0

    def grab(self, label: str) -> Frame:
        self.grabs += 1
        if not self.connected:
            raise DeviceError("no camera", code="connection_lost")
        return self.cell.grab(label)


@pytest.fixture
def controller() -> Iterator[MockUniversalRobot]:
    made = MockUniversalRobot(MockCell("ur5e", seed=11, points_only=True), pace=4.0)
    yield made
    made.close()


@pytest.fixture
def camera(controller: MockUniversalRobot, monkeypatch: pytest.MonkeyPatch) -> Camera:
    made = Camera(controller.cell)
    monkeypatch.setattr(sessions, "open_camera", lambda *_: made)
    return made


def asked(controller: MockUniversalRobot, **changes: object) -> Configuration:
    usual = Configuration(
        "ur5e",
        driver=f"ur:{controller.address}",
        images="mock",
        workspace_m=SPACE,
        speed_rad_s=3.0,
        timeouts=Timeouts(move_s=20, read_s=5, grab_s=5),
    )
    return replace(usual, **changes)  # type: ignore[arg-type]


def driven(configuration: Configuration, cell: MockCell, folder: Path) -> tuple[End, list[Failure | None]]:
    if folder.exists():
        session, store, _ = sessions.go_on(folder)
    else:
        prepared = sessions.prepare(configuration, camera=cell.camera, target=cell.target)
        session, store = sessions.begin(prepared, folder)
    try:
        return session.run(), [entry.failure for entry in store.entries]
    finally:
        store.close()


def true_errors(end: End, cell: MockCell) -> tuple[float, float]:
    """How far the answer is from the truth, in mm and degrees."""
    assert end.calibration is not None
    assert cell.truth.X is not None
    off = (end.calibration.X @ cell.truth.X.inverse()).log()
    return 1e3 * float(np.linalg.norm(off[:3])), float(np.rad2deg(np.linalg.norm(off[3:])))


def test_a_calibration_survives_that_cables_are_pulled(
    controller: MockUniversalRobot, camera: Camera, tmp_path: Path
) -> None:
    """The robot's in mid-motion, for a while; then the camera's, until somebody resumes."""
    cell, stop = controller.cell, threading.Event()
    stood: list[tuple[float, ...]] = []

    def sabotage() -> None:
        while not stop.is_set() and (camera.grabs < 2 or not controller._rate.any()):
            time.sleep(0.002)
        controller.cut()
        time.sleep(1.0)  # the controller has stopped the arm by itself
        stood.extend([tuple(controller._rate), cell.joints_rad, tuple(controller._q)])
        time.sleep(1.0)
        controller.mend()
        while not stop.is_set() and camera.grabs < 5:
            time.sleep(0.002)
        camera.connected = False

    wish = asked(controller, failures_in_a_row=2)
    thread = threading.Thread(target=sabotage)
    thread.start()
    try:
        end, failures = driven(wish, cell, tmp_path / "s")
    finally:
        stop.set()
        thread.join()
    assert not np.any(stood[0])
    assert stood[1] == pytest.approx(stood[2])
    assert Failure.ROBOT_FAILED in failures
    assert failures[-2:] == [Failure.CAMERA_FAILED, Failure.CAMERA_FAILED]
    assert end.reason is EndReason.TOO_MANY_FAILURES
    camera.connected = True
    end, _ = driven(wish, cell, tmp_path / "s")
    assert end.reason is EndReason.ACCURACY_REACHED
    translation_mm, rotation_deg = true_errors(end, cell)
    assert translation_mm < 0.5
    assert rotation_deg < 0.05
