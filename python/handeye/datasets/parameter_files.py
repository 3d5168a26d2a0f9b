"""A target in a file of its own: TOML or JSON, the fields at the top level or in a table `target`.

So a `recording.toml` serves too.
"""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from handeye.datasets.reading import MIB, located, read_text
from handeye.datasets.toml_reading import parse_toml
from handeye.errors import InputError
from handeye.types import Target

MAX_BYTES = 2 * MIB


def read_target(path: str | os.PathLike[str]) -> Target:
    """Read a target from a .toml or .json file of ours.

    Raises
    ------
    InputError
        Not such a file; the message names file and field.
    """
    file = Path(path)
    table = _table(file)
    with located(str(file)):
        return Target.from_dict(table)


def _table(file: Path) -> dict[str, Any]:
    """Return the table `target` of a file, or the whole file where it has no such table."""
    suffix = file.suffix.lower()
    if suffix not in {".toml", ".json"}:
        raise InputError(
            f"{file}: a target in a file of this kind, expected .toml or .json", code="unknown_format"
        )
    text = read_text(file, MAX_BYTES)
    if suffix == ".toml":
        document: object = parse_toml(text, file)
    else:
        try:
            document = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{file}: not JSON: {error}", code="not_json") from error
    if not isinstance(document, Mapping):
        raise InputError(f"{file}: expected a table with the fields of a target", code="invalid_field")
    table = cast("Mapping[str, Any]", document)
    inner = table.get("target", table)
    return dict(cast("Mapping[str, Any]", inner)) if isinstance(inner, Mapping) else {"target": inner}
