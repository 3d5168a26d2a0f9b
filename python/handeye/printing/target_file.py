"""The file that tells a solve what was printed."""

import textwrap

from handeye.datasets.toml_text import toml_text
from handeye.printing.sheet import Sheet


def target_file(sheet: Sheet) -> str:
    """Return TOML with a table `target`, as `handeye.datasets.read_target` reads it."""
    width, height = sheet.size_mm
    remarks = (
        f"{sheet.caption}. Printed on {sheet.paper.name}, edge to edge {width:.2f} x {height:.2f} mm. "
        "Lengths in metres: if the print measures otherwise, multiply them by measured / stated."
    )
    comments = "".join(f"# {line}\n" for line in textwrap.wrap(remarks, 96))
    return comments + toml_text({"target": sheet.target.to_dict()})
