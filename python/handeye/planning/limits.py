"""What limits the accuracy now: how much of the uncertainty of the answer each source leaves."""

from dataclasses import replace

import numpy as np

from handeye.errors import DegenerateError
from handeye.estimation.estimate import Estimate, StationNoise
from handeye.estimation.measurements import Measurements
from handeye.planning.prediction import Prediction, Sight
from handeye.types.arrays import FloatArray

# A share below this is not worth a line.
NOTHING = 0.005
_POSES = 12


def limits(estimate: Estimate, measurements: Measurements) -> dict[str, float]:
    """Return the share that each source has in the variance of X; they sum up to one.

    Sources are taken as known one after the other, and what the variance loses is the share of each: what
    comes again in like postures (`robot_smooth`), how the arm is built (`arm`), the calibration of the camera
    (`camera`), the size of the board (`board`). What is left is noise of every view, divided between pictures
    and robot (`pixels`, `robot`) by what the pictures would leave with an exact robot. Position and rotation
    weigh alike. Empty where the views leave something open.

    Parameters
    ----------
    estimate
        What is believed.
    measurements
        The views that it is believed from.

    Raises
    ------
    DegenerateError
        The information is singular.
    """
    if not estimate.determined or not len(measurements):
        return {}
    information, whole = estimate.information, estimate.hand_eye_covariance
    camera = _POSES + len(estimate.free_camera)
    board = camera + (estimate.board_scale is not None)
    count, blocks = (
        len(information),
        {
            "arm": range(board, len(information)),
            "camera": range(_POSES, camera),
            "board": range(camera, board),
        },
    )
    try:
        left = _of_x(information, range(count))
        shares = {"robot_smooth": 1.0 - _size(left, whole)} if estimate.arm is None else {}
        # What is not known of the noise widens all of it alike.
        scale = 1.0 - max(shares.get("robot_smooth", 0.0), 0.0)
        before, known = 1.0, set[int]()
        for name, block in blocks.items():
            known |= set(block)
            after = _size(_of_x(information, [i for i in range(count) if i not in known]), left)
            shares[name], before = scale * (before - after), after
        pixels = _of_pixels(estimate, measurements)
    except np.linalg.LinAlgError as error:
        raise DegenerateError("the information of the views is singular") from error
    shares |= {"pixels": scale * before * pixels, "robot": scale * before * (1.0 - pixels)}
    total = sum(max(share, 0.0) for share in shares.values())
    found = {name: max(share, 0.0) / total for name, share in shares.items()}
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _of_pixels(estimate: Estimate, measurements: Measurements) -> float:
    """Return the part of the noise of the views that an exact robot would leave."""
    joints = None if estimate.arm is None else measurements.joints
    left: list[FloatArray] = []
    for one in (estimate, replace(estimate, station_noise=StationNoise())):
        taught = Prediction(one, Sight(known=True)).informations(measurements.motions, joints).sum(axis=0)
        left.append(_of_x(taught, range(_POSES)))
    both, pixels = left
    return min(_size(pixels, both), 1.0)


def _of_x(information: FloatArray, kept: "range | list[int]") -> FloatArray:
    """(6, 6) covariance of X, with every parameter known that is not kept."""
    rows = np.array(kept)
    part = information[np.ix_(rows, rows)]
    scale = 1 / np.sqrt(np.diag(part))
    inverse: FloatArray = np.linalg.inv(part * np.outer(scale, scale)) * np.outer(scale, scale)
    return inverse[:6, :6]


def _size(covariance: FloatArray, whole: FloatArray) -> float:
    """Return how much of a covariance another one is, position and rotation weighing alike."""
    blocks = (slice(0, 3), slice(3, 6))
    return float(np.mean([np.trace(covariance[b, b]) / np.trace(whole[b, b]) for b in blocks]))
