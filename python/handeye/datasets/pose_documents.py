"""Poses from JSON, YAML and FileStorage: lists, tables by name, one pose alone, wrapped or not."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

from handeye.codes import Code
from handeye.datasets.documents import read_document_file
from handeye.datasets.pose_labels import INDICES, NAMES, TIMES, columns_of, is_accuracy
from handeye.datasets.pose_rows import POSITION, QUATERNION, ROTATION_VECTOR, PoseRows
from handeye.datasets.pose_text import MAX_NAME_LENGTH, rows_of, statement_of
from handeye.errors import InputError

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COUNTS = frozenset({6, 7, 8, 12, 16})
_POSITIONS = ("position", "translation", "trans", "pos", "xyz", "t", "tvec", "p", "origin")
_ROTATIONS = (
    "orientation",
    "rotation",
    "quaternion",
    "quat",
    "q",
    "rot",
    "r",
    "rvec",
    "rotation_matrix",
    "rpy",
)
_STATED = ("notation", "unit", "units", "poses_are", "direction", "format", "description")
_MAX_DEPTH = 6

_Found = tuple[str, list[float], tuple[str, ...]]


def read_pose_document(path: Path) -> PoseRows:
    """Return the rows of a file.

    Raises
    ------
    InputError
        Not such a file, no poses in it, or poses of different kinds.
    """
    return rows_of_document(read_document_file(path), path)


def rows_of_document(document: object, path: Path) -> PoseRows:
    """Return the rows of a document that was read already.

    Raises
    ------
    InputError
        No poses in it, or poses of different kinds.
    """
    found_text: dict[str, str] = {}
    if isinstance(document, Mapping):
        table = cast("Mapping[object, object]", document)
        found_text = {str(key).lower(): value for key, value in table.items() if isinstance(value, str)}
    stated = statement_of(
        found_text.get("notation"),
        found_text.get("unit", found_text.get("units")),
        found_text.get("poses_are", found_text.get("direction")),
        str(path),
    )
    found = _poses(cast("object", document), 0)
    if not found:
        raise InputError(
            f"{path}: no poses in it",
            code=Code.NO_POSES,
            hint="write a list of poses, each a list of numbers or a table with an image and a pose",
        )
    labels = found[0][2]
    for index, (_, _, other) in enumerate(found):
        if other != labels:
            raise InputError(
                f"{path}: entry {index + 1} has other fields than the first", code=Code.WRONG_SHAPE
            )
    rows = [(name, numbers, f"entry {index + 1}") for index, (name, numbers, _) in enumerate(found)]
    return replace(
        rows_of(path, rows, stated, labels), accuracies=tuple(_accuracies(cast("object", document), 0))
    )


def _poses(item: object, depth: int) -> list[_Found]:
    """Return all poses in a part of a document."""
    if depth > _MAX_DEPTH:
        return []
    one = _pose(item, depth)
    if one is not None:
        return [one]
    if isinstance(item, Sequence) and not isinstance(item, str):
        parts = [_pose(part, depth) for part in cast("Sequence[object]", item)]
        whole = [part for part in parts if part is not None]
        return whole if len(whole) == len(parts) else []
    if isinstance(item, Mapping):
        table = cast("Mapping[str, object]", item)
        rest = {key: value for key, value in table.items() if str(key).lower() not in _STATED}
        named: list[_Found] = []
        for key, value in rest.items():
            part = _pose(value, depth)
            if part is not None:
                named.append((part[0] or str(key), *part[1:]))
        if named and len(named) == len(rest):
            return named if len(named) > 1 or not _is_wrapper(next(iter(rest))) else [("", *named[0][1:])]
        lists = [found for value in rest.values() if (found := _poses(value, depth + 1))]
        return max(lists, key=len) if lists else []
    return []


def _accuracies(item: object, depth: int) -> Iterator[str]:
    """Yield what accuracies are called, as the first entry of each list has them."""
    if depth > _MAX_DEPTH:
        return
    if isinstance(item, Mapping):
        for key, value in cast("Mapping[object, object]", item).items():
            if is_accuracy(str(key).lower()):
                yield str(key).lower()[:MAX_NAME_LENGTH]
            else:
                yield from _accuracies(value, depth + 1)
    elif isinstance(item, list):
        for value in cast("list[object]", item)[:1]:
            yield from _accuracies(value, depth + 1)


def _is_wrapper(key: object) -> bool:
    """Tell whether a key says "pose" rather than which."""
    return not re.search(r"\d|\.", str(key))


def _pose(item: object, depth: int) -> _Found | None:
    """Return name, numbers and labels of what is one pose; None for anything else."""
    if depth > _MAX_DEPTH:
        return None
    numbers = _flat(item)
    if numbers is not None:
        return ("", numbers, ()) if len(numbers) in _COUNTS else None
    if not isinstance(item, Mapping):
        return None
    table = {str(key): value for key, value in cast("Mapping[object, object]", item).items()}
    lower = {key.lower(): value for key, value in table.items()}
    if {"rows", "cols", "data"} <= set(lower):
        return _pose(lower["data"], depth + 1)
    name = next(
        (str(lower[key])[:MAX_NAME_LENGTH] for key in lower if key in NAMES and _is_text(lower[key])), ""
    )
    if not name:
        name = next(
            (str(lower[key])[:MAX_NAME_LENGTH] for key in lower if key in INDICES and _is_text(lower[key])),
            "",
        )
    parted = _in_parts(lower)
    if parted is not None:
        return (name, *parted)
    scalars = {
        key: number
        for key, value in lower.items()
        if key not in NAMES | TIMES and (number := _number(value)) is not None
    }
    if len(scalars) >= 6:
        try:
            columns = columns_of(list(scalars))
        except InputError:
            return None
        values = list(scalars.values())
        return name, [values[i] for i in columns.pose], columns.labels
    inner = [part for value in table.values() if (part := _nested(value, depth))]
    return (name or inner[0][0], *inner[0][1:]) if len(inner) == 1 else None


def _nested(value: object, depth: int) -> _Found | None:
    return _pose(cast("object", value), depth + 1) if isinstance(value, (Mapping, list)) else None


def _in_parts(table: Mapping[str, object]) -> tuple[list[float], tuple[str, ...]] | None:
    """Return a pose given as a position and a rotation; None if it is not."""
    position = next((_parts(table[key], "xyz") for key in _POSITIONS if key in table), None)
    key = next((key for key in _ROTATIONS if key in table), None)
    if position is None or key is None:
        return None
    given = table[key]
    if isinstance(given, Mapping):
        given = cast("Mapping[object, object]", given)
        turn = _parts(given, "xyzw")
        if turn is not None:
            return [*position, *turn], (*POSITION, *QUATERNION)
        turn = _parts(given, "xyz")
        return None if turn is None else ([*position, *turn], ())
    numbers = _flat(given)
    if numbers is None or len(numbers) not in {3, 4, 9}:
        return None
    if len(numbers) == 9:
        rows = [numbers[i : i + 3] for i in (0, 3, 6)]
        return [v for row, t in zip(rows, position, strict=True) for v in (*row, t)], ()
    if key == "rvec":
        return [*position, *numbers], (*POSITION, *ROTATION_VECTOR)
    return [*position, *numbers], ()


def _parts(item: object, names: str) -> list[float] | None:
    """Return the numbers of a table by their letters, or of a list of as many."""
    if isinstance(item, Mapping):
        lower = {str(key).lower(): value for key, value in cast("Mapping[object, object]", item).items()}
        if {"rows", "cols", "data"} <= set(lower):
            return _parts(lower["data"], names)
        values = [_number(lower.get(letter)) for letter in names]
        return None if None in values else cast("list[float]", values)
    numbers = _flat(item)
    return numbers if numbers is not None and len(numbers) == len(names) else None


def _flat(item: object) -> list[float] | None:
    """Return the numbers of a list, or of a list of lists by rows; None for anything else."""
    if isinstance(item, str):
        words = re.sub(r"[\[\](),;]", " ", item).split() if len(item) < 2000 else []
        values = [_number(word) for word in words]
        return cast("list[float]", values) if len(values) >= 3 and None not in values else None
    if not isinstance(item, list):
        return None
    flat: list[float] = []
    for part in cast("list[object]", item):
        value = _number(part)
        if value is not None:
            flat.append(value)
            continue
        row = _flat(cast("object", part)) if isinstance(part, list) else None
        if row is None or len(row) > 4:
            return None
        flat.extend(row)
    return flat if flat and len(flat) <= 16 else None


def _number(item: object) -> float | None:
    if isinstance(item, bool) or not isinstance(item, (int, float, str)):
        return None
    if isinstance(item, str):
        return float(item) if len(item) < 60 and _NUMBER.fullmatch(item.strip()) else None
    return float(item) if abs(item) < 1e15 else None


def _is_text(item: object) -> bool:
    return isinstance(item, (str, int)) and not isinstance(item, bool)
