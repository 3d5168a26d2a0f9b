"""The pages about data faults are those that the list of kinds makes."""

import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_pages_are_as_the_kinds_say() -> None:
    tool = runpy.run_path(str(ROOT / "tools" / "write_fault_pages.py"))
    wanted: dict[str, str] = tool["pages"]()
    written = {
        page.name: page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "faults").glob("*.md")
    }
    assert written == wanted, "run tools/write_fault_pages.py"
