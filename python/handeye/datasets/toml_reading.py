"""TOML from strangers."""

import tomllib
from pathlib import Path
from typing import Any

from handeye.errors import InputError

# A key of very many parts, a.a.a..., takes the reader of TOML hours; no line of ours has nearly as many dots.
MAX_DOTS_IN_LINE = 300


def parse_toml(text: str, file: Path) -> dict[str, Any]:
    """Return what a text in TOML holds.

    Raises
    ------
    InputError
        Not TOML, or a line with too many dots.
    """
    if any(line.count(".") > MAX_DOTS_IN_LINE for line in text.split("\n")):
        raise InputError(f"{file}: a line with more than {MAX_DOTS_IN_LINE} dots", code="not_toml")
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{file}: not TOML: {error}",
            code="not_toml",
            hint="repair the line, or write the file again",
        ) from error
