"""What many views would come to, and the refusal of a request that they would not reach."""

from dataclasses import dataclass

import numpy as np

from handeye.estimation.confidence import Within, within
from handeye.estimation.estimate import Estimate
from handeye.estimation.measurements import Measurements
from handeye.planning.prediction import Prediction, Sight
from handeye.planning.stopping import State, Stop, StopReason, StopRule

# As many as anybody takes.
MANY_VIEWS = 40
# From so few on it is asked: before, nobody knows how noisy the arm is.
FEWEST_VIEWS = 6
# A request is refused where even many views would miss it by this factor: what is believed of the noise after
# few views is rough, and the first of them tell less than those that are chosen later.
MARGIN = 4.0
# Of views that do not determine the answer, a forecast beyond this is what they leave open, not the arm.
OPEN_MM = 100.0


def prospect(estimate: Estimate, measurements: Measurements, views: int = MANY_VIEWS) -> Within:
    """Return how accurate an estimate would be after many views that each tell as much as those taken.

    Noise is believed to be as it is now, and then known.

    Raises
    ------
    DegenerateError
        The information of the views is singular.
    """
    prediction = Prediction(estimate, Sight(known=True))
    joints = None if estimate.arm is None else measurements.joints
    each = prediction.informations(measurements.motions, joints).mean(axis=0)
    after = estimate.information + max(views - len(measurements), 0) * each
    scale = 1 / np.sqrt(np.diag(after))
    inverse = np.asarray(np.linalg.inv(after * np.outer(scale, scale)), np.float64)
    covariance = (inverse * np.outer(scale, scale))[:6, :6]
    return within(prediction.predicted(covariance), float("inf"))


@dataclass(frozen=True)
class OutOfReach(StopRule):
    """Stop where many views would not come near what is asked for: both radii, with 95 % probability."""

    translation_mm: float
    rotation_deg: float

    def verdict(self, state: State) -> Stop | None:
        """Stop as soon as the arm, the board and the camera are known to be too rough."""
        if state.views < FEWEST_VIEWS:
            return None
        now = state.estimate.within_95
        if now.translation_mm <= self.translation_mm and now.rotation_deg <= self.rotation_deg:
            return None
        then = prospect(state.estimate, state.measurements)
        if not state.estimate.determined and then.translation_mm > OPEN_MM:
            return None  # nothing is known of the arm yet, but that the views leave a direction open
        far = then.translation_mm > MARGIN * self.translation_mm
        if not far and not then.rotation_deg > MARGIN * self.rotation_deg:
            return None
        return Stop(
            StopReason.OUT_OF_REACH,
            f"this arm cannot reach {self.translation_mm:g} mm and {self.rotation_deg:g} deg, as asked; "
            f"with {MANY_VIEWS} views it would come to {then.translation_mm:.2g} mm and "
            f"{then.rotation_deg:.2g} deg",
            {
                "views": MANY_VIEWS,
                "translation_mm": then.translation_mm,
                "rotation_deg": then.rotation_deg,
            },
        )
