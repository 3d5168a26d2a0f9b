"""What is printed on a target: dark or light at any place of its plane."""

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.types import Target
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.target.artwork import Discs, Markers, Squares

Mask = NDArray[np.bool_]


class Pattern:
    """Ink on a light board.

    Attributes
    ----------
    low, high
        (2,) corners of the printed part in the plane of the target, metres.
    finest_m
        Size of the smallest detail.
    """

    def __init__(self, target: Target) -> None:
        artwork = target.artwork()
        self.low, self.high = artwork.low, artwork.high
        self._inverted = artwork.inverted
        self._layers = [
            _Discs(layer) if isinstance(layer, Discs) else _Tiles(layer) for layer in artwork.layers
        ]
        self.finest_m = min(layer.finest_m for layer in self._layers)

    def is_dark(self, plane: FloatArray) -> Mask:
        """Tell where (N,) there is ink, at places (N, 2) of the plane of the target in metres."""
        dark = np.zeros(len(plane), dtype=bool)
        for layer in self._layers:
            dark |= layer.is_dark(plane)
        return ~dark if self._inverted else dark


class _Tiles:
    """Bits of squares or markers on a lattice."""

    def __init__(self, layer: Squares | Markers) -> None:
        self._origin, self._pitch = layer.origin, layer.pitch_m
        self._per_tile = layer.pitch_m / layer.side_m
        self._which, self._bits = tile_bits(layer)
        gap = layer.pitch_m - layer.side_m
        bit = layer.side_m / self._bits.shape[1]
        self.finest_m = min(bit, gap) if gap > 0 and self._which.size > 1 else bit

    def is_dark(self, plane: FloatArray) -> Mask:
        scaled = (plane - self._origin) / self._pitch
        index = np.floor(scaled).astype(np.int64)
        column, row = index.T
        rows, columns = self._which.shape
        on_lattice = (column >= 0) & (row >= 0) & (column < columns) & (row < rows)
        which = np.where(on_lattice, self._which[row.clip(0, rows - 1), column.clip(0, columns - 1)], -1)
        cell = (scaled - index) * self._per_tile
        size = self._bits.shape[1]
        x, y = np.floor(cell * size).astype(np.int64).T
        inside = (which >= 0) & (x < size) & (y < size)
        return inside & self._bits[which, y.clip(0, size - 1), x.clip(0, size - 1)]


class _Discs:
    """Discs on a lattice."""

    def __init__(self, layer: Discs) -> None:
        self._pitch, self._radii = layer.pitch_m, layer.radii_m
        self._reach = int(np.ceil(layer.radii_m.max() / layer.pitch_m))
        self.finest_m = 2 * float(layer.radii_m[layer.radii_m > 0].min())

    def is_dark(self, plane: FloatArray) -> Mask:
        dark = np.zeros(len(plane), dtype=bool)
        index = np.floor(plane / self._pitch).astype(np.int64)
        rows, columns = self._radii.shape
        steps = range(1 - self._reach, 1 + self._reach)
        for down in steps:
            for right in steps:
                column, row = (index + np.array([right, down])).clip(0, [columns - 1, rows - 1]).T
                centre = np.column_stack([column, row]) * self._pitch
                dark |= ((plane - centre) ** 2).sum(axis=1) < self._radii[row, column] ** 2
        return dark


def tile_bits(layer: Squares | Markers) -> tuple[IndexArray, Mask]:
    """Return which pattern each tile (R, C) has, -1 for none, and the dark bits (K, B, B) of these."""
    if isinstance(layer, Squares):
        return np.where(layer.dark, 0, -1), np.ones((1, 1, 1), dtype=bool)
    numbers, which = np.unique(layer.ids, return_inverse=True)
    which = which.reshape(layer.ids.shape)
    if numbers[0] < 0:
        numbers, which = numbers[1:], which - 1
    bits = np.array([marker_bits(layer.dictionary, int(number), layer.border_bits) for number in numbers])
    return which, bits[:, ::-1, ::-1] if layer.on_head else bits


@cache
def marker_bits(dictionary: str, number: int, border: int) -> Mask:
    """Return the dark bits (side, side) of one marker of a dictionary, border included."""
    markers = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    side = markers.markerSize + 2 * border
    return np.asarray(cv2.aruco.generateImageMarker(markers, number, side, borderBits=border) < 128)
