"""What a recording brought, view by view, and what planning would have made of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation import Estimate, Estimator, Measurements
from handeye.estimation.confidence import Within, within
from handeye.estimation.initialize import check_views
from handeye.planning.prediction import Prediction, Sight, gains
from handeye.types.arrays import FloatArray

E = TypeVar("E")
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


class Stations(Protocol[E]):
    """What is gone through again: stations in the order in which they were taken, and estimates from some.

    Examples
    --------
    >>> Pictures(measurements, AutoEstimator()).names[0] == recording.views[0].name  # is one
    True
    """

    @property
    def names(self) -> Sequence[str]:
        """Names of the stations."""
        ...

    def solve(self, chosen: list[int], previous: E | None) -> E | None:
        """Estimate from some of them, an earlier estimate as a start; None where there is no answer."""
        ...

    def known(self, estimate: E) -> Within | None:
        """How far off an estimate may be; None while something is open."""
        ...

    def worth(self, estimate: E, left: list[int]) -> FloatArray:
        """(len(left),) what stations would add to an estimate; NaN where that cannot be said."""
        ...

    def more(self, estimate: E, count: int) -> tuple[tuple[str, ...], Within | None]:
        """Choose poses to go to once more: their names, and how far off the answer may be then."""
        ...


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
    """

    steps: tuple[After, ...]
    planned: tuple[After, ...]
    enough: int | None
    repeat: tuple[str, ...]
    then: Within | None

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


def hindsight(stations: Stations[E]) -> Hindsight:
    """Go through a recording again.

    Raises
    ------
    InputError
        Fewer than three stations.
    """
    count = len(stations.names)
    if count < START:
        raise InputError(f"{count} views, at least {START} are needed", code=Code.TOO_FEW_VIEWS)
    recorded = [list(range(k)) for k in range(START, count + 1)]
    final = None
    found: list[E | None] = []
    for order in recorded:
        final = stations.solve(order, final)
        found.append(final)
    steps = _after(stations, recorded, found)
    chosen = list(range(START))
    orders, planned = [list(chosen)], [found[0]]
    left = list(range(START, count))
    while left:
        now = planned[-1]
        worth = np.full(len(left), np.nan) if now is None else stations.worth(now, left)
        best = 0 if np.isnan(worth).all() else int(np.nanargmax(worth))
        chosen = [*chosen, left.pop(best)]
        orders.append(chosen)
        planned.append(stations.solve(chosen, planned[-1]))
    by_plan = _after(stations, orders, planned)
    reached = steps[-1].within
    good = [k for k, step in enumerate(by_plan) if reached is not None and _reaches(step.within, reached)]
    repeat, then = ((), None) if final is None or reached is None else stations.more(final, MORE)
    return Hindsight(steps, by_plan, START + good[0] if good else None, repeat, then)


def _reaches(one: Within | None, other: Within) -> bool:
    """Tell whether an estimate is as good as another, up to what counts as nothing."""
    most = 1 + NOTHING
    return (
        one is not None
        and one.translation_mm <= most * other.translation_mm
        and one.rotation_deg <= most * other.rotation_deg
    )


def _after(
    stations: Stations[E], orders: Sequence[list[int]], estimates: Sequence[E | None]
) -> tuple[After, ...]:
    steps: list[After] = []
    for order, estimate in zip(orders, estimates, strict=True):
        now = None if estimate is None else stations.known(estimate)
        before = steps[-1].within if steps else None
        useless = (
            now is not None
            and before is not None
            and now.translation_mm > (1 - NOTHING) * before.translation_mm
            and now.rotation_deg > (1 - NOTHING) * before.rotation_deg
        )
        steps.append(After(stations.names[order[-1]], now, useless))
    return tuple(steps)


@dataclass(frozen=True)
class Pictures:
    """Views with pictures, as `Stations`.

    Raises
    ------
    InputError
        Fewer than three usable views.

    Examples
    --------
    >>> hindsight(Pictures(measurements.select([0, 1, 2, 3]), AutoEstimator())).steps[0].view
    'view_003'
    """

    measurements: Measurements
    estimator: Estimator

    def __post_init__(self) -> None:
        check_views(self.measurements)

    @property
    def names(self) -> Sequence[str]:
        """Names of the views."""
        return [view.name for view in self.measurements.views]

    def solve(self, chosen: list[int], previous: Estimate | None) -> Estimate:
        """Estimate from some views."""
        return self.estimator(self.measurements.select(chosen), previous)

    def known(self, estimate: Estimate) -> Within | None:
        """How far off an estimate may be; None while something is open."""
        return estimate.within_95 if estimate.determined else None

    def worth(self, estimate: Estimate, left: list[int]) -> FloatArray:
        """(len(left),) the gain of each view, in entropy."""
        pool = self.measurements.select(left)
        joints = None if estimate.arm is None else pool.joints
        return gains(estimate, _core.Criterion("entropy"), pool.motions, Sight(known=True), joints=joints)

    def more(self, estimate: Estimate, count: int) -> tuple[tuple[str, ...], Within | None]:
        """Choose recorded poses to take pictures at once more, and predict what they bring."""
        motions = self.measurements.motions
        joints = None if estimate.arm is None else self.measurements.joints
        prediction = Prediction(estimate, Sight(known=True))
        views = prediction.informations(motions, joints)
        information = estimate.information
        names: list[str] = []
        for _ in range(count):
            now = Prediction(replace(estimate, information=information), Sight(known=True))
            worth = now.gains(_core.Criterion("entropy_handeye"), motions, joints)
            if np.isnan(worth).all():
                return (), None
            best = int(np.nanargmax(worth))
            names.append(self.names[best])
            information = information + views[best]
        covariance = np.asarray(np.linalg.inv(information), np.float64)[:6, :6]
        return tuple(names), within(prediction.predicted(covariance), estimate.degrees_of_freedom)
