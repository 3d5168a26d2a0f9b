"""Run simulated cells whose camera nobody has calibrated, beside the same cells with a calibrated one.

.venv/bin/python tools/measure_uncalibrated.py --cells 60 --output out/uncalibrated.jsonl

Lenses take turns (ordinary, wide, fisheye), so do arms, mountings and kinds of errors of the arm. One line
per cell is appended to the output, cells that are there already are not run again.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from measure_loop import ASKED_DEG, ASKED_MM, cell

from handeye.estimation.lens_confidence import lens_difference_px
from handeye.session.configuration import begin, prepare
from handeye.session.deciding import EndReason
from handeye.session.settings import Configuration
from handeye.session.simulated import LENSES

KINDS = ("none", "white_flange", "encoder", "joint_offsets", "mixture")
ASKED_PX = 1.0


def configuration(number: int, *, rendered: bool) -> Configuration:
    """Return a run with an unknown camera; arm, mounting, lens and noise depend on the number alone."""
    quiet = cell(KINDS[number % len(KINDS)], 700 + number)
    lens = list(LENSES)[(number // 4) % len(LENSES)]
    noise = None if rendered else quiet.simulation.points_only
    simulation = replace(quiet.simulation, lens=lens, points_only=noise)
    return replace(quiet, camera_known=False, accuracy_px=ASKED_PX, simulation=simulation)


def run(asked: Configuration) -> dict[str, Any]:
    """Run a cell to its end; return what came of it."""
    began = time.monotonic()
    prepared = prepare(asked)
    with tempfile.TemporaryDirectory() as folder:
        session, store = begin(prepared, Path(folder) / "session")
        try:
            end = session.run()
        finally:
            store.close()
    line: dict[str, Any] = {"end": end.reason.value, "views": end.views, "attempts": end.attempts}
    if end.calibration is not None and end.reach is not None and prepared.true_camera is not None:
        off = (end.calibration.X @ prepared.truth.X.inverse()).log()
        line |= {
            "mm": 1e3 * float(np.linalg.norm(off[:3])),
            "deg": float(np.rad2deg(np.linalg.norm(off[3:]))),
            "px": lens_difference_px(prepared.true_camera, end.calibration.camera),
            "promised_mm": end.reach.translation_mm,
            "promised_deg": end.reach.rotation_deg,
            "model": end.calibration.camera.lens,
        }
    return line | {"sentence": end.sentence, "seconds": time.monotonic() - began}


def true(line: Mapping[str, Any], *, px: bool) -> bool:
    """Tell whether the accuracy was reached, and is so by the truth."""
    return (
        line["end"] == EndReason.ACCURACY_REACHED.value
        and line["mm"] <= ASKED_MM
        and line["deg"] <= ASKED_DEG
        and (not px or line["px"] <= ASKED_PX)
    )


def main() -> int:
    """Run what is missing, sum up what is there."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cells", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--rendered", action="store_true", help="pictures instead of points")
    parser.add_argument("--output", type=Path, required=True)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    path: Path = options.output
    lines = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {line["number"] for line in lines}
    with path.open("a") as file:
        for number in range(options.first, options.first + options.cells):
            if number in done:
                continue
            asked = configuration(number, rendered=options.rendered)
            line = {
                "number": number,
                "kind": KINDS[number % len(KINDS)],
                "lens": asked.simulation.lens,
                "unknown": run(asked),
                "calibrated": run(replace(asked, camera_known=True)),
            }
            file.write(json.dumps(line) + "\n")
            file.flush()
            lines.append(line)
    for lens in (*LENSES, None):
        some = [line for line in lines if lens in (line["lens"], None)]
        if not some:
            continue
        met = sum(line["unknown"]["end"] == EndReason.ACCURACY_REACHED.value for line in some)
        kept = sum(true(line["unknown"], px=True) for line in some)
        beside = sum(true(line["calibrated"], px=False) for line in some)
        views, before = (np.sum([line[key]["views"] for line in some]) for key in ("unknown", "calibrated"))
        print(
            f"{lens or 'all'}: {len(some)} cells, {met} met, {kept} of them true; {beside} true with a "
            f"calibrated camera; {views / len(some):.1f} and {before / len(some):.1f} views, "
            f"ratio {views / before:.2f}"
        )
    for line in lines:
        if not true(line["unknown"], px=True):
            print("  not:", line["number"], line["kind"], line["lens"], line["unknown"])
    return 0


if __name__ == "__main__":
    sys.exit(main())
