"""Climbing from candidates: never worse, never past what a candidate must pass, and the same every time."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.planning import Planner, PlannerOptions, Proposal, make_policy
from handeye.planning.constraints import ViewLimits
from handeye.planning.feasibility import FeasiblePool, Generator
from handeye.planning.prediction import Prediction
from handeye.planning.refinement import Refined, Refinement, offered, refine
from handeye.planning.travel import Travel
from handeye.robots import ArmKinematics
from handeye.session.configuration import Prepared, begin, prepare
from handeye.types import Mounting
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName
from sessions import configured

LIMITS = ViewLimits(distance_m=(0.3, 0.8), tilt_rad=float(np.deg2rad(40)), margin_px=25.0)


class Scene:
    """A session after its start, and the candidates of its next step."""

    def __init__(self, folder: Path, mounting: Mounting = Mounting.EYE_IN_HAND, seed: int = 11) -> None:
        self.prepared: Prepared = prepare(configured(seed, mounting=mounting, most_views=4))
        session, store = begin(self.prepared, folder / "s")
        session.run()
        store.close()
        self.measurements = Measurements.of_recording(store.recording)
        estimator = make_estimator(ModelName.AUTO, ArmKinematics(self.prepared.arm))
        self.estimate: Estimate = estimator(self.measurements)
        generator = Generator(self.prepared.arm, self.prepared.cell.workspace, LIMITS)
        postures = [view.joints_rad or () for view in store.recording.views]
        self.drawn: FeasiblePool = generator.draw(self.estimate, postures, np.random.default_rng(0))
        travel = Travel(np.array(postures[-1]), np.full(len(self.prepared.arm), 0.5))
        self.options = PlannerOptions(sight=self.drawn.sight, travel=travel)

    def gains(self, joints: FloatArray) -> FloatArray:
        constraints = self.drawn.constraints
        motions = constraints.motions(joints)
        return Prediction(self.estimate, constraints.sight).gains(self.options.criterion, motions, joints)

    @property
    def joints(self) -> FloatArray:
        return np.array([self.drawn.joints[one.name] for one in self.drawn.pool.candidates])

    def refined(self, **changes: int) -> list[Refined]:
        random = np.random.default_rng(5)
        gains = self.gains(self.joints)
        return refine(self.drawn, gains, self.options, random, Refinement(**changes))


@pytest.mark.parametrize("mounting", list(Mounting))
def test_what_is_climbed_to_teaches_more_and_passes_everything(mounting: Mounting, tmp_path: Path) -> None:
    scene = Scene(tmp_path, mounting)
    refined = scene.refined()
    assert len(refined) >= 2
    ends = np.array([one.joints for one in refined])
    drawn = scene.gains(scene.joints)
    names = [candidate.name for candidate in scene.drawn.pool.candidates]
    for one, gain in zip(refined, scene.gains(ends), strict=True):
        assert one.seed_gain == drawn[names.index(one.seed)]
        assert gain > one.seed_gain
    assert scene.gains(ends).max() > drawn.max() * 1.02
    constraints = scene.drawn.constraints
    passed, turned_down = constraints.passing(ends)
    assert (len(passed), dict(turned_down)) == (len(ends), {})
    assert scene.options.travel is not None
    assert constraints.body.obstacles_on_paths(scene.options.travel.start, ends) == [None] * len(ends)
    # By the truth as well: the whole target is in the image, away from its border.
    truth, cell = scene.prepared.truth, scene.prepared.cell
    assert truth is not None
    assert truth.X is not None
    assert truth.Y is not None
    for candidate in offered(refined, scene.prepared.arm):
        seen = truth.X @ mounting.chain(candidate.T_base_flange) @ truth.Y
        pixels, good = cell.camera.project(seen.act(cell.target.points))
        assert good.all()
        assert (pixels > 20).all()
        assert (pixels < np.array(cell.camera.size_px) - 21).all()


def test_the_same_chance_climbs_the_same_way_and_none_leads_nowhere(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    once, again = scene.refined(), scene.refined()
    assert [one.name for one in once] == [one.name for one in again]
    assert all(np.array_equal(a.joints, b.joints) for a, b in zip(once, again, strict=True))
    assert scene.refined(rounds=0) == []
    unweighed = replace(scene.options, policy=make_policy("random"))
    gains = scene.gains(scene.joints)
    assert refine(scene.drawn, gains, unweighed, np.random.default_rng(0)) == []
    assert refine(scene.drawn, gains, PlannerOptions(), np.random.default_rng(0)) == []


def test_seeds_are_apart_and_reached_on_free_paths(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    refined = scene.refined(seeds=3)
    seeds = np.array([scene.drawn.joints[one.seed] for one in refined])
    for i in range(len(seeds)):
        assert all(np.abs(seeds[i] - other).max() >= Refinement().apart_rad for other in seeds[:i])
    # From a floor that is everywhere nothing is reached.
    body = scene.drawn.constraints.body
    buried = replace(body, workspace=replace(body.workspace, floor_m=10.0))
    sunk = replace(scene.drawn, constraints=replace(scene.drawn.constraints, body=buried))
    gains = scene.gains(scene.joints)
    assert refine(sunk, gains, scene.options, np.random.default_rng(0)) == []


def test_a_planner_weighs_what_is_offered_beside_what_it_has(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    planner = Planner(scene.measurements, scene.drawn.pool, lambda *_: scene.estimate, scene.options)
    before = planner.ask()
    assert isinstance(before, Proposal)
    more = offered(scene.refined(), scene.prepared.arm)
    planner.offer(more)
    after = planner.ask()
    assert isinstance(after, Proposal)
    assert after.candidate in more
    assert after.predicted_gain > before.predicted_gain
    assert np.array_equal(after.gains[: -len(more)], before.gains)
    # What is given up takes its gain with it.
    planner.give_up(after.candidate.name)
    third = planner.ask()
    assert isinstance(third, Proposal)
    left = [candidate for candidate in planner.pool.candidates if candidate.name == third.candidate.name]
    assert third.predicted_gain == pytest.approx(scene.gains(np.array([left[0].joints_rad]))[0], rel=1e-9)
