"""A robot without a driver: a person drives where the tool says, and says where the arm stands."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from handeye.codes import Code
from handeye.errors import DeviceError, HandeyeError, InputError
from handeye.notations import (
    NOTATIONS,
    SHOWN,
    Notation,
    Unit,
    example,
    pose_text,
    read_numbers,
    read_pose_text,
)
from handeye.notations.text import MAX_TEXT
from handeye.robots.model import Arm
from handeye.robots.protocol import Goal, Reading
from handeye.robots.reading import checked_reading
from handeye.types import Pose
from handeye.types.arrays import FloatArray

SKIP = frozenset({"skip", "no", "s"})
UR = NOTATIONS["ur"]
# A flange is not as near to the middle of its base, or farther away than its links are long and this.
_NEAREST_M, _SLACK_M = 0.01, 0.5


class ManualRobot:
    """Prints goals and reads poses.

    Parameters
    ----------
    ask
        Shows a question and returns the line that was typed.
    tell
        Shows a text.
    notation
        How the pose is read back; goals are shown in it first.
    unit
        Unit of its lengths; None for that of the notation, which for UR is what the pendant shows.
    arm
        Description of the arm, by which what was typed is checked; joints are asked for and shown only then.
    joints_told
        Whether joints are told with every pose; None to leave that to the first answer.
    notations
        All notations in which goals are shown.

    A pose is typed or pasted in the notation, or it is the name of a file that holds it. What is read back is
    used, wherever the goal was. `skip` refuses a motion. Joints that nobody tells are not known: none are
    shown then, as the arm may reach the pose by another posture.
    """

    def __init__(
        self,
        ask: Callable[[str], str],
        tell: Callable[[str], None],
        notation: Notation = UR,
        *,
        unit: Unit | None = None,
        arm: Arm | None = None,
        joints_told: bool | None = None,
        notations: Sequence[Notation] = SHOWN,
    ) -> None:
        self._ask = ask
        self._tell = tell
        self._notation, self._unit = notation, unit
        self._notations = [notation, *(other for other in notations if other is not notation)]
        self._arm = arm
        self._joints_told = joints_told if arm is not None else False
        self._reading: Reading | None = None
        self._doubtful = True

    def move_to(self, goal: Goal) -> None:
        """Say where to go, and take the pose that was reached.

        Raises
        ------
        DeviceError
            The person will not go there.
        """
        # Without a description there is nobody to say whose joints these are.
        shown = goal.joints_rad if self._arm is None or self._joints_told else None
        told = Goal(goal.label, goal.T_base_flange, shown, goal.speed_rad_s)
        self._tell(describe(told, self._notations, () if self._arm is None else self._arm.sliding))
        self._doubtful = True
        self._reading = self._read(f"{goal.label}: pose reached", shown) or self._reading
        self._doubtful = False

    def read_pose(self) -> Reading:
        """Return the pose that was typed last; asks for it before the first motion and after a refused one.

        Raises
        ------
        DeviceError
            The person will not say.
        """
        if self._reading is None or self._doubtful:
            still = "" if self._reading is None else "Enter if it has not moved, "
            found = self._read("pose of the flange now", None, still)
            self._reading = found or self._reading
        if self._reading is None:
            raise DeviceError("nobody says where the arm stands", code=Code.NO_ANSWER)
        self._doubtful = False
        return self._reading

    def stop(self) -> None:
        """Say that the arm must not move."""
        self._tell("Stop: leave the arm where it is.")

    def _read(self, question: str, shown: Sequence[float] | None, also: str = "") -> Reading | None:
        """Return what is typed, None where that may be and is nothing."""
        prompt = (
            f"{question} ({self._notation.name}: {units_of(self._notation, self._unit)}; {also}or skip): "
        )
        while True:
            text = self._answer(prompt)
            if not text and also:
                return None
            try:
                reading = Reading(self._plausible(typed_pose(_or_file(text), self._notation, self._unit)))
                if self._arm is None:
                    return reading
                joints = self._joints(self._arm, shown)
                # Words about joints that were typed wrongly are words of a driver that reads wrongly.
                return checked_reading(Reading(reading.T_base_flange, joints), self._arm, joints_needed=False)
            except HandeyeError as error:
                if error.code in {Code.MOTION_REFUSED, Code.NO_ANSWER}:
                    raise
                self._tell(f"{error.message}; a pose is written as {example(self._notation, self._unit)}")

    def _joints(self, arm: Arm, shown: Sequence[float] | None) -> tuple[float, ...] | None:
        if self._joints_told is False:
            return None
        units = "deg, mm where they slide" if any(arm.sliding) else "deg"
        enter = "; Enter if they are those shown" if shown is not None else ""
        if self._joints_told is None:
            enter = "; Enter if nobody can tell, and no joints are shown then"
        text = self._answer(f"its {len(arm)} joint positions ({units}{enter}): ")
        if not text and self._joints_told is None:
            self._joints_told = False
            return None
        if not text and shown is not None:
            return tuple(shown)
        joints = joints_of_numbers(arm, read_numbers(text))
        self._joints_told = True
        return tuple(joints.tolist())

    def _answer(self, question: str) -> str:
        try:
            text = self._ask(question).strip()
        except EOFError as error:
            raise DeviceError("nobody answers", code=Code.NO_ANSWER) from error
        if text.lower() in SKIP:
            raise DeviceError("skipped by hand", code=Code.MOTION_REFUSED)
        return text

    def _plausible(self, pose: Pose) -> Pose:
        """Return a pose that the arm can have, as far as its length tells.

        Raises
        ------
        InputError
            Too far away or too near: most likely in other units.
        """
        if self._arm is None:
            return pose
        far = float(np.linalg.norm(pose.translation))
        reach = total_reach_m(self._arm)
        if _NEAREST_M <= far <= reach:
            return pose
        raise InputError(
            f"the flange would be {1e3 * far:.4g} mm from the base, and {self._arm.name} is within "
            f"{1e3 * reach:.0f} mm; expected {units_of(self._notation, self._unit)}",
            code=Code.OUT_OF_REACH,
        )


def total_reach_m(arm: Arm) -> float:
    """Return a distance from its base that the flange is never away, with room for a base of its own."""
    low, high = arm.limits.T
    slides = np.array(arm.sliding)
    ways = np.where(slides & np.isfinite(low) & np.isfinite(high), np.maximum(abs(low), abs(high)), 0.0)
    first = float(np.linalg.norm(arm.joints[0].placement.translation))
    return arm.reach_m + first + float(ways[slides].sum()) + _SLACK_M


def joints_of_numbers(arm: Arm, numbers: Sequence[float]) -> FloatArray:
    """(n,) radians and metres of joint positions in degrees, and millimetres where they slide.

    Raises
    ------
    InputError
        Another number of them.
    """
    if len(numbers) != len(arm):
        raise InputError(f"{len(numbers)} joint positions, expected {len(arm)}", code=Code.WRONG_SHAPE)
    values = np.array(numbers, dtype=np.float64)
    return np.where(arm.sliding, values / 1e3, np.deg2rad(values))


def units_of(notation: Notation, unit: Unit | None = None) -> str:
    """Return the units in which a pose is typed, in words."""
    if notation is UR and unit is None:
        return "mm and a rotation vector in rad as on the pendant, or p[..] in m and rad"
    return f"{(unit or notation.default_unit).value} and {notation.form.words}"


def typed_pose(text: str, notation: Notation, unit: Unit | None = None) -> Pose:
    """Return the pose that was typed, in the units of the pendant (see `units_of`).

    Raises
    ------
    InputError
        Not the numbers of one pose.
    """
    if notation is UR and unit is None and "p[" not in text.replace(" ", "").lower():
        unit = Unit.MM
    return read_pose_text(text, notation, unit)


def describe(goal: Goal, notations: Sequence[Notation] = SHOWN, sliding: Sequence[bool] = ()) -> str:
    """Return where to go, in joint values where they are known, and in the notations of several makers."""
    lines = [f"Go to {goal.label}:"]
    if goal.joints_rad is not None:
        slides = sliding or (False,) * len(goal.joints_rad)
        values = [
            1e3 * q if s else float(np.rad2deg(q)) for q, s in zip(goal.joints_rad, slides, strict=True)
        ]
        units = "deg, mm where they slide" if any(slides) else "deg"
        lines.append("  joints " + "  ".join(f"{value:.3f}" for value in values) + f"  {units}")
    for notation in notations:
        units = "" if notation is UR else f"  {notation.default_unit.value}, {notation.form.words}"
        lines.append(f"  {notation.name:<6} {pose_text(goal.T_base_flange, notation)}{units}")
        if notation is UR:
            # Adding zero turns a negative zero into a plain one.
            x, y, z, rx, ry, rz = (round(v, 5) + 0.0 for v in notation.numbers(goal.T_base_flange))
            lines.append(
                f"         X {1e3 * x:.2f}  Y {1e3 * y:.2f}  Z {1e3 * z:.2f}  mm   "
                f"RX {rx:.4f}  RY {ry:.4f}  RZ {rz:.4f}  rad (pendant)"
            )
    return "\n".join(lines)


def _or_file(text: str) -> str:
    """Return the content of the file that a text names, or the text itself."""
    if not text or len(text) > 500 or any(character in text for character in "\n[{("):
        return text
    try:
        path = Path(text).expanduser()
        if path.is_file():
            with path.open(encoding="utf-8") as file:
                return file.read(MAX_TEXT)
    except (OSError, ValueError):
        return text
    return text
