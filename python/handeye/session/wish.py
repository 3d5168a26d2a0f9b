"""What a run is asked for."""

from dataclasses import dataclass, field

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation import Estimate, Measurements
from handeye.estimation.height import Height
from handeye.estimation.work import Work
from handeye.planning.policies import Policy
from handeye.planning.policies.next_best_view import NextBestView
from handeye.planning.prospect import OutOfReach
from handeye.planning.stopping import NumberOfViews, StopRule
from handeye.planning.touch import TouchAccuracy, touch_criterion
from handeye.session.request import Requested
from handeye.types.calibration import ModelName


@dataclass(frozen=True)
class Wish:
    """What is asked for.

    Parameters
    ----------
    accuracy_mm, accuracy_deg
        Radii within which the error shall lie with 95 % probability; None to take all views.
    most_views
        Stop at so many views in any case.
    seed
        Of every choice by chance.
    failures_in_a_row
        Stop after so many attempts without a view.
    tries_at_a_place
        Attempts at one goal where nothing says that the place is to blame.
    speed_rad_s
        No joint moves faster.
    joints_err
        Weigh noise and offsets of the joints as causes of error: the description of the arm is known anyway.
    touch_mm
        Touch error to reach over the place of work, in place of the accuracy; None for none.
    work
        What is seen and touched.
    height
        Of the target, as measured, for an arm that turns about one axis only.
    refine
        Climb from the best candidates to better ones near them, rather than take the best that was drawn.
    camera_to_camera
        With several cameras: radii (mm, deg) for those of one body in each other; None for none.
    anyway
        Go on to the most views although the accuracy asked for is out of reach.
    accuracy_px
        Where the views teach the camera too: how well, see `Requested`. None for a calibrated camera.

    Raises
    ------
    InputError
        A value out of its range.

    Examples
    --------
    >>> Wish(accuracy_mm=0.2, accuracy_deg=0.02).most_views
    20
    """

    accuracy_mm: float | None = 0.5
    accuracy_deg: float | None = 0.05
    most_views: int = 20
    seed: int = 0
    model: ModelName = ModelName.AUTO
    failures_in_a_row: int = 10
    tries_at_a_place: int = 3
    speed_rad_s: float = 0.5
    joints_err: bool = True
    refine: bool = True
    policy: Policy = field(default_factory=NextBestView)
    anyway: bool = False
    accuracy_px: float | None = None
    touch_mm: float | None = None
    work: Work = field(default_factory=Work)
    camera_to_camera: tuple[float, float] | None = None
    height: Height | None = None

    def __post_init__(self) -> None:
        self.rules()  # checks what they check
        if self.seed < 0:
            raise InputError(f"seed {self.seed}, expected zero or more", code=Code.OUT_OF_RANGE)
        if not 0 < self.speed_rad_s < float("inf") or min(self.failures_in_a_row, self.tries_at_a_place) < 1:
            raise InputError("a speed above zero and at least one attempt are needed", code=Code.OUT_OF_RANGE)

    def rules(self) -> tuple[StopRule, ...]:
        """Return when to stop, in the order asked."""
        number = NumberOfViews(self.most_views)
        if self.touch_mm is not None:
            return TouchAccuracy(self.work, self.touch_mm), number
        if self.accuracy_mm is None or self.accuracy_deg is None:
            return (number,)
        asked = Requested(self.accuracy_mm, self.accuracy_deg, self.accuracy_px)
        # A camera that the views teach is rough at first in a way that soon passes.
        if self.anyway or self.accuracy_px is not None:
            return asked, number
        return asked, OutOfReach(self.accuracy_mm, self.accuracy_deg), number

    def criterion(self, estimate: Estimate, measurements: Measurements) -> _core.Criterion:
        """Return what a view is worth now: what it takes off the touch error, where that is asked for."""
        if self.touch_mm is None or not estimate.determined:
            return _core.Criterion("entropy")
        return touch_criterion(estimate, measurements, self.work)
