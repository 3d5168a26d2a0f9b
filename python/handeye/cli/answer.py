"""What a command gives back: the values for a program, and how to show them to a person."""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from handeye.errors import ExitCode

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, eq=False)
class Answer:
    """The result of a command; the boundary prints one of the two.

    Parameters
    ----------
    data
        Plain values with stable keys, units in the keys; printed as one JSON object with ``--json``.
    show
        Prints the same for a person.
    exit_code
        What the process ends with: not every answer is a good one.
    after
        Done once that is printed, such as keeping a page open; None for nothing.
    """

    data: Mapping[str, Any]
    show: "Callable[[Console], None]"
    after: Callable[[], None] | None = None
    exit_code: ExitCode = ExitCode.SUCCESS


def json_text(data: Mapping[str, Any]) -> str:
    """Return one JSON object as text that a person can read too: a row of numbers has one line.

    JSON knows neither NaN nor infinity: both become null.
    """
    # Half of a surrogate pair, as in names that are no UTF-8, cannot be written but as an escape.
    return re.sub(r"[\ud800-\udfff]", lambda half: f"\\u{ord(half[0]):04x}", _text(data, "")) + "\n"


def _text(value: object, indent: str) -> str:
    if isinstance(value, Mapping):
        pairs = cast("Mapping[str, object]", value)
        inner = [f"{json.dumps(str(key))}: {_text(item, indent + '  ')}" for key, item in pairs.items()]
        return _block("{", inner, "}", indent)
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        items = [_text(item, indent + "  ") for item in cast("Sequence[object]", value)]
        if all(_is_simple(item) for item in cast("Sequence[object]", value)):
            return "[" + ", ".join(items) + "]"
        return _block("[", items, "]", indent)
    if isinstance(value, float) and not math.isfinite(value):
        return "null"
    return json.dumps(value, ensure_ascii=False)


def _is_simple(value: object) -> bool:
    return value is None or isinstance(value, str | int | float)


def _block(opening: str, inner: list[str], closing: str, indent: str) -> str:
    if not inner:
        return opening + closing
    separator = f",\n{indent}  "
    return f"{opening}\n{indent}  {separator.join(inner)}\n{indent}{closing}"
