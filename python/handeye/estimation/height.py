"""A height that somebody measured, for arms that turn about one axis only.

Of such an arm no view tells how high camera and target are: moved along that axis by the same, camera in its
frame and target in its own, they look the same in every picture. A height of the target's middle, measured
with a ruler, is one more row of the linear model at its mean,

    z = (T_fixed_target p)_z + [0 0 1 | p_y -p_x 0] xi_y + noise

with p the middle of the target in the frame that it is fixed to, and what it moves is what the Kalman update
of a Gaussian moves. The weak prior that stood in for the open direction hardly counts beside it.
"""

from dataclasses import dataclass, replace

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.estimate import Estimate
from handeye.estimation.observability import UNDETERMINED
from handeye.types.pose import Pose

_OF_Y = slice(6, 12)


@dataclass(frozen=True)
class Height:
    """Where the middle of the target is along z of the frame that it is fixed to.

    That is the base with the camera in the hand, and the flange with the camera beside the robot.

    Parameters
    ----------
    at_m
        The height, metres.
    sigma_m
        How well it is known: its standard deviation.

    Raises
    ------
    InputError
        A height that is no number, or one that is known exactly or hardly at all.

    Examples
    --------
    >>> Height(0.05, 0.001).sigma_m
    0.001
    """

    at_m: float
    sigma_m: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.at_m) and 0 < self.sigma_m < UNDETERMINED):
            raise InputError(
                f"height {1e3 * self.at_m} mm known to {1e3 * self.sigma_m} mm, expected a number, known to "
                f"above 0 and below {1e3 * UNDETERMINED:g} mm",
                code=Code.OUT_OF_RANGE,
            )


def with_height(estimate: Estimate, height: Height) -> Estimate:
    """Return an estimate that also knows a height.

    Parameters
    ----------
    estimate
        By the default model.
    height
        As measured.

    Returns
    -------
    Estimate
        What the height does not tell either stays among the open directions.

    Examples
    --------
    >>> with_height(estimate, Height(0.05, 0.001)).determined
    True
    """
    middle = estimate.Y.act(estimate.target.points.mean(axis=0)[np.newaxis])[0]
    row = np.zeros(len(estimate.covariance))
    row[_OF_Y] = [0.0, 0.0, 1.0, middle[1], -middle[0], 0.0]
    along = estimate.covariance @ row
    gain = along / (float(row @ along) + height.sigma_m**2)
    shift = gain * (height.at_m - float(middle[2]))
    covariance = estimate.covariance - np.outer(gain, along)
    poses = covariance[:12, :12]
    still_open = [
        one
        for one in estimate.unobservable
        if np.array(one.direction) @ poses @ np.array(one.direction) > UNDETERMINED**2
    ]
    return replace(
        estimate,
        X=Pose.exp(shift[:6]) @ estimate.X,
        Y=Pose.exp(shift[_OF_Y]) @ estimate.Y,
        covariance=0.5 * (covariance + covariance.T),
        information=estimate.information + np.outer(row, row) / height.sigma_m**2,
        unobservable=tuple(still_open),
    )
