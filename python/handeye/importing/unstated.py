"""What to say where poses do not say how they are written, or wrongly: the reading that the pictures have."""

from collections.abc import Sequence
from dataclasses import replace

from handeye.codes import Code
from handeye.datasets import Reading, UnreadPoses
from handeye.datasets.image_set import WrittenPoses
from handeye.datasets.pose_rows import same_meaning
from handeye.errors import UnstatedError
from handeye.importing.readings import CLEARLY, MIN_VIEWS, Agreement, distinct
from handeye.notations.forms import Euler, Form, RotationVector, Vector
from handeye.types import Mounting

_MOST_NAMED = 4
_WHERE = {Mounting.EYE_IN_HAND: "the camera in the hand", Mounting.EYE_TO_HAND: "the camera beside the robot"}


def unstated(
    unread: UnreadPoses, agreements: Sequence[Agreement], *, views: int, mounting_stated: bool
) -> UnstatedError:
    """Return the error that names the reading that agrees, how well the next one does, and the options.

    Parameters
    ----------
    unread
        The pictures and the rows.
    agreements
        How well each reading agrees, the best first.
    mounting_stated
        Whether the caller has said where the camera sits.
    views
        Number of pictures that could tell.
    """
    file = unread.file
    say = "say how they are written with --notation and --unit; docs/conventions.md has the table"
    if views < MIN_VIEWS:
        return UnstatedError(
            f"{file} does not say how its poses are written, and fewer than {MIN_VIEWS} pictures show "
            "the target so that they could tell",
            hint=say,
        )
    if not agreements or not agreements[0].fits:
        nearest = f"; the best, {agreements[0].reading}, is off by {agreements[0]}" if agreements else ""
        return UnstatedError(
            f"{file}: no way to read the poses agrees with the pictures{nearest}",
            hint="do the rows belong to these pictures, in this order? Is the target as large as stated? "
            f"If so, {say}",
        )
    best = agreements[0]
    rivals = distinct(best, agreements)
    close = [rival for rival in rivals if rival.fits and rival.misfit < CLEARLY * best.misfit]
    if close:
        named = [best, *close][:_MOST_NAMED]
        listed = "; ".join(f"{a.reading}, {_WHERE[a.mounting]}: {a}" for a in named)
        return UnstatedError(
            f"{file} does not say how its poses are written, and these pictures fit several ways ({listed})",
            hint=f"{say}; pictures that are turned further, about two axes, would tell",
        )
    return UnstatedError(
        f"{file} does not say how its poses are written; the pictures agree with {_described(best)}: "
        f"they are {best} apart.{_next(rivals)}",
        hint=_other_mounting(best, mounting_stated=mounting_stated),
        options=("--poses", file, *best.reading.options, *_mounting(best, is_stated=mounting_stated)),
    )


def misread(
    written: WrittenPoses, stated: Sequence[Agreement], agreements: Sequence[Agreement]
) -> UnstatedError | None:
    """Return the error that poses are written in another way than is stated; None if none agrees clearly.

    Parameters
    ----------
    written
        The rows and what is stated.
    stated
        How well that agrees, empty if it is no reading at all.
    agreements
        How well each reading agrees, the best first.
    """
    if not agreements or not agreements[0].fits:
        return None
    best, said = agreements[0], written.reading
    if best.reading.notation.form == said.notation.form and best.reading.unit is said.unit:
        return None  # Only the direction: the mounting may be wrong as well.
    if any(rival.fits and rival.misfit < CLEARLY * best.misfit for rival in distinct(best, agreements)):
        return None
    apart = f", as stated {stated[0]}" if stated else ""
    return UnstatedError(
        f"{written.file} is stated to be {said}, and the pictures agree with {_described(best)}: they are "
        f"{best} apart{apart}",
        hint="or correct what the file itself says",
        options=("--poses", written.file, *best.reading.options),
        code=Code.WRONG_UNIT if _in_degrees(best.reading) == _in_degrees(said) else Code.WRONG_ROTATION,
    )


def _in_degrees(reading: Reading) -> Form:
    """Return what numbers mean, whatever the unit of angles."""
    form = reading.notation.form
    if isinstance(form, Vector) and isinstance(form.rotation, (Euler, RotationVector)):
        return replace(form, rotation=replace(form.rotation, degrees=True))
    return form


def _described(best: Agreement) -> str:
    also = [name for name in same_meaning(best.reading.notation) if name != best.reading.notation.name]
    written = f" (the same as {', '.join(also[:_MOST_NAMED])})" if also else ""
    return f"{best.reading}{written}, {_WHERE[best.mounting]}"


def _mounting(best: Agreement, *, is_stated: bool) -> tuple[str, ...]:
    usual = is_stated or best.mounting is Mounting.EYE_IN_HAND
    return () if usual else ("--mounting", best.mounting.value)


def _next(rivals: Sequence[Agreement]) -> str:
    if not rivals:
        return ""
    return f" The next best, {rivals[0].reading}, {_WHERE[rivals[0].mounting]}, is {rivals[0]} apart."


def _other_mounting(best: Agreement, *, mounting_stated: bool) -> str:
    if mounting_stated:
        return ""
    other = next(mounting for mounting in Mounting if mounting is not best.mounting)
    return f"with {_WHERE[other]} it is the other way round: state --mounting {other.value}"
