"""The numbers, and their published schema."""

import json
from pathlib import Path

import msgspec
import pytest

from handeye.report import Report, from_dict, schema, to_dict
from pages import gathered_cell

SCHEMA = Path(__file__).resolve().parents[2] / "docs" / "schemas" / "report.schema.json"


@pytest.fixture(scope="module")
def numbers() -> Report:
    return gathered_cell().numbers


def test_published_schema_is_that_of_the_code() -> None:
    # After a change: json.dumps(handeye.report.schema(), indent=2) and a newline.
    assert json.loads(SCHEMA.read_text()) == schema()


def test_numbers_read_back(numbers: Report) -> None:
    text = json.dumps(to_dict(numbers), allow_nan=False)
    assert from_dict(json.loads(text)) == numbers


def test_every_field_has_its_unit_or_none() -> None:
    """Lengths and angles carry their unit in the key."""
    definitions = schema()["$defs"]
    assert definitions["PositionAxis"]["required"][0] == "half_length_mm"
    for definition in definitions.values():
        assert definition.get("additionalProperties") is False, definition.get("title")


def test_a_field_that_nobody_knows_is_refused(numbers: Report) -> None:
    data = to_dict(numbers)
    with pytest.raises(msgspec.ValidationError, match="extra"):
        from_dict(data | {"extra": 1})
    with pytest.raises(msgspec.ValidationError, match="position_mm"):
        from_dict(data | {"answer": data["answer"] | {"position_mm": [1, 2]}})
    with pytest.raises(msgspec.ValidationError, match="format"):
        from_dict(data | {"format": "other"})
