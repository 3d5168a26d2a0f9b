"""A camera that nobody has calibrated is learnt from the session's own views."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cells import Cell
from handeye.cameras.protocol import Frame, Points
from handeye.errors import DeviceError, InputError
from handeye.estimation import Estimate, Measurements
from handeye.estimation.lens_confidence import lens_difference_px
from handeye.planning import Stop
from handeye.planning.stopping import State
from handeye.session import configuration as configurations
from handeye.session import opening
from handeye.session.configuration import Configuration, begin, go_on, prepare
from handeye.session.deciding import EndReason, Step
from handeye.session.request import Requested
from handeye.session.self_calibration import SelfCalibration, nominal_camera
from handeye.session.simulated import ORDINARY
from handeye.session.store import open_session
from handeye.types import Mounting, View
from sessions import Outcome, configured, run


def unknown(seed: int = 0, lens: str = ORDINARY, **changes: object) -> Configuration:
    quick = configured(seed, **changes)
    return replace(quick, camera_known=False, simulation=replace(quick.simulation, lens=lens))


@pytest.mark.parametrize(
    ("lens", "mounting"),
    [
        ("wide", Mounting.EYE_TO_HAND),
        ("fisheye", Mounting.EYE_IN_HAND),
    ],
)
def test_lens_and_hand_eye_become_as_good_as_asked(lens: str, mounting: Mounting, tmp_path: Path) -> None:
    asked = unknown(3, lens=lens, mounting=mounting)
    prepared = prepare(asked)
    session, store = begin(prepared, tmp_path / "s")
    end = session.run()
    written = store.recording
    store.close()
    assert (end.reason, end.views <= 20) == (EndReason.ACCURACY_REACHED, True)
    assert end.calibration is not None
    assert end.lens_px is not None
    assert prepared.true_camera is not None
    assert prepared.truth is not None
    assert prepared.truth.X is not None
    off = (end.calibration.X @ prepared.truth.X.inverse()).log()
    assert 1e3 * np.linalg.norm(off[:3]) < 0.5
    assert np.rad2deg(np.linalg.norm(off[3:])) < 0.05
    assert lens_difference_px(prepared.true_camera, end.calibration.camera) < 1.0
    assert end.lens_px < 1.0
    # A fisheye is told by the views, and the recording has the camera that they teach.
    assert written.camera.lens == prepared.true_camera.lens
    assert written.camera.from_views
    assert lens_difference_px(prepared.true_camera, written.camera) < 1.0


def test_a_break_changes_nothing(tmp_path: Path) -> None:
    asked = unknown(1)
    run(asked, tmp_path / "undisturbed")
    session, store = begin(prepare(asked), tmp_path / "broken")
    for _ in range(5):
        step = session.next()
        assert isinstance(step, Step)
        session.take(step)
    store.close()
    for name in ("recording.toml", "corners/view_02.csv"):
        (tmp_path / "broken" / name).unlink()
    run(asked, tmp_path / "broken")
    assert Outcome.of(tmp_path / "undisturbed") == Outcome.of(tmp_path / "broken")


def test_an_edited_camera_is_refused(tmp_path: Path) -> None:
    run(unknown(1, most_views=5, accuracy_mm=None), tmp_path)
    file = tmp_path / "recording.toml"
    text = file.read_text()
    (focal,) = re.findall(r"parameters = \[\s*([0-9.]+)", text)[:1]
    file.write_text(text.replace(focal, str(float(focal) + 1.0)))
    with pytest.raises(InputError, match="not those that the session began with"):
        open_session(tmp_path)


def test_points_that_are_no_picture_of_a_flat_target_do_not_teach(tmp_path: Path) -> None:
    prepared = prepare(unknown(2))
    source = prepared.cell.source

    class Shuffled:
        def grab(self, label: str) -> Frame:
            frame = source.grab(label)
            if label != "view_02.1" or frame.points is None:
                return frame
            order = np.random.default_rng(0).permutation(len(frame.points.pixels))
            return Frame(None, Points(frame.points.point_ids, frame.points.pixels[order]))

    session, store = begin(replace(prepared, cell=replace(prepared.cell, source=Shuffled())), tmp_path / "s")
    failures = []
    for _ in range(3):
        step = session.next()
        assert isinstance(step, Step)
        failures.append(session.take(step).failure)
    store.close()
    assert failures == [None, "inconsistent", None]


def test_a_wrong_view_does_not_spoil_the_camera() -> None:
    cell = Cell(np.random.default_rng(4))
    views = list(cell.views([cell.robot_pose(cell.look()) for _ in range(8)], sigma_px=0.1))
    learning = SelfCalibration(cell.target, cell.camera.size_px)
    sound = learning.camera(views)
    spoilt = views[3]
    views[3] = View(spoilt.name, spoilt.T_base_flange, spoilt.point_ids, spoilt.pixels * [1.0, 1.05])
    camera = learning.camera(views)
    assert sound is not None
    assert camera is not None
    assert lens_difference_px(sound, camera) < 1.0
    assert learning.camera(views[:2]) is None
    assert learning.camera(views) is camera is not sound


def test_the_lens_is_part_of_the_request(estimate_of_unknown: Estimate) -> None:
    cell = Cell(np.random.default_rng(4))
    views = cell.views([cell.robot_pose(cell.look()) for _ in range(6)], sigma_px=0.1)
    measurements = Measurements.of(cell.mounting, cell.camera, cell.target, views)
    state = State(measurements, estimate_of_unknown, np.ones(1))
    assert isinstance(Requested(500, 50, 1e4).verdict(state), Stop)
    assert Requested(500, 50, 1e-4).verdict(state) is None
    with pytest.raises(InputError):
        Requested(1, 1, 0.0)


@pytest.fixture
def estimate_of_unknown(tmp_path: Path) -> Estimate:
    session, store = begin(prepare(unknown(1, most_views=6)), tmp_path / "e")
    for _ in range(5):
        step = session.next()
        assert isinstance(step, Step)
        session.take(step)
    step = session.next()
    store.close()
    assert isinstance(step, Step)
    assert step.estimate is not None
    return step.estimate


def test_a_real_camera_is_asked_for_one_picture(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    made = prepare(configured(0, points_only=None))
    asked: list[str] = []
    answer = [made.cell.source.grab("view_01.1")]

    class Watched:
        def grab(self, label: str) -> Frame:
            asked.append(label)
            return answer[0]

    monkeypatch.setattr(opening, "open_robot", lambda *_, **__: made.cell.robot)
    monkeypatch.setattr(configurations, "open_camera", lambda *_, **__: Watched())
    real = replace(
        configured(0), driver="mine", images="mine", workspace_m=((-1.0, -1.0, 0.0), (1.0, 1.0, 1.5))
    )
    prepared = prepare(real, target=made.cell.target)
    assert asked == ["size_of_image"]
    assert prepared.cell.camera == nominal_camera((1280, 1024))
    assert not prepared.configuration.camera_known
    _, store = begin(prepared, tmp_path / "s")
    store.close()
    # What was asked for comes back, and no second picture is taken.
    _, store, again = go_on(tmp_path / "s")
    assert again.cell.camera == prepared.cell.camera
    assert store.self_calibration is not None
    assert len(asked) == 1
    store.close()
    answer[0] = Frame(None, Points(np.zeros(0, dtype=np.int64), np.zeros((0, 2))))
    with pytest.raises(DeviceError, match="size is not known"):
        prepare(real, target=made.cell.target)
    with pytest.raises(InputError, match="expected one of"):
        nominal_camera((640, 480), "brown_conrady_12")
    assert SelfCalibration.of_session({}, prepared.recording) is None


def test_decisions_go_on_from_what_was_known_at_the_beginning(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    made, pictured = prepare(configured(0)), prepare(configured(0, points_only=None))

    class Watched:
        def grab(self, label: str) -> Frame:
            return (pictured if label == "size_of_image" else made).cell.source.grab(label)

    monkeypatch.setattr(opening, "open_robot", lambda *_, **__: made.cell.robot)
    monkeypatch.setattr(configurations, "open_camera", lambda *_, **__: Watched())
    space = ((-1.0, -1.0, 0.0), (1.0, 1.0, 1.5))
    real = replace(configured(0), driver="mine", images="mine", workspace_m=space)
    session, store = begin(prepare(real, target=made.cell.target), tmp_path / "s")
    for _ in range(4):
        step = session.next()
        assert isinstance(step, Step)
        session.take(step)
    store.close()
    _, store, again = go_on(tmp_path / "s")
    assert store.recording.camera.from_views
    assert again.cell.camera == nominal_camera((1280, 1024))
    store.close()
