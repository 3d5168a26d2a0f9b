"""Compare what `handeye expect` foretells with what simulated cells reach.

    .venv/bin/python tools/measure_expectation.py --cells 50 --first-seed 980000

Six kinds of cells, so 300 with 50 each, of seeds that the prediction does not use. Prints the mean error
foretold and reached after 6, 9 and 12 views (mm, deg), and the ratio of the two.
"""

import argparse
from dataclasses import replace

import numpy as np

from handeye.studies.expectation import expect, reached
from handeye.studies.questions import AskedCell
from handeye.types import Chessboard, Mounting, Target

VIEWS = (6, 9, 12)
KINDS: dict[str, tuple[AskedCell, Target | None]] = {
    "an arm in good order": (AskedCell(), None),
    "another arm, three times as wrong": (AskedCell("ur5e", arm_errors=3.0), None),
    "an exact arm, points off by 0.2 px": (AskedCell(pixel_sigma=0.2, arm_errors=0.0), None),
    "a board of half the size": (AskedCell(), Chessboard(6, 8, 0.01)),
    "a camera beside the arm": (AskedCell(mounting=Mounting.EYE_TO_HAND), None),
    "a fisheye": (AskedCell(lens="fisheye"), None),
}


def main() -> None:
    """Print a line for each kind and number of views."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=25)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--only", help="part of the name of a kind")
    parser.add_argument("--foretold-only", action="store_true", help="do not drive the cells to compare with")
    asked = parser.parse_args()
    for name, (cell, target) in KINDS.items():
        configuration = replace(cell.configuration(), most_views=VIEWS[-1])
        if asked.only is not None and asked.only not in name:
            continue
        foretold = expect(configuration, VIEWS, target=target)
        driven = (
            []
            if asked.foretold_only
            else [
                reached((replace(configuration, seed=asked.first_seed + i), target))
                for i in range(asked.cells)
            ]
        )
        for views in VIEWS:
            level = foretold.at(views)
            line = f"{name}, {views} views: foretold {level.mean_mm:.4f} mm {level.mean_deg:.4f} deg"
            errors = np.array([errors[views] for errors in driven if views in errors])
            if len(errors):
                mm, deg = errors.mean(axis=0)
                line += f", reached {mm:.4f} mm {deg:.4f} deg by {len(errors)} cells"
                line += f", ratio {level.mean_mm / mm:.2f} {level.mean_deg / deg:.2f}"
            print(line, flush=True)


if __name__ == "__main__":
    main()
