"""How the answer came about: what would have been known after fewer views, and what a session tried."""

from pathlib import Path

import numpy as np

from handeye.errors import HandeyeError, InputError
from handeye.estimation import Measurements, make_estimator
from handeye.report.document import Attempt, CurvePoint, Request, Within
from handeye.robots import ArmKinematics, arm_kinematics, open_arm
from handeye.session.deciding import START_VIEWS
from handeye.session.journal import read_journal, read_settings
from handeye.session.settings import Configuration
from handeye.session.store import is_session
from handeye.types import Recording
from handeye.types.calibration import ModelName

# Numbers of views that are looked at: each takes an estimate.
MOST_POINTS = 14


def doubt(folder: Path) -> str | None:
    """Say why what a session says of itself is not to be believed; None where it is, or there is no session.

    Its settings or its journal were changed, cut or lost. The recording beside them may be whole.
    """
    if not is_session(folder):
        return None
    try:
        Configuration.from_dict(read_settings(folder).asked.get("configuration"))
        read_journal(folder)
    except InputError as error:
        return f"{error.message}; this page is of the recording alone"
    return None


def arm_of(folder: Path, recording: Recording, model: ModelName) -> ArmKinematics | None:
    """Return the arm whose joints a session weighed; None where the folder is no session, or it did not.

    An arm whose file is gone is not known either, nor one that has another number of joints.
    """
    if not is_session(folder) or model is not ModelName.AUTO:
        return None
    asked = Configuration.from_dict(read_settings(folder).asked.get("configuration"))
    if asked.robot is None or not asked.joints_err:
        return None
    try:
        arm = open_arm(asked.robot)
        if any(view.joints_rad is None or len(view.joints_rad) != len(arm) for view in recording.views):
            return None
        # A recording may be in other frames than the description; a driver reports in its frames.
        return arm_kinematics(arm, recording.views) if asked.is_replay else ArmKinematics(arm)
    except InputError:
        return None


def curve(
    measurements: Measurements, model: ModelName, kinematics: ArmKinematics | None = None
) -> list[CurvePoint]:
    """Return what would have been known after the first views, in the order of recording.

    Numbers of views that do not determine the answer are left out.
    """
    count = len(measurements)
    if count < START_VIEWS:
        return []
    steps = np.unique(
        np.linspace(START_VIEWS, count, min(MOST_POINTS, count - START_VIEWS + 1)).round().astype(int)
    )
    estimator = make_estimator(model, kinematics)
    points: list[CurvePoint] = []
    for views in steps.tolist():
        try:
            estimate = estimator(measurements.select(range(views)))
        except HandeyeError:
            continue
        if estimate.determined:
            now = estimate.within_95
            within = Within(translation_mm=now.translation_mm, rotation_deg=now.rotation_deg)
            points.append(CurvePoint(views=views, within_95=within))
    return points


def attempts(folder: Path) -> list[Attempt]:
    """Return the attempts of a session that brought no view; none where the folder is no session."""
    if not is_session(folder):
        return []
    return [
        Attempt(label=entry.label, failure=entry.failure.value, detail=entry.detail)
        for entry in read_journal(folder).entries
        if entry.failure is not None
    ]


def request(folder: Path, within: Within) -> Request | None:
    """Return what a session was asked for; None where the folder is no session or nothing was asked.

    A touch error, or a lens, is asked for in other terms than these radii.
    """
    if not is_session(folder):
        return None
    asked = Configuration.from_dict(read_settings(folder).asked.get("configuration"))
    if asked.accuracy_mm is None or asked.accuracy_deg is None:
        return None
    if asked.touch_mm is not None or not asked.camera_known:
        return None
    return Request(
        translation_mm=asked.accuracy_mm,
        rotation_deg=asked.accuracy_deg,
        met=within.translation_mm <= asked.accuracy_mm and within.rotation_deg <= asked.accuracy_deg,
    )
