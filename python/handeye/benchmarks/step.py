"""A whole planning step on one core: from the views that are there to the view to take next.

A simulated arm has taken eight views of 8 x 11 corners. The last view's pose, the estimate with its noise
levels and covariance, 10,000 candidates from joint positions, what each would tell where it shows the board,
and how far three of the best hundred are from what no choice of three can beat.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye import _core
from handeye.benchmarks.options import Options
from handeye.benchmarks.timing import interleave
from handeye.compute.parallel import Progress
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.planning.prediction import Prediction, Sight
from handeye.robots import ArmKinematics
from handeye.simulation.cells import CellOptions, ErrorKind, simulate, simulated_arm
from handeye.types import Camera, Recording, View
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from handeye.types.pose import inverses

VIEWS = 8
CANDIDATES = 10_000
# Candidates are drawn around the postures of the views.
SPREAD_RAD = 0.15
CERTIFIED_OF = 100
CERTIFIED = 3
# Model, lens, and whether the arm is described.
CASES = {
    "exact_robot": (ModelName.PAPER, "pinhole", False),
    "noise_aware": (ModelName.AUTO, "pinhole", False),
    "noise_aware_distortion": (ModelName.AUTO, "brown_conrady_5", False),
    "arm_described_distortion": (ModelName.AUTO, "brown_conrady_5", True),
}


@dataclass(frozen=True, eq=False)
class _Step:
    """What a step begins with, and what each of its stages needs of the one before."""

    measurements: Measurements
    before: Estimate
    estimate: Estimate
    joints: FloatArray
    motions: FloatArray
    gains: FloatArray


def bench_step(options: Options, progress: Progress) -> dict[str, Any]:
    """Return the times of the stages of a step and their sum, for each model."""
    cases: dict[str, Any] = {}
    for done, (name, (model, lens, described)) in enumerate(CASES.items()):
        progress(done, len(CASES))
        count = 200 if options.quick else CANDIDATES
        cases[name] = {"model": model.value, "lens": lens, "views": VIEWS, "candidates": count} | _case(
            model, lens, described, count, options
        )
    progress(len(CASES), len(CASES))
    return {"cases": cases}


def _case(model: ModelName, lens: str, described: bool, count: int, options: Options) -> dict[str, Any]:
    recording = simulate(ErrorKind.WHITE_FLANGE, 0, CellOptions(views=(VIEWS, VIEWS)), seed=options.seed)
    if lens == "pinhole":
        recording = _without_distortion(recording, options.seed)
    estimator = make_estimator(model, ArmKinematics(simulated_arm()) if described else None)
    seven = Measurements.of_recording(replace(recording, views=recording.views[:-1]))
    before = estimator(seven)
    measurements = seven.with_views(recording.views[-1:])
    estimate = estimator(measurements, before)
    random = np.random.default_rng(options.seed)
    postures = np.array([view.joints_rad for view in recording.views])
    joints = postures[random.integers(0, VIEWS, count)] + SPREAD_RAD * random.standard_normal((count, 6))
    motions = _motions(joints)
    step = _Step(measurements, before, estimate, joints, motions, _gains(estimate, motions, joints))
    stages: dict[str, Callable[[], object]] = {
        "pose_of_view": lambda: seven.with_views(recording.views[-1:]),
        "estimate": lambda: estimator(measurements, before),
        "kinematics": lambda: _motions(joints),
        "gains": lambda: _gains(estimate, motions, joints),
        "certificate": lambda: _certify(step),
    }
    budget = 0.0 if options.quick else max(options.budget_s, 1.0)
    timings = interleave(stages, budget)
    return {
        "parameters": len(estimate.covariance),
        "candidates_in_sight": int(np.isfinite(step.gains).sum()),
        "stages": {name: timing.to_dict() for name, timing in timings.items()},
        "total_ms": 1e3 * sum(timing.median_s for timing in timings.values()),
        "total_without_certificate_ms": 1e3
        * sum(timing.median_s for name, timing in timings.items() if name != "certificate"),
    }


def _without_distortion(recording: Recording, seed: int) -> Recording:
    """Return the same views through a camera without distortion, four parameters of which are uncertain."""
    camera, truth, target = recording.camera, recording.truth, recording.target
    if camera.covariance is None or truth is None or truth.X is None or truth.Y is None:
        raise AssertionError("simulated recordings have both")
    pinhole = Camera("pinhole", camera.parameters[:4], *camera.size_px, covariance=camera.covariance[:4, :4])
    random = np.random.default_rng(seed)
    views: list[View] = []
    for view in recording.views:
        T = (truth.X @ recording.mounting.chain(view.T_base_flange) @ truth.Y).matrix
        uv, _ = _core.project_features("pinhole", pinhole.parameters, T, target.points, target.radii_m)
        pixels = uv + 0.1 * random.standard_normal(uv.shape)
        views.append(replace(view, pixels=pixels))
    return replace(recording, camera=pinhole, views=tuple(views))


def _motions(joints: FloatArray) -> FloatArray:
    """(N, 4, 4) A of the chain of an eye in hand: inverses of the flange's poses."""
    return inverses(simulated_arm().forward(joints))


def _gains(estimate: Estimate, motions: FloatArray, joints: FloatArray) -> FloatArray:
    return Prediction(estimate, Sight()).gains(_core.Criterion("entropy"), motions, joints)


def _certify(step: _Step) -> tuple[float, float, float]:
    prediction = Prediction(step.estimate, Sight())
    best = np.argsort(-np.nan_to_num(step.gains, nan=-np.inf), kind="stable")[:CERTIFIED_OF]
    informations = prediction.informations(step.motions[best], step.joints[best])
    chosen, _ = _core.select_views(step.estimate.information, informations, CERTIFIED, "entropy")
    return _core.certify_views(step.estimate.information, informations, chosen, "entropy")
