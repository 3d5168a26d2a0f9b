"""How accurate the answer must be, as people ask for it: with a probability, at the camera."""

from dataclasses import dataclass

from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.lens_confidence import lens_within_px
from handeye.planning import Stop, StopReason, StopRule
from handeye.planning.stopping import State


@dataclass(frozen=True)
class Requested(StopRule):
    """Stop once the error lies within both radii with 95 % probability.

    Where the camera is found from the same views, the lens must be known too: with 95 % probability pixels
    lie within `lens_px` of where they belong, in the root mean square over the image.

    Raises
    ------
    InputError
        A radius that is not above zero.

    Examples
    --------
    >>> Requested(translation_mm=0.5, rotation_deg=0.05).fewest_views
    6
    """

    translation_mm: float
    rotation_deg: float
    lens_px: float | None = None
    fewest_views: int = 6

    def __post_init__(self) -> None:
        if not (self.translation_mm > 0 and self.rotation_deg > 0):
            raise InputError(
                f"accuracy {self.translation_mm} mm and {self.rotation_deg} deg, expected above zero",
                code=Code.OUT_OF_RANGE,
            )
        if self.lens_px is not None and not self.lens_px > 0:
            raise InputError(f"accuracy {self.lens_px} px, expected above zero", code=Code.OUT_OF_RANGE)

    def verdict(self, state: State) -> Stop | None:
        """Stop once it is reached."""
        if state.views < self.fewest_views or not state.estimate.determined:
            return None
        now = state.estimate.within_95
        if now.translation_mm > self.translation_mm or now.rotation_deg > self.rotation_deg:
            return None
        evidence = {"translation_mm": now.translation_mm, "rotation_deg": now.rotation_deg}
        reached = f"{now.translation_mm:.2g} mm and {now.rotation_deg:.2g} deg"
        if self.lens_px is not None:
            lens_px = lens_within_px(state.estimate)
            if lens_px > self.lens_px:
                return None
            evidence["lens_px"] = lens_px
            reached += f", the lens within {lens_px:.2g} px"
        return Stop(
            StopReason.ACCURACY_REACHED, f"with 95 % probability within {reached}, as asked", evidence
        )
