"""What the columns of a table of poses are called by the people who write them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from handeye.codes import Code
from handeye.datasets.pose_rows import POSITION, QUATERNION, ROTATION_VECTOR
from handeye.errors import InputError
from handeye.notations import MAKERS, Unit

NAMES = frozenset(
    (
        "image",
        "img",
        "name",
        "file",
        "filename",
        "file_name",
        "image_name",
        "image_path",
        "image_file",
        "picture",
        "path",
        "view",
        "frame_name",
    )
)
INDICES = frozenset(
    ("index", "idx", "nr", "no", "id", "#", "n", "i", "sample", "number", "num", "pose", "frame")
)
TIMES = frozenset(
    ("t", "time", "timestamp", "stamp", "time_s", "timestamp_s", "timestamp_ns", "sec", "seconds")
)
# What says how accurate a pose is: no part of it.
_ACCURACY = re.compile(r"^(cov|sigma|std|stddev|var|variance|uncert|accuracy|weight)", re.ASCII)
# The third angle in x, y, z, r, p, y.
_SECOND_Y = "y2"
_PREFIXES = re.compile(
    r"^(position|pos|translation|trans|tcp|p|t|pose|orientation|quaternion|quat|q|rotation|rot|r)"
    r"[ _.]?(?=[xyzw]$)"
)
_UNIT = re.compile(r"[ _]*(?:[\[(]|(?<=[ _]))(mm|cm|m|deg|degrees|rad|radians|°)[\])]?$|[\[(](.*?)[\])]$")
_ROTATION_PREFIXES = ("orientation", "quaternion", "quat", "q", "rotation", "rot")


@dataclass(frozen=True)
class Columns:
    """Which columns of a table are what.

    Attributes
    ----------
    name
        Column with the name of the view, or None.
    pose
        Columns of the pose, in order.
    labels
        Their names in small letters.
    unit
        Unit of the position that the header says.
    degrees
        Whether the header says degrees (True) or radians (False).
    has_time
        Whether there is a column of times.
    accuracies
        Names of the columns that say how accurate each pose is; they are not read.
    """

    name: int | None
    pose: tuple[int, ...]
    labels: tuple[str, ...]
    unit: Unit | None = None
    degrees: bool | None = None
    has_time: bool = False
    accuracies: tuple[str, ...] = ()


def columns_of(header: Sequence[str]) -> Columns:
    """Tell what the columns under a header are.

    Raises
    ------
    InputError
        A name that is there twice, or names that make no pose.
    """
    plain = [_plain(field) for field in header]
    labels = [label for label, _ in plain]
    if labels[-3:] == ["r", "p", "y"]:
        labels[-1] = _SECOND_Y
    lengths = {unit for label, unit in plain if label in POSITION and unit in {"mm", "cm", "m"}}
    angles = {unit for label, unit in plain if label not in POSITION and unit in {"deg", "rad"}}
    name = next((i for i, label in enumerate(labels) if label in NAMES), None)
    if name is None:
        name = next((i for i, label in enumerate(labels) if label in INDICES), None)
    # The third angle of Kawasaki is called T.
    is_time = TIMES - {"t"} if {"o", "a", "t"} <= set(labels) else TIMES
    times = [i for i, label in enumerate(labels) if label in is_time and i != name]
    accuracies = [i for i, label in enumerate(labels) if is_accuracy(label)]
    passed_over = {name, *times, *accuracies}
    left = [i for i in range(len(labels)) if i not in passed_over and labels[i] not in NAMES]
    chosen = _pose_columns(labels, left)
    twice = [labels[i] for i in chosen if labels.count(labels[i]) > 1]
    if twice:
        raise InputError(
            f"columns {', '.join(labels)[:200]}: {twice[0]} is there twice", code=Code.INVALID_FIELD
        )
    return Columns(
        name,
        tuple(chosen),
        tuple(labels[i] for i in chosen),
        Unit(next(iter(lengths))) if len(lengths) == 1 else None,
        angles == {"deg"} if len(angles) == 1 else None,
        bool(times),
        tuple(labels[i] for i in accuracies),
    )


def is_accuracy(label: str) -> bool:
    """Tell whether a name in small letters is that of a covariance, a deviation or a weight."""
    return _ACCURACY.match(label) is not None


def _pose_columns(labels: Sequence[str], left: Sequence[int]) -> list[int]:
    """Return the columns of the pose: by their names where these are known, else all that are left."""
    places = {labels[i]: i for i in reversed(left)}
    if set(POSITION) <= set(places):
        for rotation in (QUATERNION, ROTATION_VECTOR, *_maker_rotations()):
            if set(rotation) <= set(places):
                # Named quaternions come out in one order; of angles the order in the file may matter.
                known = (
                    rotation
                    if rotation in (QUATERNION, ROTATION_VECTOR)
                    else sorted(rotation, key=places.__getitem__)
                )
                return [places[label] for label in (*POSITION, *known)]
    if len(left) not in {6, 7, 9, 12, 16}:
        raise InputError(
            f"columns {', '.join(labels)[:200]}: expected x, y, z and the rotation (rx, ry, rz; a, b, c; "
            "qx, qy, qz, qw; ...), or a matrix of 12 or 16",
            code=Code.INVALID_FIELD,
            hint="name the columns so, or leave out the header",
        )
    return list(left)


def _maker_rotations() -> list[tuple[str, ...]]:
    turns = (tuple(label.lower() for label in maker.labels[3:]) for maker in MAKERS if maker.labels)
    return [*dict.fromkeys(turns), ("r", "p", _SECOND_Y)]


def _plain(field: str) -> tuple[str, str]:
    """Return the plain name of a column and the unit in it."""
    text = field.strip().strip("\"'").lower().replace("/", "_").replace(".", "_")
    unit = ""
    match = _UNIT.search(text)
    if match and match.start() > 0:
        unit = (match.group(1) or match.group(2) or "").strip()
        text = text[: match.start()]
    unit = {"degrees": "deg", "°": "deg", "radians": "rad"}.get(unit, unit)
    text = text.strip(" _")
    prefix = _PREFIXES.match(text)
    if prefix and prefix.group(1) in _ROTATION_PREFIXES:
        text = "q" + text[-1] if prefix.group(1) not in {"rotation", "rot"} else "r" + text[-1]
    elif prefix and prefix.group(1) != "r":
        text = text[-1]
    return ("rv" + text[-1] if re.fullmatch(r"(rvec|rotvec|rotation_vector)[ _]?[xyz]", text) else text), unit
