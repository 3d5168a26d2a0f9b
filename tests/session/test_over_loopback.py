"""Whole calibrations through the protocol of a device, with connections that are cut, judged by the truth."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from handeye.session import configuration as sessions
from handeye.session.attempt import Timeouts
from handeye.session.deciding import FAILED, EndReason
from handeye.session.entry import Failure
from handeye.session.loop import End
from handeye.session.settings import Configuration
from handeye.testing import MockCell
from partners import CAMERAS, NEVER, ROBOTS, TURNS_RAD, Eye, Partner

# Libraries of makers and of ROS warn of what is theirs.
pytestmark = pytest.mark.filterwarnings("ignore")

SEED = 11
# The cell in ROS 2 has its own camera.
BESIDE = {"ros2": "ros2"}
# A controller that goes on without a connection is at its goal by then.
REST_S = 30.0
SPACE = ((-1.1, -1.1, 0.02), (1.1, 1.1, 1.3))


def asked(partner: Partner) -> Configuration:
    return Configuration(
        partner.robot,
        driver=partner.driver,
        images="mock",
        workspace_m=SPACE,
        speed_rad_s=partner.speed_rad_s,
        timeouts=Timeouts(move_s=60, read_s=10, grab_s=10),
        failures_in_a_row=2,
    )


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


def interrupted(
    partner: Partner, eye: Eye, folder: Path, sabotage: Callable[[threading.Event], None]
) -> tuple[End, list[Failure | None]]:
    """Run a calibration while somebody pulls cables; it says so, and once resumed ends at the truth."""
    wish, over = asked(partner), threading.Event()
    thread = threading.Thread(target=sabotage, args=(over,))
    thread.start()
    try:
        end, failures = driven(wish, partner.cell, folder)
    finally:
        over.set()
        thread.join()
    eye.cut_at = NEVER
    partner.mend()
    eye.mend()
    resumed = driven(wish, partner.cell, folder)[0] if end.reason in FAILED else end
    assert resumed.reason is EndReason.ACCURACY_REACHED, resumed
    translation_mm, rotation_deg = true_errors(resumed, partner.cell)
    assert translation_mm < 0.5
    assert rotation_deg < 0.05
    return end, failures


def prepared(
    name: str, camera: str, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest, folder: Path
) -> tuple[Partner, Eye]:
    """Start the partners of a session."""
    partner = ROBOTS[name](SEED, folder)
    request.addfinalizer(partner.close)
    eye = CAMERAS[camera](partner, folder)
    request.addfinalizer(eye.close)
    monkeypatch.setattr(sessions, "open_camera", lambda *_: eye)
    return partner, eye


@pytest.mark.parametrize(("name", "back"), [("ur", True), *((name, False) for name in ROBOTS)], ids=str)
def test_a_robot_that_is_lost_in_mid_motion(
    name: str, back: bool, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """It comes back by itself or not; the arm rests, nothing is repeated, and the session goes on."""
    partner, eye = prepared(name, BESIDE.get(name, "mock"), monkeypatch, request, tmp_path)
    stood: list[np.ndarray] = []

    def sabotage(over: threading.Event) -> None:
        while not over.is_set() and (eye.grabs < 2 or not partner.moves()):
            time.sleep(0.002)
        partner.cut()
        end = time.monotonic() + REST_S
        while partner.moves(0.5) and time.monotonic() < end:
            pass
        stood.append(partner.joints().copy())
        time.sleep(0.5)
        stood.append(partner.joints().copy())
        if back:
            partner.mend()

    end, failures = interrupted(partner, eye, tmp_path / "s", sabotage)
    assert Failure.ROBOT_FAILED in failures
    assert np.allclose(*stood, rtol=0, atol=TURNS_RAD), "the arm still moves"
    if not back:
        assert end.reason in FAILED


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_camera_that_is_lost_in_mid_grab(
    camera: str, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """No picture of before is taken for one of now, and the session goes on where it stood."""
    robot = next((robot for robot, beside in BESIDE.items() if beside == camera), "ur")
    partner, eye = prepared(robot, camera, monkeypatch, request, tmp_path)
    eye.cut_at = 4
    end, failures = interrupted(partner, eye, tmp_path / "s", lambda _: None)
    assert failures[-2:] == [Failure.CAMERA_FAILED, Failure.CAMERA_FAILED]
    assert end.reason is EndReason.TOO_MANY_FAILURES
