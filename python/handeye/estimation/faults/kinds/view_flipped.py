"""Boards labelled turned, mirrored or shifted against the other views."""

from handeye.estimation.faults.kinds.base import Handling, Kind
from handeye.estimation.faults.kinds.words import listed
from handeye.types.calibration import Finding

KIND = Kind(
    "view_flipped",
    "points labelled turned, mirrored or shifted",
    "A detector took the wrong corner for the first: a board that looks the same upside down, rows counted "
    "from the other end, part of a board taken for another part.",
    "Under another labelling of its points the view agrees with the others.",
    Handling.USED,
    "Nothing; a ChArUco board or an odd and an even number of squares leave no doubt.",
    "writes the points with the labels under which the view agrees",
)


def flipped_finding(names: list[str], words: str, looks_the_same: bool) -> Finding:
    """Name views whose labels were read again."""
    reason = (
        "as the board looks the same after it"
        if looks_the_same
        else "though its picture tells the ends apart"
    )
    they = "they were" if len(names) > 1 else "it was"
    return Finding(
        KIND.code,
        f"{listed(names)}: the points of the board are labelled {words} against the other views, {reason}; "
        f"{they} labelled again and used",
        {"views": names, "labels": words, "looks_the_same": looks_the_same},
    )
