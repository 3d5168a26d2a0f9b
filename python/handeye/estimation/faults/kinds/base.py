"""What every kind of data fault has: a code, what was done, how it shows, and what repairs it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from handeye.errors import InputError
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.pose import Pose
from handeye.types.recording import Recording
from handeye.types.view import View


class Handling(StrEnum):
    """What is done about a fault before an estimate is made."""

    USED = "put right and used"
    LEFT_OUT = "left out"
    REFUSED = "refused"


@dataclass(frozen=True)
class Kind:
    """One kind of fault; its page in the docs is made of this.

    Parameters
    ----------
    code
        Stable code of the finding or the error.
    title
        What it is, in a few words.
    cause
        What was done, or happened.
    shows
        How it shows in the views.
    handling
        What `solve` does about it.
    cure
        What a person does about it.
    repair
        What `handeye doctor --fix` does; None where only new data help.
    """

    code: str
    title: str
    cause: str
    shows: str
    handling: Handling
    cure: str
    repair: str | None = None


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One way in which all views together may be wrong, and the recording as it would then be meant.

    Parameters
    ----------
    kind
        The fault.
    name
        Stable name of the change.
    sentence
        What was probably done.
    hint
        What to do about it.
    change
        From a recording as given to the one that was meant.
    poses
        What that does to the robot's poses (K, 4, 4) `T_base_flange`, where it changes nothing else.
    log_prior
        Logarithm of how much less usual it is than the others.
    is_mirror
        Whether a mirror image is put right. Whether of the pictures or of the robot's frame, only the
        camera's centre tells, which is not known as well as that: nothing does.
    log_unit
        Logarithm of the factor between the densities of a view as meant and as given: the cube of that
        between their lengths.
    """

    kind: Kind
    name: str
    sentence: str
    hint: str
    change: Callable[[Recording], Recording]
    poses: Callable[[FloatArray], FloatArray] | None = None
    log_prior: float = 0.0
    is_mirror: bool = False
    log_unit: float = 0.0

    def applied(self, measurements: Measurements) -> Measurements:
        """Return the measurements as they would be meant."""
        given = as_recording(measurements)
        meant = self.change(given)
        if meant.camera is given.camera and meant.target is given.target and len(meant) == len(given):
            pairs = zip(given.views, meant.views, strict=True)
            if all(_same_points(before, after) for before, after in pairs):
                return replace(measurements, mounting=meant.mounting, views=meant.views)
        again = Measurements.of_recording(meant)
        return replace(again, rejected=measurements.rejected | again.rejected)


class SharedFaultError(InputError):
    """All views share a fault, and how they are meant is known.

    Attributes
    ----------
    hypothesis
        The fault, with the change from the recording as given to the one that was meant.
    as_well
        Codes of other kinds that explain the views as well: the views cannot tell which it is.
    """

    def __init__(
        self, message: str, hypothesis: Hypothesis, *, hint: str | None = None, as_well: tuple[str, ...] = ()
    ) -> None:
        super().__init__(message, code=hypothesis.kind.code, hint=hint or hypothesis.hint)
        self.hypothesis, self.as_well = hypothesis, as_well


def of_poses(
    kind: Kind,
    name: str,
    sentence: str,
    hint: str,
    poses: Callable[[FloatArray], FloatArray],
    *,
    log_prior: float = 0.0,
    is_mirror: bool = False,
) -> Hypothesis:
    """Return the hypothesis that the robot's poses are to be read in another way."""

    def change(recording: Recording) -> Recording:
        given = np.array([view.T_base_flange.matrix for view in recording.views]).reshape(-1, 4, 4)
        meant = poses(given)
        return recording.with_views(
            replace(view, T_base_flange=Pose(matrix))
            for view, matrix in zip(recording.views, meant, strict=True)
        )

    return Hypothesis(kind, name, sentence, hint, change, poses, log_prior, is_mirror)


def _same_points(one: View, other: View) -> bool:
    return np.array_equal(one.point_ids, other.point_ids) and np.array_equal(one.pixels, other.pixels)


def as_recording(measurements: Measurements) -> Recording:
    """Return the views that are measured as a recording."""
    return Recording(
        "views", measurements.mounting, measurements.camera, measurements.target, measurements.views
    )
