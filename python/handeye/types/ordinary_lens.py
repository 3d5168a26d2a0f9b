"""What lenses are like that nobody has measured yet: a wide belief about their parameters."""

import numpy as np

from handeye.types.arrays import FloatArray
from handeye.types.camera import LENSES

# Standard deviations of the coefficients around zero, by lens.
DISTORTION_SIGMAS = {
    "brown_conrady_5": (0.1, 0.1, 0.002, 0.002, 0.1),
    "kannala_brandt": (0.1, 0.1, 0.1, 0.1),
}
# Of the focal lengths, relative; of the principal point, as a share of the image's width around its middle.
FOCAL_SIGMA = 0.5
CENTRE_SIGMA = 0.03


def ordinary_lens(lens: str, size_px: tuple[int, int], focal_px: float) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation (n,) of the parameters of a lens that nobody has measured.

    Parameters
    ----------
    lens
        One of `DISTORTION_SIGMAS`.
    size_px
        Width and height of the image.
    focal_px
        A focal length to be centred at; it may be off by half.
    """
    width, height = size_px
    mean = [focal_px, focal_px, (width - 1) / 2, (height - 1) / 2]
    sigmas = [FOCAL_SIGMA * focal_px] * 2 + [CENTRE_SIGMA * width] * 2
    coefficients = len(LENSES[lens]) - len(mean)
    return np.array([*mean, *np.zeros(coefficients)]), np.array([*sigmas, *DISTORTION_SIGMAS[lens]])
