"""Writes a page for every kind of data fault into `docs/faults`, from the list in the package.

`python tools/write_fault_pages.py` writes them; the tests compare.
"""

import sys
from pathlib import Path

from handeye.estimation.faults import KINDS, Kind

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "faults"
HEADER = "<!-- Made by tools/write_fault_pages.py: change the kind's file in estimation/faults/kinds. -->\n\n"


def pages() -> dict[str, str]:
    """Return the text of every page by its name."""
    return {"index.md": _index()} | {f"{kind.code}.md": _page(kind) for kind in KINDS}


def _page(kind: Kind) -> str:
    fix = kind.repair or "nothing: new data are needed"
    return (
        f"{HEADER}# `{kind.code}`: {kind.title}\n\n{kind.cause}\n\n"
        f"**How it shows.** {kind.shows}\n\n"
        f"**What `handeye solve` does.** It is {kind.handling.value}.\n\n"
        f"**What to do.** {kind.cure}\n\n"
        f"**What `handeye doctor --fix` does.** It {fix}.\n"
    ).replace("It nothing: new data are needed.", "Nothing: new data are needed.")


def _index() -> str:
    rows = "\n".join(f"| [`{k.code}`]({k.code}.md) | {k.title} | {k.handling.value} |" for k in KINDS)
    tree = "\n".join(kind.code for kind in KINDS)
    return (
        f"{HEADER}# What can be wrong with data\n\n"
        "`handeye solve` looks for all of these before anything is estimated, and `handeye doctor` says\n"
        "more of each and writes a repaired copy. How they are told from noise is in [](../mistakes.md).\n\n"
        f"| code | what it is | what `solve` does |\n|---|---|---|\n{rows}\n\n"
        f"```{{toctree}}\n:hidden:\n\n{tree}\n```\n"
    )


def main() -> None:
    """Write the pages; those of kinds that are gone are removed."""
    FOLDER.mkdir(exist_ok=True)
    wanted = pages()
    for old in FOLDER.glob("*.md"):
        if old.name not in wanted:
            old.unlink()
    for name, text in wanted.items():
        (FOLDER / name).write_text(text, encoding="utf-8")
    sys.stdout.write(f"{len(wanted)} pages in {FOLDER}\n")


if __name__ == "__main__":
    main()
