"""What explains the misfit, read off the one fit: noise levels, and the component that is to blame.

Nothing is estimated again. How much each component moves the measurements, in standard deviations of the
pixels, and by how much the likelihood falls without it come with the posterior.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.estimation.arm import ArmModel
from handeye.estimation.camera_prior import CameraPrior
from handeye.estimation.estimate import StationNoise
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Finding, Noise, RobotSide

# Logarithm of a factor in likelihood that counts as decisive (Kass and Raftery 1995: "very strong" is 5).
DECISIVE = 5.0
# Something that can be put right (camera, board, clocks) is worth a word at this share of the misfit, or of
# what the likelihood would lose with an exact robot.
CONVINCING_SHARE, NEEDED_SHARE = 0.3, 0.1
# Focal lengths and principal point come first.
_PARAMETERS_IN_PX = 4
_SIDES = {
    "robot_flange": RobotSide.FLANGE,
    "robot_base": RobotSide.BASE,
    "posture_flange": RobotSide.FLANGE,
    "posture_base": RobotSide.BASE,
    "joint_noise": RobotSide.JOINTS,
    "backlash": RobotSide.JOINTS,
    "joint_offsets": RobotSide.JOINTS,
    "links": RobotSide.LINKS,
}
_POSTURE = ("posture_flange", "posture_base")
HOW = "restricted likelihood of all components at once, averaged over their levels"


@dataclass(frozen=True, eq=False)
class Levels:
    """Levels of the components at their mode, by name."""

    values: dict[str, float]

    @classmethod
    def of(cls, posterior: _core.Posterior) -> "Levels":
        """Read the levels at the mode."""
        return cls(dict(zip(posterior.level_names, posterior.mode, strict=True)))

    @classmethod
    def expected_noise(cls, posterior: _core.Posterior) -> StationNoise:
        """What is new at every station, root mean square over what the levels may be."""
        nodes = _new(dict(zip(posterior.level_names, np.transpose(posterior.levels), strict=True)))
        weights = np.array(posterior.weights)
        return _station_noise([float(np.sqrt(np.sum(weights * np.square(levels)))) for levels in nodes])

    def station_noise(self) -> StationNoise:
        """What is new at every station; smooth errors of the posture count as new at another one."""
        return _station_noise([float(level) for level in _new(self.values)])


# A level, or one for each set of levels.
_Level = float | FloatArray


def _twist(levels: Mapping[str, _Level], name: str) -> tuple[_Level, _Level]:
    """Translation (metres) and rotation (radians) of a component that is a twist."""
    rotation = levels.get(f"{name}_rad", 0.0)
    return rotation * levels.get(f"{name}_lever_m", 1.0), rotation


def _new(levels: Mapping[str, _Level]) -> list[_Level]:
    """Translation and rotation at the flange, the same at the base, and the joints, as new at a station."""
    twists = [(_twist(levels, side), _twist(levels, f"posture_{side}")) for side in ("flange", "base")]
    both = [np.hypot(white[i], smooth[i]) for white, smooth in twists for i in (0, 1)]
    return [*both, levels.get("joint_rad", 0.0)]


def _station_noise(deviations: list[float]) -> StationNoise:
    flange_m, flange_rad, base_m, base_rad, joint_rad = deviations
    return StationNoise((flange_m, flange_rad), (base_m, base_rad), joint_rad)


def noise_of(
    posterior: _core.Posterior,
    measurements: Measurements,
    arm: ArmModel | None,
    pixel_sigma_px: FloatArray,
) -> Noise:
    """Sum up the noise: one error of the robot, at the flange, and what share each part has in it."""
    levels = Levels.of(posterior)
    translation, rotation = _at_flange(levels.station_noise(), measurements, arm)
    pixels = tuple(float(sigma) for sigma in pixel_sigma_px)
    shares = {side.value: 0.0 for side in RobotSide}
    if arm is None:
        shares = {name: 0.0 for name in shares if name not in {RobotSide.JOINTS, RobotSide.LINKS}}
    of_robot = {name: misfit for name, _, misfit in posterior.attribution if name in _SIDES}
    total = sum(of_robot.values())
    side = RobotSide.NONE
    if posterior.robot_loss < DECISIVE or total <= 0:
        shares[RobotSide.NONE.value] = 1.0
    else:
        for name, misfit in of_robot.items():
            shares[_SIDES[name].value] += misfit / total
        side = RobotSide(max(shares, key=lambda name: shares[name]))
    smooth = sum(of_robot.get(name, 0.0) for name in _POSTURE) / total if total > 0 else 0.0
    return Noise(
        pixels,
        side,
        translation,
        rotation,
        how=HOW,
        evidence=shares,
        joint_rad=levels.values.get("joint_rad", 0.0),
        smooth_probability=smooth,
    )


def _at_flange(noise: StationNoise, measurements: Measurements, arm: ArmModel | None) -> tuple[float, float]:
    """Deviation per axis of the flange's translation (metres) and rotation (radians), root mean square."""
    positions = measurements.flange_poses[:, :3, 3]
    reach = float((positions**2).sum(axis=1).mean())
    # |w x p|^2 of a turn w of the base is on average two thirds of |w|^2 |p|^2.
    translation = noise.flange[0] ** 2 + noise.base[0] ** 2 + 2 / 3 * noise.base[1] ** 2 * reach
    rotation = noise.flange[1] ** 2 + noise.base[1] ** 2
    if arm is not None:
        by_joint = arm.at_flange(measurements.joints)[0] * arm.scales * noise.joint_rad
        squares = np.mean(np.sum(np.square(by_joint), axis=2), axis=0)
        translation += float(squares[:3].mean())
        rotation += float(squares[3:].mean())
    return float(np.sqrt(translation)), float(np.sqrt(rotation))


def attribution(
    posterior: _core.Posterior,
    prior: CameraPrior,
    arm: ArmModel | None,
    noise: Noise,
    *,
    camera_shift: FloatArray,
    camera_name: str,
    board_scale: float,
) -> Finding:
    """Say in one line what explains the misfit of these views best.

    Something that can be put right (camera, board, clocks) is named if the likelihood needs it and it moves
    the measurements much; else the part of the robot that moves them most, if the robot is needed at all.

    Parameters
    ----------
    posterior, arm, noise
        What was found.
    prior, camera_shift, camera_name
        The camera that is off most, by how much in its free parameters, and its name where there are others.
    board_scale
        Of the board that is off most.
    """
    evidence = {name: loss for name, loss, _ in posterior.attribution}
    misfit = {name: value for name, _, value in posterior.attribution}
    total = sum(misfit.values()) or 1.0
    theta = np.asarray(posterior.theta)
    robot = {name: value for name, value in misfit.items() if name in _SIDES}
    of_robot = max((evidence[name] for name in robot), default=0.0)
    causes = [  # explains much of the misfit, or much of what the robot would be blamed for
        name
        for name in ("camera", "board_scale", "time_lag")
        if evidence.get(name, 0.0) > DECISIVE
        and (
            misfit[name] > CONVINCING_SHARE * total
            or evidence[name] > NEEDED_SHARE * posterior.robot_loss
            # No error of an arm goes with its speed.
            or (name == "time_lag" and evidence[name] > of_robot)
        )
    ]
    if causes:
        cause = max(causes, key=lambda name: evidence[name])
        words = {
            "camera": lambda: _camera_words(camera_shift, prior, camera_name),
            "board_scale": lambda: _board_words(board_scale),
            "time_lag": lambda: _lag_words(theta, posterior),
        }[cause]()
        share = 100 * misfit[cause] / total
        return Finding(
            f"blame_{cause}", f"{words}, which explains {share:.0f} % of what the pictures are off", evidence
        )
    if noise.robot_side is RobotSide.NONE or not robot:
        return Finding("blame_nothing", "pixel noise alone explains these views", evidence)
    worst = max(robot, key=lambda name: robot[name])
    code, words = _robot_words(worst, posterior, arm, noise)
    return Finding(f"blame_{code}", words, evidence)


def _robot_words(
    name: str, posterior: _core.Posterior, arm: ArmModel | None, noise: Noise
) -> tuple[str, str]:
    """Return the code of a component of the robot's error, and what it found in words."""
    levels = Levels.of(posterior).values
    if name == "joint_noise":
        degrees = np.rad2deg(levels["joint_rad"])
        words = f"noise of the joints explains the misfit best: each is off by about {degrees:.2g} deg"
        return "robot_joint_noise", f"{words}, another way at each view"
    if name == "backlash":
        degrees = np.rad2deg(levels["play_rad"])
        words = f"play of the joints explains the misfit best: about {degrees:.2g} deg"
        return "robot_play", f"{words}, by the side that each came from"
    if name == "joint_offsets":
        return "robot_joint_offsets", _offset_words(posterior, arm)
    if name == "links":
        millimetres, degrees = levels["link_m"] * 1e3, np.rad2deg(levels["link_rad"])
        words = "where the joints sit on their links explains the misfit best: each is off by about"
        return "robot_links", f"{words} {millimetres:.2g} mm and {degrees:.2g} deg"
    side = _SIDES[name].value
    alike = ", alike in like postures" if name in _POSTURE else ", another way at each view"
    words = (
        f"the robot ({side} side) explains the misfit best: its poses are off by about "
        f"{noise.robot_translation_m * 1e3:.2g} mm and {np.rad2deg(noise.robot_rotation_rad):.2g} deg per "
        f"axis{alike}"
    )
    return f"robot_{side}", words


def _camera_words(shift: FloatArray, prior: CameraPrior, name: str) -> str:
    names = prior.camera.parameter_names
    shifts = ", ".join(
        f"{names[i]} {value:+.2g} px"
        for i, value in zip(prior.free, shift, strict=True)
        if i < _PARAMETERS_IN_PX
    )
    whose = f"the calibration of camera {name}" if name else "the camera's calibration"
    return f"{whose} explains the misfit best: it wants {shifts}"


def _board_words(scale: float) -> str:
    size = "larger" if scale > 0 else "smaller"
    words = f"it seems {abs(100 * scale):.2g} % {size} than stated"
    return f"the size of the board explains the misfit best: {words}"


def _lag_words(theta: FloatArray, posterior: _core.Posterior) -> str:
    first = next(first for name, first, _ in posterior.constants if name == "time_lag")
    milliseconds = 1e3 * float(theta[first])
    order = "later" if milliseconds > 0 else "earlier"
    return (
        "a lag between poses and images explains the misfit best: the images seem "
        f"{abs(milliseconds):.2g} ms {order} than the poses"
    )


def _offset_words(posterior: _core.Posterior, arm: ArmModel | None) -> str:
    if arm is None:
        raise AssertionError  # offsets are a component only where the arm is known
    constants, covariance = arm_constants(posterior)
    worst = max(arm.offsets(constants, covariance), key=lambda o: abs(o.offset))
    value = f"{worst.offset * 1e3:+.2g} mm" if worst.sliding else f"{np.rad2deg(worst.offset):+.2g} deg"
    return (
        "a constant error of the joints explains the misfit best: "
        f"{worst.joint} stands {value} beyond where it is read"
    )


def arm_constants(posterior: _core.Posterior) -> tuple[FloatArray, FloatArray]:
    """Constants of the arm (k,) and their covariance (k, k)."""
    rows = [
        i
        for name, first, end in posterior.constants
        if name in {"joint_offsets", "links"}
        for i in range(first, end)
    ]
    return np.asarray(posterior.theta)[rows], np.asarray(posterior.covariance)[np.ix_(rows, rows)]
