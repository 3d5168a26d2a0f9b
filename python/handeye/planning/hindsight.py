"""What a recording brought, view by view, and what planning would have made of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye import _core
from handeye.estimation import Estimate, Estimator, Measurements
from handeye.estimation.confidence import Within, within
from handeye.estimation.initialize import check_views
from handeye.planning.prediction import Prediction, Sight, gains

# A view that takes less than this off both radii did nothing.
NOTHING = 0.02
START = 3
MORE = 3


@dataclass(frozen=True)
class After:
    """What was known once a view was taken.

    Parameters
    ----------
    view
        Its name.
    within
        Radii within which the error lies with 95 %; None while something is open.
    useless
        Whether it took hardly anything off them.
    """

    view: str
    within: Within | None
    useless: bool


@dataclass(frozen=True)
class Hindsight:
    """What a recording brought.

    Parameters
    ----------
    steps
        After each view from the third on, in the order in which they were taken.
    planned
        The same with views of the recording chosen one by one by what they teach, from the same first three.
    enough
        Views that a planned session would have needed for what all views brought.
    repeat
        Recorded poses that would help most if pictures were taken there once more.
    then
        Radii predicted after those.
    final
        What all views say.
    """

    steps: tuple[After, ...]
    planned: tuple[After, ...]
    enough: int | None
    repeat: tuple[str, ...]
    then: Within | None
    final: Estimate

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""

        def steps(some: Sequence[After]) -> list[dict[str, Any]]:
            return [
                {
                    "view": step.view,
                    "within_95": None if step.within is None else step.within.to_dict(),
                    "did_nothing": step.useless,
                }
                for step in some
            ]

        return {
            "steps": steps(self.steps),
            "planned": steps(self.planned),
            "enough": self.enough,
            "repeat": list(self.repeat),
            "then_within_95": None if self.then is None else self.then.to_dict(),
        }


def hindsight(measurements: Measurements, estimator: Estimator) -> Hindsight:
    """Go through a recording again.

    Raises
    ------
    InputError
        Fewer than three usable views.
    """
    check_views(measurements)
    count = len(measurements)
    recorded = [list(range(k)) for k in range(START, count + 1)]
    estimates = _estimates(measurements, estimator, recorded)
    final = estimates[-1]
    steps = _after(measurements, recorded, estimates)
    chosen = list(range(START))
    orders, planned = [list(chosen)], [estimates[0]]
    left = list(range(START, count))
    while left:
        pool = measurements.select(left)
        joints = None if planned[-1].arm is None else pool.joints
        worth = gains(planned[-1], _core.Criterion("entropy"), pool.motions, Sight(known=True), joints=joints)
        best = 0 if np.isnan(worth).all() else int(np.nanargmax(worth))
        chosen = [*chosen, left.pop(best)]
        orders.append(chosen)
        planned.append(estimator(measurements.select(chosen), planned[-1]))
    by_plan = _after(measurements, orders, planned)
    enough = None
    if final.determined:
        good = [k for k, one in enumerate(planned) if one.determined and _reaches(one, final)]
        enough = START + good[0] if good else None
    repeat, then = _repeated(measurements, final)
    return Hindsight(steps, by_plan, enough, repeat, then, final)


def _estimates(
    measurements: Measurements, estimator: Estimator, orders: Sequence[list[int]]
) -> list[Estimate]:
    found: list[Estimate] = []
    for order in orders:
        found.append(estimator(measurements.select(order), found[-1] if found else None))
    return found


def _reaches(one: Estimate, other: Estimate) -> bool:
    """Tell whether an estimate is as good as another, up to what counts as nothing."""
    a, b = one.within_95, other.within_95
    most = 1 + NOTHING
    return a.translation_mm <= most * b.translation_mm and a.rotation_deg <= most * b.rotation_deg


def _after(
    measurements: Measurements, orders: Sequence[list[int]], estimates: Sequence[Estimate]
) -> tuple[After, ...]:
    steps: list[After] = []
    for order, estimate in zip(orders, estimates, strict=True):
        now = estimate.within_95 if estimate.determined else None
        before = steps[-1].within if steps else None
        useless = (
            now is not None
            and before is not None
            and now.translation_mm > (1 - NOTHING) * before.translation_mm
            and now.rotation_deg > (1 - NOTHING) * before.rotation_deg
        )
        steps.append(After(measurements.views[order[-1]].name, now, useless))
    return tuple(steps)


def _repeated(measurements: Measurements, final: Estimate) -> tuple[tuple[str, ...], Within | None]:
    """Choose recorded poses to take pictures at once more, and predict what they bring."""
    if not final.determined:
        return (), None
    joints = None if final.arm is None else measurements.joints
    prediction = Prediction(final, Sight(known=True))
    views = prediction.informations(measurements.motions, joints)
    information = final.information
    names: list[str] = []
    for _ in range(MORE):
        now = Prediction(replace(final, information=information), Sight(known=True))
        worth = now.gains(_core.Criterion("entropy_handeye"), measurements.motions, joints)
        if np.isnan(worth).all():
            return (), None
        best = int(np.nanargmax(worth))
        names.append(measurements.views[best].name)
        information = information + views[best]
    covariance = np.asarray(np.linalg.inv(information), np.float64)[:6, :6]
    return tuple(names), within(prediction.predicted(covariance), final.degrees_of_freedom)
