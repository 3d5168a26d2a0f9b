"""Every driver has a page that says what it was tested against and what that does not show."""

import re
from pathlib import Path

import pytest

from handeye.extension import CAMERAS, ROBOTS, announced

PAGES = Path(__file__).resolve().parents[2] / "docs" / "drivers"
# A row of the table: the name, and its page where it has one.
ROW = re.compile(r"^\| (?:\[`(?P<linked>\w+)`\]\((?P<page>[\w.]+)\)|`(?P<name>\w+)`) \|", re.MULTILINE)
ROWS = [match.groupdict() for match in ROW.finditer((PAGES / "index.md").read_text())]
LINKED = sorted({row["page"] for row in ROWS if row["page"]})


def test_every_driver_is_in_the_table() -> None:
    ours = {
        point.name
        for group in (ROBOTS, CAMERAS)
        for point in announced(group).values()
        if point.value.startswith("handeye.")
    }
    assert ours == {row["linked"] for row in ROWS if row["linked"]}
    assert {path.name for path in PAGES.glob("*.md")} == {*LINKED, "index.md"}
    assert "**None of them has been tried on a real device.**" in (PAGES / "index.md").read_text()


@pytest.mark.parametrize("page", LINKED)
def test_a_page_says_what_was_tested_and_what_that_does_not_show(page: str) -> None:
    _, _, tested = (PAGES / page).read_text().partition("## Tested against")
    assert "**Not shown by this:**" in " ".join(tested.split())
