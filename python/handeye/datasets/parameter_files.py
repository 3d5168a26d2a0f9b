"""A target in a file of its own: TOML or JSON, the fields at the top level or in a table `target`.

So a `recording.toml` serves too. Also the YAML that Kalibr reads (Kalibr, wiki "Calibration targets")::

    target_type: aprilgrid      tagCols, tagRows, tagSize [m], tagSpacing (share of the size)
    target_type: checkerboard   targetCols, targetRows (inner corners), rowSpacingMeters, colSpacingMeters
    target_type: circlegrid     targetCols, targetRows, spacingMeters, asymmetricGrid
"""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import msgspec

from handeye.codes import Code
from handeye.datasets.reading import MIB, located, read_text
from handeye.datasets.toml_reading import parse_toml
from handeye.datasets.yaml_reading import read_yaml
from handeye.errors import InputError
from handeye.types import Target
from handeye.types.plain import read_document

MAX_BYTES = 2 * MIB


def read_target(path: str | os.PathLike[str]) -> Target:
    """Read a target from a .toml or .json file of ours, or a .yaml file of Kalibr.

    Raises
    ------
    InputError
        Not such a file; the message names file and field.

    Examples
    --------
    >>> import json, pathlib
    >>> from handeye.types import Chessboard
    >>> _ = pathlib.Path("board.json").write_text(json.dumps(Chessboard(6, 9, 0.025).to_dict()))
    >>> read_target("board.json").point_count
    54
    """
    file = Path(path)
    table = _table(file)
    with located(str(file)):
        return Target.from_dict(table)


def _table(file: Path) -> dict[str, Any]:
    """Return the table `target` of a file, or the whole file where it has no such table."""
    suffix = file.suffix.lower()
    if suffix in {".yaml", ".yml"}:
        with located(str(file)):
            return _kalibr(read_yaml(file))
    if suffix not in {".toml", ".json"}:
        raise InputError(
            f"{file}: a target in a file of this kind, expected .toml, .json or Kalibr's .yaml",
            code=Code.UNKNOWN_FORMAT,
        )
    text = read_text(file, MAX_BYTES)
    if suffix == ".toml":
        document: object = parse_toml(text, file)
    else:
        try:
            document = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{file}: not JSON: {error}", code=Code.NOT_JSON) from error
    if not isinstance(document, Mapping):
        raise InputError(f"{file}: expected a table with the fields of a target", code=Code.INVALID_FIELD)
    table = cast("Mapping[str, Any]", document)
    inner = table.get("target", table)
    return dict(cast("Mapping[str, Any]", inner)) if isinstance(inner, Mapping) else {"target": inner}


class _Kalibr(msgspec.Struct):
    """What Kalibr's file of a target may hold."""

    target_type: str
    tagCols: int | None = None
    tagRows: int | None = None
    tagSize: float | None = None
    tagSpacing: float | None = None
    targetCols: int | None = None
    targetRows: int | None = None
    rowSpacingMeters: float | None = None
    colSpacingMeters: float | None = None
    spacingMeters: float | None = None
    asymmetricGrid: bool = False


# Kalibr says how far apart circles are, not how large: a radius of a fifth, as OpenCV's gen_pattern.py draws.
_USUAL_DIAMETER = 0.4


def _kalibr(document: object) -> dict[str, Any]:
    """Return a target of Kalibr in our fields."""
    given = read_document(document, _Kalibr, "a target of Kalibr", lax=True)
    if given.target_type == "aprilgrid":
        wanted = {"rows": "tagRows", "columns": "tagCols", "tag_m": "tagSize", "spacing_ratio": "tagSpacing"}
        return {"family": "aprilgrid", **_needed(given, wanted)}
    if given.target_type == "checkerboard":
        wanted = {"rows": "targetRows", "columns": "targetCols", "pitch_m": "rowSpacingMeters"}
        if given.colSpacingMeters != given.rowSpacingMeters:
            raise InputError(
                f"squares of {given.rowSpacingMeters} m by {given.colSpacingMeters} m, expected equal sides",
                code=Code.INVALID_FIELD,
            )
        return {"family": "chessboard", **_needed(given, wanted)}
    if given.target_type == "circlegrid":
        fields = _needed(given, {"rows": "targetRows", "columns": "targetCols", "pitch_m": "spacingMeters"})
        diameter = _USUAL_DIAMETER * float(fields["pitch_m"])
        return {"family": "circle_grid", **fields, "diameter_m": diameter, "asymmetric": given.asymmetricGrid}
    raise InputError(
        f"target_type {given.target_type[:40]!r}, expected aprilgrid, checkerboard or circlegrid",
        code=Code.UNKNOWN_TARGET,
    )


def _needed(given: _Kalibr, wanted: Mapping[str, str]) -> dict[str, Any]:
    missing = [theirs for theirs in wanted.values() if getattr(given, theirs) is None]
    if missing:
        raise InputError(f"{given.target_type}: {missing[0]} is missing", code=Code.INVALID_FIELD)
    return {ours: getattr(given, theirs) for ours, theirs in wanted.items()}
