"""What a user waits for after detection: the default model, and all of `handeye solve`, on one core."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from handeye.benchmarks.options import Options
from handeye.benchmarks.timing import interleave
from handeye.compute.parallel import Progress
from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.estimation import Measurements, make_estimator, solve
from handeye.robots import ArmKinematics
from handeye.simulation.cells import CellOptions, ErrorKind, simulate, simulated_arm
from handeye.types.calibration import ModelName

VIEWS = (8, 30)


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
    shipped = read_recording(shipped_recording()).recording
    shipped = replace(shipped, views=shipped.views[: 8 if options.quick else None])
    methods[f"solve_shipped_{len(shipped.views)}_views"] = lambda: solve(shipped)
    progress(0, 1)
    timings = interleave(methods, 0.0 if options.quick else max(options.budget_s, 1.0))
    progress(1, 1)
    return {"cases": {name: timing.to_dict() for name, timing in timings.items()}}
