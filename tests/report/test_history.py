"""How the answer came about."""

from pathlib import Path
from typing import Any

import pytest

from commands import Handeye
from handeye.estimation import Measurements, make_estimator
from handeye.report.document import Within
from handeye.report.history import MOST_POINTS, attempts, curve, request
from handeye.session.entry import Entry, Failure
from handeye.session.settings import Configuration
from handeye.session.store import create_session
from handeye.types import Pose
from handeye.types.calibration import ModelName
from pages import opened_cell
from sessions import configured, run


@pytest.fixture
def session(tmp_path: Path) -> Path:
    """A session that asked for half a millimetre, and in which one attempt failed."""
    folder = tmp_path / "session"
    configuration = Configuration("epson_c4l", accuracy_mm=0.5, accuracy_deg=0.05)
    store = create_session(
        folder, opened_cell().recording.with_views(()), {"configuration": configuration.to_dict()}
    )
    failed = Entry(
        1,
        "view_01.1",
        "start",
        Pose.identity(),
        (0.0,),
        moved=True,
        failure=Failure.POOR_IMAGE,
        detail="blurred",
    )
    store.append(failed)
    store.close()
    return folder


def test_curve_is_what_the_first_views_say() -> None:
    measurements = Measurements.of_recording(opened_cell(count=9).recording)
    points = curve(measurements, ModelName.AUTO)
    assert points[-1].views == 9
    assert [point.views for point in points] == sorted({point.views for point in points})
    for point in (points[0], points[-1]):
        now = make_estimator(ModelName.AUTO)(measurements.select(range(point.views))).within_95
        assert point.within_95 == Within(translation_mm=now.translation_mm, rotation_deg=now.rotation_deg)
    assert points[-1].within_95.translation_mm < points[0].within_95.translation_mm


def test_curve_of_many_views_has_few_points() -> None:
    measurements = Measurements.of_recording(opened_cell(count=30).recording)
    points = curve(measurements, ModelName.PAPER)
    assert len(points) <= MOST_POINTS
    assert points[-1].views == 30


def test_too_few_views_have_no_curve() -> None:
    measurements = Measurements.of_recording(opened_cell(count=5).recording).select([0, 1])
    assert curve(measurements, ModelName.AUTO) == []


@pytest.mark.parametrize("asked", [{"touch_mm": 0.5}, {"camera_known": False}])
def test_what_is_asked_for_in_other_terms_is_not_judged_by_these(
    tmp_path: Path, asked: dict[str, Any]
) -> None:
    settings = {"configuration": Configuration("epson_c4l", **asked).to_dict()}
    create_session(tmp_path / "s", opened_cell().recording.with_views(()), settings).close()
    assert request(tmp_path / "s", Within(translation_mm=0.1, rotation_deg=0.01)) is None


def test_session_tells_request_and_failures(session: Path) -> None:
    (attempt,) = attempts(session)
    assert (attempt.label, attempt.failure, attempt.detail) == ("view_01.1", "poor_image", "blurred")
    met = request(session, Within(translation_mm=0.4, rotation_deg=0.04))
    assert met is not None
    assert met.met
    for missed in (
        Within(translation_mm=0.6, rotation_deg=0.04),
        Within(translation_mm=0.4, rotation_deg=0.06),
    ):
        asked = request(session, missed)
        assert asked is not None
        assert not asked.met


def test_other_folders_have_neither(tmp_path: Path) -> None:
    assert attempts(tmp_path) == []
    assert request(tmp_path, Within(translation_mm=1.0, rotation_deg=1.0)) is None


@pytest.mark.parametrize("spoilt", ["journal.jsonl", "session.json", None])
def test_a_session_that_cannot_go_on_is_reported_from_its_recording(
    handeye: Handeye, tmp_path: Path, spoilt: str | None
) -> None:
    folder = tmp_path / "session"
    run(configured(4, most_views=4, accuracy_mm=None, accuracy_deg=None), folder)
    if spoilt is None:
        # A reading of the wrong length, as sessions of before took.
        path = folder / "recording.toml"
        joints = "joints_rad = ["
        head, _, rest = path.read_text().rpartition(joints)
        path.write_text(f"{head}{joints}0.1, 0.2, 0.3]{rest[rest.index(']') + 1 :]}")
    else:
        path = folder / spoilt
        path.write_bytes(path.read_bytes().replace(b"view_0", b"view_1", 1).replace(b"seed", b"sead", 1))
    told = handeye.json("report", folder, "--output", tmp_path / "page.html")
    assert told["answer"]
    assert (tmp_path / "page.html").exists()
    assert any("recording alone" in warning for warning in told["warnings"]) == (spoilt is not None)
    assert (told["request"] is None) or spoilt is None
