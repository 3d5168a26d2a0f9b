"""What is to blame for the misfit: one free hypothesis at a time, compared by evidence.

Each hypothesis frees one thing, with a prior; the factor by which that raises the marginal likelihood says
how well it explains the misfit, with the freedom it takes already paid for. Camera and board are freed beside
a robot whose noise is unknown, for otherwise nothing but the robot could absorb the last misfit; the robot is
freed beside a camera that is as good as its calibration says.
"""

from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.solving.auto import CameraPrior, camera_prior
from handeye.solving.estimate import Estimate, side_of_chain
from handeye.solving.joints import JointModel
from handeye.solving.links import LinkModel
from handeye.solving.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Finding, RobotSide
from handeye.types.mounting import Mounting

# Beyond what its calibration claims, as a factor on the camera's deviations: what blame it could bear.
CAMERA_BLAME_INFLATION = 10.0
# Deviation of the board's scale that a printer or a ruler may cause.
BOARD_SCALE_SIGMA = 0.01
# Logarithm of a Bayes factor that counts as decisive (Kass and Raftery 1995: "very strong" is 5).
DECISIVE = 5.0
# Deviation of a lag between clocks.
TIME_LAG_SIGMA_S = 0.1
# Slower than this a lag shows nothing.
SLOWEST_M_S = 1e-3
# A cause is named if it leaves less than this share of the robot noise.
CONVINCING_SHARE = 0.7
# Focal lengths and principal point come first.
_PARAMETERS_IN_PX = 4
# Prior probability of an exact robot: open, certain without a side to err on, excluded with one.
_EXACT_PROBABILITY = {None: 1 / 3, 0: 1.0, 1: 0.0}


@dataclass(frozen=True)
class Suspect:
    """One hypothesis.

    Parameters
    ----------
    code, name
        Stable name, and the words for it.
    log_evidence
        Logarithm of the Bayes factor in its favour.
    finding
        What it found, in words.
    misfit_left
        Share of the robot noise that is still needed once it is free; 1 for the robot itself.
    """

    code: str
    name: str
    log_evidence: float
    finding: str
    misfit_left: float = 1.0


def suspects(measurements: Measurements, estimate: Estimate) -> tuple[Suspect, ...]:
    """Compare the hypotheses, each freed alone; `estimate` is the start, from the same views."""
    found: list[Suspect] = []
    calibrated = camera_prior(measurements.camera)
    exact, _ = _evidence(measurements, estimate, calibrated, sides=[])
    for side in (RobotSide.FLANGE, RobotSide.BASE):
        of_chain = side_of_chain(measurements.mounting, side)
        evidence, posterior = _evidence(measurements, estimate, calibrated, sides=[str(of_chain)])
        _, translation, rotation, _ = posterior.hypotheses[0]
        words = f"its poses are off by about {translation * 1e3:.2g} mm and {np.rad2deg(rotation):.2g} deg"
        found.append(
            Suspect(f"robot_{side.value}", f"the robot ({side.value} side)", evidence - exact, words)
        )
    found += _joints(measurements, estimate, calibrated, exact)
    found += _links(measurements, estimate, calibrated, exact)
    fixed, reference = _evidence(measurements, estimate, CameraPrior((), np.zeros((0, 0))))
    noise = _robot_noise(reference)
    prior = camera_prior(measurements.camera, CAMERA_BLAME_INFLATION)
    if prior.free:
        evidence, posterior = _evidence(measurements, estimate, prior)
        names = measurements.camera.parameter_names
        shifts = ", ".join(
            f"{names[i]} {shift:+.2g} px"
            for i, shift in zip(prior.free, posterior.camera_delta, strict=True)
            if i < _PARAMETERS_IN_PX
        )
        left = _robot_noise(posterior) / noise
        found.append(
            Suspect("camera", "the camera's calibration", evidence - fixed, f"it wants {shifts}", left)
        )
    scale = CameraPrior((), np.array([[BOARD_SCALE_SIGMA**-2]]))
    evidence, posterior = _evidence(measurements, estimate, scale, board_scale=True)
    percent = 100 * posterior.camera_delta[-1]
    size = "larger" if percent > 0 else "smaller"
    words = f"it seems {abs(percent):.2g} % {size} than stated"
    left = _robot_noise(posterior) / noise
    found.append(Suspect("board_scale", "the size of the board", evidence - fixed, words, left))
    lag = time_lag_jacobians(measurements)
    if lag is not None:
        errors = _core.JointErrors(lag, [1.0], [0], offset_rad=TIME_LAG_SIGMA_S)
        nothing = CameraPrior((), np.zeros((0, 0)))
        evidence, posterior = _evidence(measurements, estimate, nothing, joints=errors)
        milliseconds = 1e3 * float(posterior.joint_offsets[0])
        order = "later" if milliseconds > 0 else "earlier"
        words = f"the images seem {abs(milliseconds):.2g} ms {order} than the poses"
        left = _robot_noise(posterior) / noise
        found.append(Suspect("time_lag", "a lag between poses and images", evidence - fixed, words, left))
    return tuple(found)


def _joints(
    measurements: Measurements, estimate: Estimate, calibrated: CameraPrior, exact: float
) -> list[Suspect]:
    """Noise and offsets of the joints of a robot that is exact otherwise; nothing if the arm is not known."""
    if estimate.kinematics is None:
        return []
    arm = JointModel.of(estimate.kinematics, measurements)
    noise = arm.errors(None, 0.0)
    evidence, posterior = _evidence(
        measurements, estimate, calibrated, sides=[], joints=noise, exact_robot=0.0
    )
    level, _ = posterior.joint_levels[0]
    words = f"each is off by about {np.rad2deg(level):.2g} deg, another way at each view"
    found = [Suspect("robot_joint_noise", "noise of the joints", evidence - exact, words)]
    if not arm.free:
        return found
    offsets = arm.errors(0.0, None)
    evidence, posterior = _evidence(measurements, estimate, calibrated, sides=[], joints=offsets)
    worst = max(arm.offsets(posterior.joint_offsets, posterior.covariance), key=lambda o: abs(o.offset))
    value = f"{worst.offset * 1e3:+.2g} mm" if worst.sliding else f"{np.rad2deg(worst.offset):+.2g} deg"
    words = f"{worst.joint} stands {value} beyond where it is read"
    found.append(Suspect("robot_joint_offsets", "a constant error of the joints", evidence - exact, words))
    return found


def _links(
    measurements: Measurements, estimate: Estimate, calibrated: CameraPrior, exact: float
) -> list[Suspect]:
    """Joints displaced on the links of a robot that is exact otherwise; nothing if the arm is not known."""
    if estimate.kinematics is None:
        return []
    links = LinkModel.of(estimate.kinematics, measurements)
    evidence, posterior = _evidence(
        measurements, estimate, calibrated, sides=[], links=links.errors(), exact_robot=0.0
    )
    _, translation, rotation, _ = posterior.hypotheses[0]
    words = f"each sits off by about {translation * 1e3:.2g} mm and {np.rad2deg(rotation):.2g} deg"
    return [Suspect("robot_links", "where the joints sit on their links", evidence - exact, words)]


def time_lag_jacobians(measurements: Measurements) -> FloatArray | None:
    """(K, 6, 1) derivative of the motions, on the left, in a time by which images are later than poses.

    Velocities are differences between neighbouring views; None without timestamps on all views, or where the
    robot hardly moves between them.
    """
    times = np.array([np.nan if v.timestamp_s is None else v.timestamp_s for v in measurements.views])
    if np.isnan(times).any() or np.any(np.diff(times) <= 0):
        return None
    poses = np.array([view.T_base_flange.matrix for view in measurements.views])
    before, after = poses[:-2], poses[2:]
    twists = _core.se3_log(np.linalg.inv(before) @ after) / (times[2:] - times[:-2])[:, None]
    velocities = np.concatenate([twists[:1], twists, twists[-1:]])
    if np.median(np.linalg.norm(velocities[:, :3], axis=1)) < SLOWEST_M_S:
        return None
    if measurements.mounting is Mounting.EYE_IN_HAND:
        return -velocities[:, :, None]
    return _core.se3_adjoint(poses) @ velocities[:, :, None]


def blame(measurements: Measurements, estimate: Estimate) -> Finding:
    """Say in one line what explains the misfit of these views best.

    Something that can be put right (camera, board) is named if the evidence for it is decisive and it takes
    away a good part of the noise that the robot would be blamed for; else the robot, if it is needed at all.
    """
    ranked = suspects(measurements, estimate)
    evidence = {suspect.code: suspect.log_evidence for suspect in ranked}
    robots = [s for s in ranked if s.code.startswith("robot_")]
    causes = [
        s
        for s in ranked
        if s not in robots and s.log_evidence > DECISIVE and s.misfit_left < CONVINCING_SHARE
    ]
    if causes:
        best = min(causes, key=lambda s: s.misfit_left)
        taken = 100 * (1 - best.misfit_left)
        return Finding(
            f"blame_{best.code}",
            f"{best.name} explains the misfit best: {best.finding}, which takes away {taken:.0f} % of what "
            "the robot would be blamed for",
            evidence,
        )
    best, second = sorted(robots, key=lambda s: -s.log_evidence)[:2]
    if best.log_evidence < DECISIVE:
        return Finding("blame_nothing", "pixel noise alone explains these views", evidence)
    unsure = best.log_evidence - second.log_evidence < DECISIVE
    doubt = f", though {second.name} explains it nearly as well" if unsure else ""
    return Finding(
        f"blame_{best.code}", f"{best.name} explains the misfit best: {best.finding}{doubt}", evidence
    )


def _robot_noise(posterior: _core.Posterior) -> float:
    """Root mean square translation noise of the robot over the hypotheses, metres; never quite zero."""
    return float(np.sqrt(sum(p * t**2 for _, t, _, p in posterior.hypotheses))) + 1e-7


def _evidence(
    measurements: Measurements,
    estimate: Estimate,
    prior: CameraPrior,
    *,
    sides: list[str] | None = None,
    board_scale: bool = False,
    joints: _core.JointErrors | None = None,
    links: _core.LinkErrors | None = None,
    exact_robot: float | None = None,
) -> tuple[float, _core.Posterior]:
    """Return the logarithm of the evidence of one hypothesis, and its posterior.

    `sides`: where the robot may err; None for anywhere or nowhere, empty for nowhere. `exact_robot`: prior
    probability that it is exact, if not what follows from this.
    """
    free = prior.information.size > 0
    compressed = _core.Compressed(
        measurements.problem,
        measurements.camera_poses,
        free_camera=list(prior.free) or None,
        board_scale=board_scale,
    )
    posterior = compressed.estimate(
        camera_prior=prior.information if free else None,
        start=(estimate.X.matrix, estimate.Y.matrix),
        exact_probability=_EXACT_PROBABILITY[None if sides is None else len(sides)]
        if exact_robot is None
        else exact_robot,
        sides=sides,
        joints=joints,
        links=links,
        linearisations=10,
    )
    # The prior's own normalisation, which the sum over hypotheses leaves out.
    return posterior.log_evidence + 0.5 * _log_determinant(prior.information), posterior


def _log_determinant(information: FloatArray) -> float:
    if information.size == 0:
        return 0.0
    scale = np.sqrt(np.diag(information))
    return float(np.linalg.slogdet(information / np.outer(scale, scale))[1] + 2 * np.sum(np.log(scale)))
