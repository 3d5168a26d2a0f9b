"""Corners fitted to grey values: how well their own pictures tell where they are."""

import cv2
import numpy as np
import pytest

from handeye.detection.corner_fit import CornerFits, CornerKind, corner_fits

SIDE, PLACE, ANGLES = 81, np.array([40.3, 39.8]), (0.1, 0.1 + np.pi / 2)


def drawn(kind: CornerKind, gamma: float = 1.0) -> np.ndarray:
    """A corner of square edges, blurred by 0.7 px, as a camera with a gamma gives it."""
    fine = (np.arange(8 * SIDE) + 0.5) / 8 - 0.5
    x, y = np.meshgrid(fine - PLACE[0], fine - PLACE[1])
    first, second = (np.cos(a) * y - np.sin(a) * x > 0 for a in ANGLES)
    dark = first == second if kind is CornerKind.CROSSING else first & second
    grey = np.where(dark, 30.0, 220.0).reshape(SIDE, 8, SIDE, 8).mean(axis=(1, 3))
    return 255 * (cv2.GaussianBlur(grey, (0, 0), 0.7) / 255) ** gamma


def fitted(grey: np.ndarray, kind: CornerKind, radius: float) -> CornerFits:
    directions = np.array([[[np.cos(a), np.sin(a)] for a in ANGLES]])
    image = np.rint(grey.clip(0, 255)).astype(np.uint8)
    return corner_fits(image, PLACE[np.newaxis], directions, np.array([radius]), kind)


@pytest.mark.parametrize("radius", [8.0, 14.0, 24.0])
@pytest.mark.parametrize("kind", list(CornerKind))
def test_noise_moves_a_corner_as_far_as_its_picture_tells(kind: CornerKind, radius: float) -> None:
    random, grey = np.random.default_rng(3), drawn(kind)
    fits = [fitted(grey + random.normal(scale=6.0, size=grey.shape), kind, radius) for _ in range(600)]
    variance = float(np.var([f.places[0] for f in fits], axis=0).mean())
    # What the pixels' grid makes of edges along it counts as noise, too.
    assert 0.75 < variance / np.mean([f.sigmas_px**2 for f in fits]) < 1.0


@pytest.mark.parametrize("gamma", [0.45, 2.2])
def test_gamma_is_no_noise_of_a_crossing(gamma: float) -> None:
    grey = drawn(CornerKind.CROSSING, gamma)
    noise = np.random.default_rng(3).normal(scale=2.0, size=grey.shape)
    fits = fitted(grey + noise, CornerKind.CROSSING, 20.0)
    # Smoothing leaves 0.56 of the noise.
    assert fits.misfits > 2.5
    assert fits.noises < 1.1
    assert np.linalg.norm(fits.places - PLACE) < 0.01
