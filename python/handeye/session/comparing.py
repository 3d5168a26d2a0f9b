"""Comparing a recording on disk with the journal that it follows from."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from handeye.codes import Code
from handeye.errors import InputError
from handeye.session.journal import JOURNAL_FILE
from handeye.types import Station, View

K = TypeVar("K", View, Station)


def is_current(found: Mapping[str, K | InputError], expected: Sequence[K]) -> bool:
    """Tell whether a recording holds whole what the journal has."""
    return list(found) == [one.name for one in expected] and not any(
        isinstance(one, InputError) for one in found.values()
    )


def check_same(
    path: Path,
    same_header: bool,
    found: Mapping[str, K | InputError],
    taken: Sequence[K],
    same: Callable[[K, K], bool],
) -> None:
    """Refuse a recording that holds what the journal lacks.

    Parameters
    ----------
    path
        Its file.
    same_header
        Whether all but its views is what the session began with.
    found
        Its views or stations by name, or what is wrong with them.
    taken
        Those of the journal.
    same
        Tells whether one is that of the journal.

    Raises
    ------
    InputError
        It does.
    """
    known = {one.name: one for one in taken}
    more = [name for name in found if name not in known]
    if more:
        raise InputError(
            f"{path}: holds {', '.join(more[:10])}, which no attempt in the journal took: it was cut "
            f"after {len(taken)} views",
            code=Code.JOURNAL_CUT,
            hint=f"restore {JOURNAL_FILE} from a copy; handeye solve uses the recording as it is",
        )
    if not same_header:
        raise InputError(
            f"{path}: name, source, mounting, camera or target are not those that the session began with",
            code=Code.EDITED,
            hint="undo the change, or begin a new session",
        )
    for name, one in found.items():
        if isinstance(one, InputError):
            if one.code != Code.MISSING_FILE:
                raise one
        elif not same(one, known[name]):
            raise InputError(
                f"{path}: view {name} is not as in the journal: its row or its corners were edited",
                code=Code.EDITED,
                hint="undo it, or delete the file of its corners: it is written again from the journal",
            )


def same_view(view: View, known: View) -> bool:
    """Tell whether a view is that of the journal, but for an image that may be lost."""
    one, other = view.to_dict(), known.to_dict()
    if one.get("image") is None:  # lost, and not kept in the journal
        other.pop("image", None)
    return one == other
