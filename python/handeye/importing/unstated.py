"""What to say where nothing says how poses are written: the reading that the pictures agree with."""

from collections.abc import Sequence

from handeye.datasets import UnreadPoses
from handeye.datasets.pose_rows import same_meaning
from handeye.errors import UnstatedError
from handeye.importing.readings import CLEARLY, MIN_VIEWS, Agreement, distinct
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
