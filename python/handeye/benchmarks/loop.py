"""Where the time of a step of the closed loop goes: a simulated arm, pictures that are rendered, one core.

Times are of the processor, each stage without the stages inside it. Robot and camera, which are simulated
here, are counted apart: rendering a picture is no work of this package's users.
"""

import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np

from handeye.benchmarks.options import Options
from handeye.compute.parallel import Progress
from handeye.estimation import Estimator, Measurements
from handeye.planning import Planner
from handeye.planning.collisions import Body
from handeye.planning.constraints import ViewConstraints
from handeye.planning.feasibility import Generator as CandidateGenerator
from handeye.planning.prediction import Prediction
from handeye.robots import Arm
from handeye.session import attempt, choosing, loop, taking
from handeye.session.calls import Calls
from handeye.session.configuration import begin, prepare
from handeye.session.deciding import Step
from handeye.session.entry import Entry
from handeye.session.settings import Collisions, Configuration
from handeye.session.store import SessionStore

ARM = "ur5e"
VIEWS, QUICK_VIEWS = 14, 5
CELL = "robot and camera, simulated"
REST = "the rest"
# What belongs to which stage; the names are looked up where they are called.
_STAGES: tuple[tuple[str, object, str], ...] = (
    (CELL, Calls, "run"),
    ("detection", attempt, "detect"),
    ("judging the view", taking, "objection"),
    ("judging the view", taking, "labeled"),
    ("pose of the view", Measurements, "with_views"),
    ("mistakes", loop, "examine"),
    ("candidates", CandidateGenerator, "draw"),
    ("visibility", ViewConstraints, "passing"),
    ("kinematics", Arm, "forward"),
    ("kinematics", Arm, "inverse_all"),
    ("collisions", Body, "obstacles"),
    ("collisions", Body, "obstacle_on_path"),
    ("scoring", Prediction, "gains"),
    ("refinement", choosing, "refine"),
    ("choice", Planner, "ask"),
    ("writing", taking, "png_bytes"),
    ("writing", SessionStore, "keep_image"),
    ("writing", SessionStore, "append"),
)
_ESTIMATE, _MAKE_ESTIMATOR = "estimate", "make_estimator"


class _Watch:
    """Adds up processor time by stage; what is called inside another stage counts for itself."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._stack = [REST]
        self._since = time.process_time()

    def lap(self) -> dict[str, float]:
        """Return the seconds since the last lap."""
        self._turn()
        found, self.seconds = self.seconds, {}
        return found

    def timed(self, stage: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that counts for a stage."""

        @wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:  # noqa: ANN401 - whatever is called
            self._turn()
            self._stack.append(stage)
            try:
                return function(*arguments, **named)
            finally:
                self._turn()
                self._stack.pop()

        return call

    def _turn(self) -> None:
        now = time.process_time()
        stage = self._stack[-1]
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._since
        self._since = now


@contextmanager
def _watching(watch: _Watch) -> Generator[None]:
    before = [(owner, name, getattr(owner, name)) for _, owner, name in _STAGES]
    make: Callable[..., Estimator] = getattr(loop, _MAKE_ESTIMATOR)

    def make_estimator(*arguments: Any, **named: Any) -> Estimator:  # noqa: ANN401
        return watch.timed(_ESTIMATE, make(*arguments, **named))

    try:
        for (stage, owner, name), (_, _, function) in zip(_STAGES, before, strict=True):
            setattr(owner, name, watch.timed(stage, function))
        setattr(loop, _MAKE_ESTIMATOR, make_estimator)
        yield
    finally:
        setattr(loop, _MAKE_ESTIMATOR, make)
        for owner, name, function in before:
            setattr(owner, name, function)


def bench_loop(options: Options, progress: Progress) -> dict[str, Any]:
    """Return the times of the stages of the steps that were planned, after the first three views."""
    views = QUICK_VIEWS if options.quick else VIEWS
    configuration = Configuration(
        ARM,
        accuracy_mm=None,
        accuracy_deg=None,
        most_views=views,
        seed=options.seed,
        collisions=Collisions.CAPSULES,
    )
    prepared = prepare(configuration)
    laps: list[dict[str, float]] = []
    watch = _Watch()
    with tempfile.TemporaryDirectory() as folder, _watching(watch):
        session, store = begin(prepared, Path(folder) / "session")
        try:
            while isinstance(step := session.next(), Step):
                progress(min(len(store.entries), views - 1), views)
                entry: Entry = session.take(step)
                spent = watch.lap()
                if step.phase == "plan" and entry.view is not None:
                    laps.append(spent)
        finally:
            store.close()
    progress(views, views)
    stages = list(dict.fromkeys([stage for stage, _, _ in _STAGES] + [_ESTIMATE, REST]))
    table = {stage: _figures([lap.get(stage, 0.0) for lap in laps]) for stage in stages}
    ours = [sum(seconds for stage, seconds in lap.items() if stage != CELL) for lap in laps]
    return {
        "arm": ARM,
        "image_px": list(prepared.cell.camera.size_px),
        "points": prepared.cell.target.point_count,
        "target": prepared.cell.target.family,
        "steps": len(laps),
        "stages": table,
        "total_ms": _figures(ours)["median_ms"],
    }


def _figures(seconds: list[float]) -> dict[str, float]:
    low, median, high = 1e3 * np.percentile(seconds, [25, 50, 75])
    return {"median_ms": float(median), "low_ms": float(low), "high_ms": float(high)}
