"""Writing TOML that a person can read: a matrix has a line per row.

The common writers put every number on a line of its own.
"""

from collections.abc import Mapping
from typing import Any, TypeGuard, cast

Table = Mapping[str, Any]

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
