"""What a user waits for after detection: the default model of one camera and of four, all of `solve`."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from handeye.benchmarks.options import Options
from handeye.benchmarks.timing import interleave
from handeye.compute.parallel import Progress
from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.estimation import Measurements, RigMeasurements, estimate_rig, make_estimator, solve
from handeye.planning.candidates import Candidate, Pool
from handeye.planning.rig import rig_gains
from handeye.robots import ArmKinematics
from handeye.simulation.cells import CellOptions, ErrorKind, simulate, simulated_arm
from handeye.simulation.rigs import RigOptions, simulate_rig
from handeye.types import Pose, RigRecording
from handeye.types.calibration import ModelName

VIEWS = (8, 30)
STATIONS = 30
CANDIDATES = 10_000
# Candidates of the rig are drawn around the postures of its stations.
SPREAD_RAD = 0.15


def bench_default(options: Options, progress: Progress) -> dict[str, Any]:
    """Return times of the default estimate, arm described and not, and of solving the shipped recording."""
    kinematics = ArmKinematics(simulated_arm())
    methods: dict[str, Callable[[], object]] = {}
    for views in VIEWS[: 1 if options.quick else None]:
        cell = simulate(ErrorKind.MIXTURE_CELL, 0, CellOptions(views=(views, views)), seed=options.seed)
        measurements = Measurements.of_recording(cell)
        for name, arm in (("arm_described", kinematics), ("arm_not_described", None)):
            estimator = make_estimator(ModelName.AUTO, arm)
            methods[f"estimate_{views}_views_{name}"] = lambda e=estimator, m=measurements: e(m)
    stations = VIEWS[0] if options.quick else STATIONS
    rig = simulate_rig(ErrorKind.MIXTURE_CELL, 0, RigOptions(stations=stations), seed=options.seed)
    of_rig = RigMeasurements.of(rig)
    for name, arm in (("arm_described", kinematics), ("arm_not_described", None)):
        methods[f"estimate_{len(rig.cameras)}_cameras_{stations}_stations_{name}"] = lambda a=arm: (
            estimate_rig(of_rig, a)
        )
    believed, pool = estimate_rig(of_rig, kinematics), _candidates(rig, kinematics, options)
    methods[f"plan_{len(rig.cameras)}_cameras_{len(pool)}_candidates"] = lambda: rig_gains(believed, pool, ())
    shipped = read_recording(shipped_recording()).recording
    shipped = replace(shipped, views=shipped.views[: 8 if options.quick else None])
    methods[f"solve_shipped_{len(shipped.views)}_views"] = lambda: solve(shipped)
    progress(0, 1)
    timings = interleave(methods, 0.0 if options.quick else max(options.budget_s, 1.0))
    progress(1, 1)
    return {"cases": {name: timing.to_dict() for name, timing in timings.items()}}


def _candidates(rig: RigRecording, kinematics: ArmKinematics, options: Options) -> Pool:
    random = np.random.default_rng(options.seed)
    count = 200 if options.quick else CANDIDATES
    postures = np.array([station.joints_rad for station in rig.stations])
    joints = postures[random.integers(0, len(postures), count)]
    joints = joints + SPREAD_RAD * random.standard_normal(joints.shape)
    poses = kinematics.forward(joints)
    return Pool(tuple(Candidate(str(i), Pose(poses[i]), tuple(q)) for i, q in enumerate(joints.tolist())))
