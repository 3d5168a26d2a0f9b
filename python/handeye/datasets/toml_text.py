"""TOML that a person can read: a matrix has a line per row; and reading what a stranger wrote.

The common writers put every number on a line of its own.
"""

import re
import tomllib
from collections.abc import Mapping
from typing import Any, TypeGuard, cast

Table = Mapping[str, Any]

# A key of very many parts, a.a.a..., takes the reader of TOML a time that grows with their square.
MAX_DOTS_IN_KEY = 30
# Whole numbers of files fit 64 bits. Larger ones in hexadecimal Python may not even print.
MAX_BITS = 64

_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def toml_text(document: Table) -> str:
    """Return a document as TOML text that reads back to the same values.

    Values: text, bool, int, finite float, lists of these, matrices (lists of lists), tables one deep, and
    lists of tables. Keys are plain words.
    """
    simple: list[str] = []
    tables: list[str] = []
    lists_of_tables: list[str] = []
    for key, value in document.items():
        if isinstance(value, Mapping):
            tables += ["", f"[{key}]", *_pairs(cast("Table", value))]
        elif _is_list(value) and value and isinstance(value[0], Mapping):
            for table in value:
                lists_of_tables += ["", f"[[{key}]]", *_pairs(table)]
        else:
            simple.append(_pair(key, value))
    return "\n".join([*simple, *tables, *lists_of_tables]) + "\n"


def toml_values(text: str) -> dict[str, Any]:
    """Return what a text in TOML holds, in a time that grows evenly with its length.

    Raises
    ------
    ValueError
        No TOML, a key of very many parts, or a whole number that does not fit 64 bits.
    """
    for number, line in enumerate(text.split("\n"), start=1):
        if line.count(".") > MAX_DOTS_IN_KEY:
            bare = re.sub(r"[\s\"']", "", line)
            if max(part.count(".") for part in re.split(r"[,=\[\]{}]", bare)) > MAX_DOTS_IN_KEY:
                raise ValueError(f"line {number}: a key or value with more than {MAX_DOTS_IN_KEY} dots")
    document = tomllib.loads(text)
    pending: list[Any] = [document]
    while pending:
        value = pending.pop()
        if isinstance(value, dict):
            pending += cast("dict[str, Any]", value).values()
        elif _is_list(value):
            pending += value
        elif isinstance(value, int) and value.bit_length() > MAX_BITS:
            raise ValueError(f"a whole number of {value.bit_length()} bits, expected at most {MAX_BITS}")
    return document


def _is_list(value: object) -> TypeGuard[list[Any]]:
    return isinstance(value, list)


def _pairs(table: Table) -> list[str]:
    return [_pair(key, value) for key, value in table.items()]


def _pair(key: str, value: object) -> str:
    return f"{key} = {_value(value)}"


def _value(value: object) -> str:
    if isinstance(value, str):
        return '"' + "".join(_character(character) for character in value) + '"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if _is_list(value):
        rows = [_value(item) for item in value]
        if any(_is_list(item) for item in value):
            return "[\n" + "".join(f"  {row},\n" for row in rows) + "]"
        return "[" + ", ".join(rows) + "]"
    raise TypeError(f"no TOML for {type(value).__name__}")


def _character(character: str) -> str:
    if character in _ESCAPES:
        return _ESCAPES[character]
    if ord(character) < 0x20 or ord(character) == 0x7F:
        return f"\\u{ord(character):04x}"
    return character
