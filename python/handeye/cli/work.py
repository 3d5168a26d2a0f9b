"""The options that say what is seen and touched, and how the touch error is told."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cyclopts import Parameter

from handeye.cli.failures import UsageError
from handeye.estimation.height import Height
from handeye.estimation.touch import Depth
from handeye.estimation.work import USUAL_TOOL_M, Work
from handeye.types.calibration import ModelName
from handeye.types.touch import TouchMap, WorkBox
from handeye.types.units import MM_PER_M

if TYPE_CHECKING:
    from collections.abc import Iterable

_TOOL_MM = (USUAL_TOOL_M[0] * MM_PER_M, USUAL_TOOL_M[1] * MM_PER_M, USUAL_TOOL_M[2] * MM_PER_M)
_NAMES = {
    "camera": "the camera's parameters",
    "hand_eye": "the hand-eye",
    "arm": "constants of the arm",
    "board": "the size of the board",
    "robot_noise": "what the arm errs by each time",
}


@Parameter(name="*", group="What is seen and touched")
@dataclass(frozen=True)
class WorkOptions:
    """Where the tool works, for the touch error."""

    work_box_mm: tuple[float, float, float, float, float, float] | None = None
    """Box in the frame of the base in which things are seen and touched: least x y z, largest x y z. Without
    it, where the board was seen."""
    tool_mm: tuple[float, float, float] = _TOOL_MM
    """Tip of the tool in the frame of the flange."""
    depth: Depth = Depth.SIZE
    """Where the distance of a seen point comes from: size (how large a part of known size looks) or sensor
    (anything that does not err)."""

    def work(self) -> Work:
        """Return it as the library takes it.

        Raises
        ------
        InputError
            A box without inside.
        """
        x, y, z = (value / MM_PER_M for value in self.tool_mm)
        box = None if self.work_box_mm is None else WorkBox.of_mm(self.work_box_mm)
        return Work(box, (x, y, z), self.depth)


def height_of(height_mm: tuple[float, float] | None, model: ModelName) -> Height | None:
    """Return a height as the library takes it.

    Raises
    ------
    UsageError
        The paper's model, which has no place for it.
    InputError
        A height that is no number, or known exactly.
    """
    if height_mm is None:
        return None
    if model is ModelName.PAPER:
        raise UsageError("the paper's model takes no height", hint="leave --model out")
    at, sigma = height_mm
    return Height(at / MM_PER_M, sigma / MM_PER_M)


def work_words(work: Work) -> list[str]:
    """Return the options that say what is not as usual."""
    words: list[str] = []
    if work.box is not None:
        corners = (*work.box.lower_m, *work.box.upper_m)
        words += ["--work-box-mm", *(f"{value * MM_PER_M:.10g}" for value in corners)]
    if work.tool_m != USUAL_TOOL_M:
        words += ["--tool-mm", *(f"{value * MM_PER_M:.10g}" for value in work.tool_m)]
    if work.depth is not Depth.SIZE:
        words += ["--depth", work.depth.value]
    return words


def check_touch(touch_mm: float | None) -> None:
    """Refuse a request that nothing can meet.

    Raises
    ------
    UsageError
        Not above zero.
    """
    if touch_mm is not None and not 0 < touch_mm < float("inf"):
        raise UsageError(f"--touch-mm {touch_mm}, expected above zero")


def touch_lines(found: TouchMap) -> "Iterable[tuple[str, str]]":
    """Return the touch error in words."""
    from handeye.cli.wording import figures, length_mm  # noqa: PLC0415 - JSON need not wait for it

    where = "the box of work" if found.stated else "where the board was"
    x, y, z = (figures(value * MM_PER_M) for value in found.worst_at_m)
    mean, worst = length_mm(found.mean_m), length_mm(found.worst_m)
    yield "touch error", f"{mean} on average over {where}, {worst} at worst (at {x} {y} {z} mm), with 95 %"
    shares = ", ".join(f"{_NAMES[name]} {share:.0%}" for name, share in found.named_limits)
    yield "", f"would fall in variance if known exactly: {shares}"
    yield "", found.advice
    if found.as_reported_m > found.mean_m * 1.05:
        yield (
            "",
            f"{length_mm(found.as_reported_m)} where the arm's poses are used as reported, not put right",
        )
