"""Planning for the touch error: what a view is worth by it, and when it is small enough."""

from dataclasses import dataclass

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.estimate import Estimate
from handeye.estimation.measurements import Measurements
from handeye.estimation.touch import touch_rows
from handeye.estimation.work import Work, lay_out, touch_map
from handeye.planning.stopping import State, Stop, StopReason, StopRule
from handeye.types.units import MM_PER_M

# As for any request: of fewer views nobody knows how well the noise is known.
FEWEST_VIEWS = 6


def touch_criterion(estimate: Estimate, measurements: Measurements, work: Work) -> _core.Criterion:
    """Return the criterion by which a view is worth what it takes off the root mean square touch error.

    It is that of this estimate: make it again after every view.

    Raises
    ------
    InputError
        No point of the box can be seen and reached.
    """
    rows, _ = touch_rows(estimate, lay_out(estimate, measurements, work).touches)
    return _core.Criterion("task", tasks=rows)


@dataclass(frozen=True)
class TouchAccuracy(StopRule):
    """Stop once a touch lands within a radius with 95 % probability, wherever in the box of work.

    Raises
    ------
    InputError
        A radius that is not above zero.
    """

    work: Work
    radius_mm: float
    fewest_views: int = FEWEST_VIEWS

    def __post_init__(self) -> None:
        if not self.radius_mm > 0:
            raise InputError(f"touch error {self.radius_mm} mm, expected above zero", code=Code.OUT_OF_RANGE)

    def verdict(self, state: State) -> Stop | None:
        """Stop once the worst point of the box is good enough."""
        if state.views < self.fewest_views or not state.estimate.determined:
            return None
        found = touch_map(state.estimate, state.measurements, self.work)
        worst = found.worst_m * MM_PER_M
        if worst > self.radius_mm:
            return None
        return Stop(
            StopReason.ACCURACY_REACHED,
            f"a touch lands within {worst:.2g} mm with 95 % probability, as asked",
            {"worst_mm": worst, "mean_mm": found.mean_m * MM_PER_M, "asked_mm": self.radius_mm},
        )
