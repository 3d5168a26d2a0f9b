"""Poses from CSV and text: tables, matrices in blocks, and lines as robots write them.

Decimal commas, semicolons, tabs, a byte order mark and line ends of any system are no obstacle.
"""

import csv
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from handeye.codes import Code
from handeye.datasets.image_header import IMAGE_SUFFIXES
from handeye.datasets.pose_labels import columns_of
from handeye.datasets.pose_rows import PoseRows, Statement
from handeye.datasets.reading import MIB, number, read_bytes
from handeye.errors import InputError
from handeye.notations import direction_of, notation_of, unit_of
from handeye.notations.text import NUMBER

MAX_BYTES = 64 * MIB
MAX_POSES = 1_000_000
MAX_NAME_LENGTH = 200
MAX_LINE = 20_000
_COMMENT = ("#", "//", "%")
_STATED = re.compile(r"^[#/%\s]*(notation|unit|units|poses[ _-]are)\s*[:=]\s*([\w/ -]+?)\s*$", re.IGNORECASE)
_ENDS = "|".join(map(re.escape, sorted(IMAGE_SUFFIXES)))
_PICTURE = re.compile(rf"(?<![\w./\\-])[\w./\\-]*[\w-](?:{_ENDS})\b", re.IGNORECASE | re.ASCII)
_FREE_NUMBER = re.compile(rf"(?<![A-Za-z0-9_.]){NUMBER}(?![A-Za-z_])", re.ASCII)
_LABELLED = re.compile(
    rf"(?<![A-Za-z0-9_])([XYZABCWPROTUV]|R[XYZ])\s*[:=]?\s*({NUMBER})", re.ASCII | re.IGNORECASE
)
# Position and quaternion of a robtarget of ABB; configuration and outer axes follow.
_ROBTARGET = re.compile(r"\[\s*\[[^\[\]]*\][\s,]*\[[^\[\]]*\](?=[\s,]*\[)")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?", re.ASCII)

_Row = tuple[str, list[float], str]


def read_pose_text_file(path: Path) -> PoseRows:
    """Return the rows of a file.

    Raises
    ------
    InputError
        Not text, no numbers in it, or rows of different length; the message names the line.
    """
    text = _decoded(path)
    stated = _statement(text, path)
    lines = [
        (f"line {index}", line)
        for index, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith(_COMMENT) and not _STATED.match(line)
    ]
    if any(len(line) > MAX_LINE for _, line in lines):
        raise InputError(f"{path}: a line of more than {MAX_LINE} characters", code=Code.TOO_LARGE)
    if len(lines) > MAX_POSES:
        raise InputError(f"{path}: more than {MAX_POSES} lines", code=Code.TOO_LARGE)
    if not lines:
        raise InputError(f"{path}: no poses in it", code=Code.NO_POSES)
    header, rows = _table(path, lines)
    if header is not None:
        return _under_header(path, header, rows, stated)
    found = _with_letters(lines) or _in_blocks(lines) or _one_a_line(path, rows)
    return rows_of(path, found, stated)


def rows_of(path: Path, found: Sequence[_Row], stated: Statement, labels: tuple[str, ...] = ()) -> PoseRows:
    """Return rows of one length, a first column of consecutive numbers taken as names.

    Raises
    ------
    InputError
        No row, or rows of different length.
    """
    if not found:
        raise InputError(f"{path}: no poses in it", code=Code.NO_POSES)
    count = len(found[0][1])
    for _, numbers, place in found:
        if len(numbers) != count:
            raise InputError(
                f"{path}: {place}: {len(numbers)} values, expected {count} as in {found[0][2]}",
                code=Code.WRONG_SHAPE,
            )
    values = np.array([numbers for _, numbers, _ in found], dtype=np.float64).reshape(len(found), count)
    names = [name[:MAX_NAME_LENGTH] for name, _, _ in found]
    if not labels and len(found) > 1 and not any(names) and count in {7, 8, 13, 17}:
        first = values[:, 0]
        if np.array_equal(first, np.round(first)) and bool(np.all(np.diff(first) == 1)):
            names, values = [str(int(value)) for value in first], values[:, 1:]
    return PoseRows(path, tuple(names), values, tuple(place for _, _, place in found), labels, stated)


def _decoded(path: Path) -> str:
    content = read_bytes(path, MAX_BYTES)
    encoding = "utf-16" if content[:2] in {b"\xff\xfe", b"\xfe\xff"} else "utf-8-sig"
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text (byte {error.start})", code=Code.NOT_TEXT) from error


def _statement(text: str, path: Path) -> Statement:
    """Return what lines such as ``# notation: kuka`` before the poses say."""
    said: dict[str, str] = {}
    for line in text.splitlines()[:50]:
        match = _STATED.match(line) if len(line) < MAX_NAME_LENGTH else None
        if match:
            said[re.sub(r"[ _-]", "_", match.group(1).lower()).rstrip("s")] = match.group(2)
    return statement_of(said.get("notation"), said.get("unit"), said.get("poses_are"), str(path))


def statement_of(notation: str | None, unit: str | None, direction: str | None, where: str = "") -> Statement:
    """Return the statement that three texts make.

    Raises
    ------
    InputError
        One of them is not known.
    """
    try:
        return Statement(
            None if notation is None else notation_of(notation),
            None if unit is None else unit_of(unit),
            None if direction is None else direction_of(direction),
        )
    except InputError as error:
        message = f"{where}: {error.message}" if where else error.message
        raise InputError(message, code=error.code, hint=error.hint) from error


def _table(
    path: Path, lines: Sequence[tuple[str, str]]
) -> tuple[list[str] | None, list[tuple[str, list[str]]]]:
    """Return the header, if there is one, and the fields of every other line."""
    bodies = [line for _, line in lines]
    separator = next((s for s in ";\t" if all(s in body for body in bodies[:5])), "")
    if not separator and any('"' in body for body in bodies[:5]):
        separator = ","
    if separator:
        fields = [[field.strip() for field in row] for row in csv.reader(bodies, delimiter=separator)]
    else:
        spaced = [body.split() for body in bodies]
        if _has_decimal_commas(spaced):
            fields = spaced
        else:
            split = re.compile(r"\s*,\s*|\s+" if not any("," in body for body in bodies) else r"\s*,\s*")
            fields = [[field for field in split.split(body.strip()) if field] for body in bodies]
            if any("," in body for body in bodies):
                fields = [split.split(body.strip()) for body in bodies]
    if _has_decimal_commas(fields):
        fields = [[f.replace(",", ".") if _DECIMAL_COMMA.fullmatch(f) else f for f in row] for row in fields]
    if len(fields) != len(lines):
        raise InputError(f"{path}: quotes that do not close", code=Code.INVALID_FIELD)
    rows = [(place, row) for (place, _), row in zip(lines, fields, strict=True)]
    first = rows[0][1]
    is_header = len(first) >= 6 and not any(re.fullmatch(NUMBER, field, re.ASCII) for field in first)
    is_header = is_header and not _LABELLED.search(bodies[0]) and len(rows) > 1
    if not is_header and len(rows) == 1 and len(first) >= 6 and not re.search(r"\d\s*[,;\s]", bodies[0]):
        is_header = True
    return (first, rows[1:]) if is_header else (None, rows)


def _has_decimal_commas(rows: Sequence[Sequence[str]]) -> bool:
    """Tell whether fractions are written with a comma: some are, and none with a point."""
    fields = [field for row in rows[:50] for field in row]
    return any(_DECIMAL_COMMA.fullmatch(f) for f in fields) and not any(
        re.fullmatch(r"[+-]?\d*\.\d+([eE][+-]?\d+)?", f) for f in fields
    )


def _under_header(
    path: Path, header: list[str], rows: Sequence[tuple[str, list[str]]], stated: Statement
) -> PoseRows:
    if not rows:
        raise InputError(f"{path}: no poses after the header", code=Code.NO_POSES)
    try:
        columns = columns_of(header)
    except InputError as error:
        raise InputError(f"{path}: {error.message}", code=error.code, hint=error.hint) from error
    found: list[_Row] = []
    for place, fields in rows:
        where = f"{path}: {place}"
        if len(fields) != len(header):
            raise InputError(f"{where}: {len(fields)} values, expected {len(header)}", code=Code.WRONG_SHAPE)
        name = "" if columns.name is None else fields[columns.name]
        numbers = [
            number(fields[i].strip("[](){}"), f"{where}: {label}")
            for i, label in zip(columns.pose, columns.labels, strict=True)
        ]
        found.append((name, numbers, place))
    said = stated if columns.unit is None else stated.over(Statement(unit=columns.unit))
    plain = rows_of(path, found, said, columns.labels)
    return replace(plain, degrees=columns.degrees, has_time=columns.has_time, accuracies=columns.accuracies)


def _with_letters(lines: Sequence[tuple[str, str]]) -> list[_Row]:
    """Return poses written as X 1, Y 2, Z 3, A 4, B 5, C 6, on one line or several."""
    found: list[_Row] = []
    name, place, pending = "", "", dict[str, float]()
    for where, line in lines:
        picture = _PICTURE.search(line)
        if picture:
            name, line = picture.group().strip(), line.replace(picture.group(), " ")  # noqa: PLW2901
        for label, value in _LABELLED.findall(line):
            key = label.lower()
            if key == "x":
                pending, place = {}, where
            elif not pending:
                continue
            if len(pending) < 6 and key not in pending:
                pending[key] = float(value)
                if len(pending) == 6:
                    found.append((name, list(pending.values()), place))
                    name = ""
    return found


def _in_blocks(lines: Sequence[tuple[str, str]]) -> list[_Row]:
    """Return matrices written in blocks of three or four lines of four numbers."""
    found: list[_Row] = []
    name, block, start = "", list[list[float]](), ""
    numeric = [(place, line, _numbers(line)) for place, line in lines]
    rows = [numbers for _, _, numbers in numeric if numbers]
    if not rows or any(len(row) != 4 for row in rows) or len(rows) < 3:
        return []
    last = rows[3::4]
    square = len(rows) % 4 == 0 and (_is_last(last) or _is_last_column(rows))
    height = 4 if square else 3
    if len(rows) % height:
        return []
    for place, line, numbers in numeric:
        if not numbers:
            name = line.strip().strip(":[]")
            continue
        start = start or place
        block.append(numbers)
        if len(block) == height:
            found.append((name, [value for row in block for value in row], start))
            name, block, start = "", [], ""
    return found


def _is_last(rows: Sequence[Sequence[float]]) -> bool:
    return all(np.allclose(row, [0, 0, 0, 1], atol=1e-6) for row in rows)


def _is_last_column(rows: Sequence[Sequence[float]]) -> bool:
    return all(abs(row[3] - (i % 4 == 3)) < 1e-6 for i, row in enumerate(rows))


def _numbers(line: str) -> list[float]:
    picture = _PICTURE.search(line)
    rest = line.replace(picture.group(), " ") if picture else line
    return [float(value) for value in _FREE_NUMBER.findall(rest)]


def _one_a_line(path: Path, rows: Sequence[tuple[str, list[str]]]) -> list[_Row]:
    found: list[_Row] = []
    for place, fields in rows:
        line = " ".join(fields)
        picture = _PICTURE.search(line)
        name = picture.group().strip() if picture else ""
        words = [f for f in fields if f and not any(c.isdigit() for c in f)]
        if not picture and re.fullmatch(r"[A-Za-z_][\w.-]*", fields[0]):
            name = fields[0]
        target = _ROBTARGET.search(line)
        numbers = _numbers(target.group() if target else line if picture else line.removeprefix(name))
        for word in words:
            if word.lower().strip("+-[]()") in {"nan", "inf", "infinity"}:
                number(word.strip("[]()"), f"{path}: {place}")
        found.append((name, numbers, place))
    return found
