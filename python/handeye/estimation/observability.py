"""What the views leave open, in words: null directions of the information, named in the user's frames.

The information of X and Y without any prior belief is ``sum_k B_k' (sigma_k^2 M_k^-1 + S_k)^-1 B_k`` with
``B_k = [I, Ad(X A_k)]``: what the images say of the chain, seen through the robot's noise. A direction that
it knows worse than `UNDETERMINED` is not determined; a metre and a radian weigh alike there.
"""

import numpy as np

from handeye import _core
from handeye.estimation.estimate import isotropic_root, side_of_chain
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Noise, Unobservable
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose

# Standard deviation, in metres and radians alike, beyond which a direction counts as not determined.
UNDETERMINED = 0.1
# Share of rotation below which a null direction is a pure translation.
PURE_TRANSLATION = 0.05
# With so many rotations open the views are alike: one motion of any size leaves one open at most.
ALIKE_ROTATIONS = 2
# A direction is called by a coordinate axis within this angle.
AXIS_NAME_RAD = np.deg2rad(8)

_AXES = "xyz"


def chain_information(measurements: Measurements, X: Pose, noise: Noise, forward: FloatArray) -> FloatArray:
    """Return the information (12, 12) of the twists of X and Y from the views alone, without any prior.

    `forward` (K, 4, 4) is `X A_k` of each view.
    """
    side = side_of_chain(measurements.mounting, noise.robot_side)
    root = isotropic_root(noise.robot_translation_m, noise.robot_rotation_rad)
    return _core.chain_information(
        X.matrix,
        forward,
        measurements.pose_information,
        noise.pixel_sigma_px,
        left=root if side == "left" else None,
        right=root if side == "right" else None,
    )


def null_directions(measurements: Measurements, X: Pose, Y: Pose, noise: Noise) -> FloatArray:
    """(D, 12) unit directions of the twists of X and Y that the views leave open; rotations first.

    Noise makes motions look as if they spread where they do not. That of the robot and that of the images are
    independent, so the motions are taken once from the robot and once from the images, and what either leaves
    open is open.
    """
    null = np.zeros((12, 0))
    for forward in (X.matrix @ measurements.motions, measurements.camera_poses @ Y.inverse().matrix):
        values, vectors = np.linalg.eigh(chain_information(measurements, X, noise, forward))
        open_here = vectors[:, values < UNDETERMINED**-2]
        if open_here.shape[1] > null.shape[1]:
            null = open_here
    return plain_basis(null)


def plain_basis(null: FloatArray) -> FloatArray:
    """(D, 12) basis of a space (12, D) in which as few directions as possible rotate, these first.

    Pure translations are easier to name.
    """
    if null.shape[1] == 0:
        return np.zeros((0, 12))
    _, strengths, turns = np.linalg.svd(null[3:6])
    basis = (null @ turns.T).T
    rotating = np.zeros(len(basis), dtype=bool)
    rotating[: len(strengths)] = strengths > PURE_TRANSLATION
    return basis[np.argsort(~rotating, kind="stable")]


def undetermined(measurements: Measurements, X: Pose, Y: Pose, noise: Noise) -> tuple[Unobservable, ...]:
    """Name what the views leave open of X and Y, with the motion that would cure it; empty if nothing."""
    return named(measurements, X, null_directions(measurements, X, Y, noise))


def named(measurements: Measurements, X: Pose, directions: FloatArray) -> tuple[Unobservable, ...]:
    """Name directions (D, 12) of X and Y that are open, with the motion that would cure it."""
    if len(directions) == 0:
        return ()
    rotating = np.linalg.norm(directions[:, 3:6], axis=1) > PURE_TRANSLATION
    shifts = int(np.sum(~rotating))
    cure = _cure(measurements, int(np.sum(rotating)), shifts)
    if np.sum(rotating) >= ALIKE_ROTATIONS:
        return tuple(
            Unobservable("position and rotation of the camera are not determined at all", cure, _unit(d))
            for d in directions
        )
    if shifts == 3:
        camera = _frames(measurements.mounting)[0]
        sentence = f"the position of the camera in the {camera} frame is not determined in any direction"
        shifted = [Unobservable(sentence, cure, _unit(d)) for d in directions[~rotating]]
    else:
        shifted = [_translation(measurements, X, d, cure) for d in directions[~rotating]]
    return tuple([_rotation(measurements, X, d, cure) for d in directions[rotating]] + shifted)


def _frames(mounting: Mounting) -> tuple[str, str]:
    """Name the frame that the camera is fixed in, and the frame that the target is fixed in."""
    return ("flange", "base") if mounting is Mounting.EYE_IN_HAND else ("base", "flange")


def _unit(direction: FloatArray) -> tuple[float, ...]:
    return tuple(float(value) for value in direction / np.linalg.norm(direction))


def _axis_name(axis: FloatArray, frame: str) -> str:
    """Name an axis of a frame, its sign left open."""
    axis = axis / np.linalg.norm(axis)
    largest = int(np.argmax(np.abs(axis)))
    if np.abs(axis[largest]) > np.cos(AXIS_NAME_RAD):
        return f"the {_AXES[largest]} axis of the {frame}"
    axis = axis * np.sign(axis[largest])
    return f"the direction ({axis[0]:.2f}, {axis[1]:.2f}, {axis[2]:.2f}) of the {frame}"


def _translation(measurements: Measurements, X: Pose, direction: FloatArray, cure: str) -> Unobservable:
    camera, target = _frames(measurements.mounting)
    own = _axis_name(X.rotation.T @ direction[:3], camera)
    other = _axis_name(direction[6:9], target)
    return Unobservable(
        f"the position of the camera along {own} is not determined: it trades with the position of the "
        f"target along {other}",
        cure,
        _unit(direction),
    )


def _rotation(measurements: Measurements, X: Pose, direction: FloatArray, cure: str) -> Unobservable:
    camera, _ = _frames(measurements.mounting)
    axis = _axis_name(X.rotation.T @ direction[3:6], camera)
    return Unobservable(f"the rotation of the camera about {axis} is not determined", cure, _unit(direction))


def _cure(measurements: Measurements, rotations: int, shifts: int) -> str:
    moving = "flange" if measurements.mounting is Mounting.EYE_IN_HAND else "target"
    if rotations == 0 and shifts == 3:
        return (
            f"the views differ by translation only: add views with the {moving} turned by 20 degrees or more "
            "about two different axes"
        )
    if rotations >= ALIKE_ROTATIONS:
        return f"the views are all alike: move the robot and turn the {moving} about two axes between views"
    axis = _common_axis(measurements)
    return (
        f"all rotations share {axis}: add views turned by 20 degrees or more about an axis across it; an arm "
        "that cannot turn that way (four axes) cannot tell it: measure how high the target is, and state it"
    )


def _common_axis(measurements: Measurements) -> str:
    """Name the axis about which the robot turned, in the base: the dominant one of all relative rotations."""
    rotations = np.array([view.T_base_flange.rotation for view in measurements.views])
    first, second = np.triu_indices(len(rotations), 1)
    relative = np.zeros((len(first), 4, 4))
    relative[:, :3, :3] = rotations[second] @ rotations[first].transpose(0, 2, 1)
    relative[:, 3, 3] = 1
    turns = _core.se3_log(relative)[:, 3:]
    axis = np.linalg.svd(turns)[2][0]
    return _axis_name(axis, "base")
