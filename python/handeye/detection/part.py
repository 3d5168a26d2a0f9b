"""A reduced picture in which a target is searched, and where that is in the image in which it is measured."""

from dataclasses import dataclass

import cv2
import numpy as np

from handeye.detection.base import Image
from handeye.types.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Part:
    """An image of another size.

    Attributes
    ----------
    picture
        (H, W) what to search.
    to_image
        (3, 3) homography from its pixels to those of the image.
    """

    picture: Image
    to_image: FloatArray

    @classmethod
    def whole(cls, image: Image, scale: float = 1.0) -> "Part":
        """Return all of an image, reduced by a factor."""
        small, factors = reduced(image, scale)
        shift = 0.5 * factors - 0.5
        return cls(small, np.array([[factors[0], 0, shift[0]], [0, factors[1], shift[1]], [0, 0, 1]]))

    @classmethod
    def halved(cls, image: Image, side_px: float) -> "Part":
        """Return all of an image, at half the size until its longer side has at most so many pixels."""
        halvings = max(0, int(np.ceil(np.log2(max(image.shape) / side_px))))
        return cls.whole(image, 0.5**halvings)

    def places(self, pixels: FloatArray) -> FloatArray:
        """Return places (..., 2) of the picture in pixels of the image."""
        return mapped(self.to_image, pixels)

    def shapes(self, centres: FloatArray, shapes: FloatArray) -> FloatArray:
        """Return shapes (N, 2, 2) of spots at centres (N, 2) of the picture as they are in the image."""
        J = jacobians(self.to_image, centres)
        return J @ shapes @ J.swapaxes(1, 2)


def mapped(homography: FloatArray, places: FloatArray) -> FloatArray:
    """Return where a homography brings places (..., 2)."""
    flat = places.reshape(-1, 2)
    image = np.column_stack([flat, np.ones(len(flat))]) @ homography.T
    return (image[:, :2] / image[:, 2:]).reshape(places.shape)


def jacobians(homography: FloatArray, places: FloatArray) -> FloatArray:
    """Return the derivatives (N, 2, 2) of `mapped` at places (N, 2)."""
    depth = places @ homography[2, :2] + homography[2, 2]
    image = mapped(homography, places)
    return (homography[:2, :2] - image[:, :, np.newaxis] * homography[2, :2]) / depth[:, None, None]


def reduced(image: Image, scale: float) -> tuple[Image, FloatArray]:
    """Return a smaller image, and the factors (2,) from its size to that of the image."""
    if scale >= 1:
        return image, np.ones(2)
    size = np.maximum(np.rint(np.array(image.shape[::-1]) * scale), 1).astype(int)
    small = cv2.resize(image, size.tolist(), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8), np.array(image.shape[::-1]) / size
