"""Residuals as arrows, on the same scale in all views."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handeye.report.canvas import Canvas
from handeye.report.views import ViewPicture
from handeye.report.wording import figures
from handeye.types.arrays import FloatArray

_WIDTH = 240.0
# A long arrow (95 % are shorter) is drawn so long, as a share of the width.
_LONG_SHARE = 0.08
# More arrows than this would be a grey patch.
_MOST_ARROWS = 320
# Cells across the image of the picture of means.
_CELLS = 12
_FEWEST_IN_CELL = 3
_FRAME = 'fill="#fafafa" stroke="#b0b8be" stroke-width="0.8"'
_DOTS, _ARROWS = 'stroke="#263238"', 'stroke="#d0392f" stroke-width="0.7"'


@dataclass(frozen=True)
class Tile:
    """A picture with its words."""

    svg: str
    title: str
    note: str


@dataclass(frozen=True)
class Tiles:
    """All residual pictures, and their common scale in words."""

    tiles: list[Tile]
    scale: str


def residual_tiles(pictures: Sequence[ViewPicture], left_out: frozenset[str]) -> Tiles:
    """Draw the residuals of every view, and their mean over all views in cells of the image."""
    drawn = [picture for picture in pictures if len(picture.residuals)]
    if not drawn:
        return Tiles([], "")
    lengths = np.concatenate(
        [np.linalg.norm(p.residuals, axis=1) for p in drawn if p.name not in left_out] or [np.ones(1)]
    )
    long_px = _nice(float(np.quantile(lengths, 0.95)))
    # From pixels of a residual to units of the picture.
    enlarge = _LONG_SHARE * _WIDTH / long_px
    tiles = [_mean_tile([p for p in drawn if p.name not in left_out], enlarge)]
    for picture in drawn:
        note = f"{figures(picture.rmse_px, 2)} px" + (", left out" if picture.name in left_out else "")
        label = f"Residuals of view {picture.name}"
        tiles.append(
            Tile(_arrows(picture, picture.pixels, picture.residuals, enlarge, label), picture.name, note)
        )
    scale = f"so long is a residual of {figures(long_px, 1)} px"
    return Tiles([tile for tile in tiles if tile.svg], scale)


def scale_bar() -> str:
    """Draw an arrow of the length that the scale speaks of."""
    canvas = Canvas(_LONG_SHARE * _WIDTH + 4, 8, "Scale")
    canvas.path(np.array([[2.0, 4.0], [2 + _LONG_SHARE * _WIDTH, 4.0]]), _ARROWS)
    return canvas.markup()


def _mean_tile(pictures: Sequence[ViewPicture], enlarge: float) -> Tile:
    """Draw the mean residual of all views in each part of the image: what the lens model leaves."""
    if not pictures:
        return Tile("", "", "")
    first = pictures[0]
    pixels = np.concatenate([p.pixels for p in pictures])
    residuals = np.concatenate([p.residuals for p in pictures])
    cell = first.width_px / _CELLS
    places = np.floor((pixels + 0.5) / cell).astype(np.int64)
    _, index, counts = np.unique(places, axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(counts), 4))
    np.add.at(sums, index.ravel(), np.hstack([pixels, residuals]))
    means = sums / counts[:, np.newaxis]
    means = means[counts >= _FEWEST_IN_CELL]
    if len(means) == 0:
        return Tile("", "", "")
    svg = _arrows(first, means[:, :2], means[:, 2:], enlarge, "Mean residual of all views over the image")
    typical = float(np.sqrt(np.square(means[:, 2:]).sum(axis=1).mean()))
    return Tile(svg, "all views", f"mean: {figures(typical, 2)} px")


def _arrows(
    picture: ViewPicture, pixels: FloatArray, residuals: FloatArray, enlarge: float, label: str
) -> str:
    scale = _WIDTH / picture.width_px
    canvas = Canvas(_WIDTH, scale * picture.height_px, label)
    canvas.box(0.4, 0.4, canvas.width - 0.8, canvas.height - 0.8, _FRAME)
    every = max(1, -(-len(pixels) // _MOST_ARROWS))
    starts = (pixels[::every] - residuals[::every] + 0.5) * scale
    steps = residuals[::every] * enlarge
    # One wild point must not run across the page.
    lengths = np.linalg.norm(steps, axis=1, keepdims=True)
    steps = steps * np.minimum(1.0, 0.5 * _WIDTH / np.maximum(lengths, 1e-12))
    canvas.segments(starts, starts + steps, _ARROWS)
    canvas.dots(starts, 0.7, _DOTS)
    return canvas.markup()


def _nice(value: float) -> float:
    """Return the nearest of 1, 2, 5 times a power of ten."""
    if not value > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(min((1, 2, 5, 10), key=lambda step: abs(np.log(step * power / value))) * power)
