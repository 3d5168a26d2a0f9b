"""How poses are written: by robots, by programs and by people."""

from handeye.notations.table import (
    EULER,
    MAKERS,
    NOTATIONS,
    PLAIN,
    SHOWN,
    Direction,
    Notation,
    Unit,
    direction_of,
    notation_of,
    unit_of,
)
from handeye.notations.text import example, labelled_numbers, pose_text, read_numbers, read_pose_text

__all__ = [
    "EULER",
    "MAKERS",
    "NOTATIONS",
    "PLAIN",
    "SHOWN",
    "Direction",
    "Notation",
    "Unit",
    "direction_of",
    "example",
    "labelled_numbers",
    "notation_of",
    "pose_text",
    "read_numbers",
    "read_pose_text",
    "unit_of",
]
