"""TOML from strangers, with the name of the file in what is said about it."""

from pathlib import Path
from typing import Any

from handeye.codes import Code
from handeye.datasets.toml_text import toml_values
from handeye.errors import InputError


def parse_toml(text: str, file: Path) -> dict[str, Any]:
    """Return what a text in TOML holds.

    Raises
    ------
    InputError
        Not TOML, a key of very many parts, or a whole number that does not fit 64 bits.
    """
    try:
        return toml_values(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{file}: not TOML: {str(error)[:200]}",
            code=Code.NOT_TOML,
            hint="repair the line, or write the file again",
        ) from error
