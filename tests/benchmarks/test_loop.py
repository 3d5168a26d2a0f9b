"""Where the time of a step goes: every stage is there, and nothing stays changed."""

import pytest

from handeye.benchmarks.loop import CELL, bench_loop
from handeye.benchmarks.options import Options
from handeye.planning.constraints import ViewConstraints
from handeye.session import attempt, loop


def test_every_stage_of_a_planned_step_takes_time_and_none_is_counted_twice() -> None:
    before = (vars(attempt)["detect"], ViewConstraints.passing, vars(loop)["make_estimator"])
    found = bench_loop(Options(quick=True), lambda done, total: None)
    assert (vars(attempt)["detect"], ViewConstraints.passing, vars(loop)["make_estimator"]) == before
    assert found["steps"] == 2
    stages = found["stages"]
    for name in (
        CELL,
        "detection",
        "candidates",
        "kinematics",
        "visibility",
        "collisions",
        "scoring",
        "writing",
    ):
        assert stages[name]["median_ms"] > 0, name
    ours = sum(stage["median_ms"] for name, stage in stages.items() if name != CELL)
    assert ours == pytest.approx(found["total_ms"], rel=1e-6)
