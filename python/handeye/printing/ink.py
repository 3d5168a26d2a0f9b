"""What is printed on a target, as shapes for paper."""

from dataclasses import dataclass

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.pattern import tile_bits
from handeye.printing.outline import outline
from handeye.printing.shapes import Area, Disc, rectangle
from handeye.types import CircleGrid, Target
from handeye.types.arrays import FloatArray
from handeye.types.target.artwork import Discs, Markers, Squares
from handeye.types.units import MM_PER_M


@dataclass(frozen=True, eq=False)
class Ink:
    """What is printed on a board, in millimetres of the frame of the target.

    Parameters
    ----------
    shapes
        What is black.
    low, high
        (2,) corners of the printed part.
    quiet_mm
        Light margin that the print needs around it to be found.
    """

    shapes: tuple[Area | Disc, ...]
    low: FloatArray
    high: FloatArray
    quiet_mm: float


def ink_of(target: Target) -> Ink:
    """Return what is printed on a target; light on dark its dark margin included.

    Raises
    ------
    InputError
        One circle is larger, but not known how much.
    """
    if isinstance(target, CircleGrid) and target.marked is not None and target.marked_diameter_m is None:
        raise InputError(
            "circle_grid: a marked circle without marked_diameter_m cannot be drawn",
            code=Code.INVALID_FIELD,
            hint="say how large it is to be",
        )
    artwork = target.artwork()
    low, high = artwork.low * MM_PER_M, artwork.high * MM_PER_M
    quiet = artwork.quiet_m * MM_PER_M
    discs: list[Disc] = []
    loops: list[FloatArray] = []
    for layer in artwork.layers:
        if isinstance(layer, Discs):
            discs += _discs(layer)
        else:
            loops += _loops(layer)
    if artwork.inverted:
        low, high = low - quiet, high + quiet
        loops = [rectangle(*low, *(high - low)), *(loop[::-1] for loop in loops)]
    areas = (Area(tuple(loops)),) if loops else ()
    return Ink((*areas, *discs), low, high, quiet)


def _discs(layer: Discs) -> list[Disc]:
    radii, pitch = layer.radii_m * MM_PER_M, layer.pitch_m * MM_PER_M
    return [
        Disc(column * pitch, row * pitch, float(radii[row, column]))
        for row, column in np.argwhere(radii > 0).tolist()
    ]


def _loops(layer: Squares | Markers) -> list[FloatArray]:
    """Return closed loops around what is dark; squares that touch have one outline."""
    origin, pitch = layer.origin * MM_PER_M, layer.pitch_m * MM_PER_M
    if isinstance(layer, Squares) and layer.pitch_m == layer.side_m:
        return [origin + loop * pitch for loop in outline(layer.dark)]
    which, bits = tile_bits(layer)
    outlines = [outline(pattern) for pattern in bits]
    bit = layer.side_m * MM_PER_M / bits.shape[1]
    loops: list[FloatArray] = []
    for row, column in np.argwhere(which >= 0).tolist():
        corner = origin + np.array([column, row]) * pitch
        loops += [corner + loop * bit for loop in outlines[int(which[row, column])]]
    return loops
