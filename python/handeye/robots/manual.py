"""A robot without a driver: a person drives where the tool says, and says where the arm stands."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from handeye.errors import DeviceError, HandeyeError
from handeye.notations import NOTATIONS, SHOWN, Notation, Unit, example, pose_text, read_pose_text
from handeye.notations.text import MAX_TEXT
from handeye.robots.protocol import Goal, Reading

SKIP = frozenset({"skip", "no", "s"})


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
        Unit of its lengths; None for that of the notation.
    notations
        All notations in which goals are shown.

    A pose is typed or pasted in the notation, or it is the name of a file that holds it. What is read back is
    used, wherever the goal was. `skip` refuses a motion.
    """

    def __init__(
        self,
        ask: Callable[[str], str],
        tell: Callable[[str], None],
        notation: Notation = NOTATIONS["ur"],
        unit: Unit | None = None,
        notations: Sequence[Notation] = SHOWN,
    ) -> None:
        self._ask = ask
        self._tell = tell
        self._notation, self._unit = notation, unit
        self._notations = [other for other in notations if other is not notation]
        self._reading: Reading | None = None

    def move_to(self, goal: Goal) -> None:
        """Say where to go, and take the pose that was reached.

        Raises
        ------
        DeviceError
            The person will not go there.
        """
        self._tell(describe(goal, self._notations, first=(self._notation, self._unit)))
        self._reading = self._read(f"{goal.label}: pose reached ({self._notation.name}, or skip): ")

    def read_pose(self) -> Reading:
        """Return the pose that was typed last; asks for it before the first motion.

        Raises
        ------
        DeviceError
            The person will not say.
        """
        if self._reading is None:
            self._reading = self._read(f"pose of the flange now ({self._notation.name}, or skip): ")
        return self._reading

    def stop(self) -> None:
        """Say that the arm must not move."""
        self._tell("Stop: leave the arm where it is.")

    def _read(self, question: str) -> Reading:
        while True:
            try:
                text = self._ask(question).strip()
            except EOFError as error:
                raise DeviceError("nobody answers", code="no_answer") from error
            if text.lower() in SKIP:
                raise DeviceError("skipped by hand", code="motion_refused")
            try:
                return Reading(read_pose_text(_or_file(text), self._notation, self._unit))
            except HandeyeError as error:
                self._tell(f"{error.message}; for example {example(self._notation, self._unit)}")


def describe(
    goal: Goal, notations: Sequence[Notation] = SHOWN, *, first: tuple[Notation, Unit | None] | None = None
) -> str:
    """Return where to go, in joint values and in the notations of several makers, one of them first."""
    lines = [f"Go to {goal.label}:"]
    if goal.joints_rad is not None:
        lines.append(
            "  joints " + "  ".join(f"{value:.3f}" for value in np.rad2deg(goal.joints_rad)) + "  deg"
        )
    shown = [*([] if first is None else [first]), *((notation, None) for notation in notations)]
    lines += [
        f"  {notation.name:<6} {pose_text(goal.T_base_flange, notation, unit)}" for notation, unit in shown
    ]
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
