"""`ost.txt` of ROS's camera calibrator: sections in brackets, rows of numbers under plain headings.

image_pipeline, `camera_calibration/calibrator.py`, `lrost`.
"""

import re

from handeye.datasets.camera_files.base import Table

_NUMBER = re.compile(r"[+-]?[\d.]+(e[+-]?\d+)?", re.IGNORECASE | re.ASCII)


def table_of(text: str) -> Table | None:
    """Return the numbers under their headings, with the names that `camera_info` has; None if it is not."""
    if "[image]" not in text or "camera matrix" not in text:
        return None
    found: dict[str, list[str]] = {}
    heading = ""
    for line in text.splitlines()[:200]:
        words = line.split()
        if words and all(_NUMBER.fullmatch(word) for word in words):
            found.setdefault(heading, []).extend(words)
        elif words:
            heading = line.strip()
    (width, *_), (height, *_) = found.get("width") or [""], found.get("height") or [""]
    coefficients = found.get("distortion", [])
    return {
        "image_width": width,
        "image_height": height,
        "camera_matrix": list(found.get("camera matrix", [])),
        "distortion_model": "rational_polynomial" if len(coefficients) == 8 else "plumb_bob",
        "distortion_coefficients": list(coefficients),
    }
