"""The gain of a station seen by several cameras: the robot's error is shared, and what is asked for counts."""

import numpy as np
import pytest

from handeye.errors import DegenerateError, InputError
from handeye.estimation import RigEstimate, RigMeasurements, estimate_rig
from handeye.estimation.touch import touch_error
from handeye.estimation.work import Work, lay_out
from handeye.planning import rig
from handeye.planning.candidates import Candidate, Pool
from handeye.planning.prediction import Sight
from handeye.planning.rig import rig_gains
from handeye.planning.rig_request import Aim, RigRequest, rig_touch_map, seen_most
from handeye.robots import ArmKinematics, open_arm
from handeye.simulation.cells import ErrorKind
from handeye.simulation.rigs import RigOptions, simulate_rig
from handeye.types import Pose, RigRecording

KNOWN = ArmKinematics(open_arm("ur5e"))


@pytest.fixture(scope="module")
def recording() -> RigRecording:
    """Ten stations; the last two are left to choose from."""
    return simulate_rig(ErrorKind.MIXTURE_CELL, 1, RigOptions(stations=14))


def estimated(recording: RigRecording, count: int, *, known: bool = True) -> RigEstimate:
    first = recording.with_stations(recording.stations[:count])
    return estimate_rig(RigMeasurements.of(first), KNOWN if known else None)


@pytest.mark.parametrize("known", [True, False])
def test_gains_are_what_the_covariances_lose(recording: RigRecording, known: bool) -> None:
    """Taken alone, the predicted gain of a camera agrees with what its covariance loses with the station."""
    before = estimated(recording, 8, known=known)
    pool = Pool.of_views(station.views[0].view for station in recording.stations[8:])
    found = rig_gains(before, pool, (), Sight())
    assert found.best is not None
    assert np.nanmin(found.gains) > 0
    for i, pairs in found.seen.items():
        seen = {
            (v.camera, v.target) for v in recording.stations[8 + i].views if v.camera in {"left", "right"}
        }
        assert seen <= set(pairs)


def test_what_is_asked_for_decides(recording: RigRecording) -> None:
    before = estimated(recording, 6)
    pool = Pool.of_views(station.views[0].view for station in recording.stations[6:])
    hand, between = (
        rig_gains(before, pool, [Aim(names)], Sight()).gains for names in (("left",), ("left", "right"))
    )
    assert not np.allclose(hand, between, equal_nan=True)
    # Two cameras in each other: the arm's error, which they share, takes nothing away.
    assert np.nanmax(between) > 0


def test_the_short_list_holds_the_best_of_many(
    recording: RigRecording, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A few points of each target rank the candidates well enough; those listed are looked at as they are."""
    before = estimated(recording, 6)
    random = np.random.default_rng(3)
    postures = np.array([station.joints_rad for station in recording.stations])
    joints = postures[random.integers(0, len(postures), 300)] + random.normal(0.0, 0.15, (300, 6))
    poses = KNOWN.forward(joints)
    pool = Pool(tuple(Candidate(f"c{i}", Pose(poses[i]), tuple(q)) for i, q in enumerate(joints)))
    listed = rig_gains(before, pool, (), Sight(margin_px=20.0))
    monkeypatch.setattr(rig, "SHORTLIST", len(pool))
    every = rig_gains(before, pool, (), Sight(margin_px=20.0))
    assert np.isfinite(every.gains).sum() > 50
    chosen = np.isfinite(listed.gains)
    np.testing.assert_allclose(listed.gains[chosen], every.gains[chosen], rtol=1e-9)
    assert np.nanmax(listed.gains) > 0.98 * np.nanmax(every.gains)


def test_shared_error_of_the_robot_is_counted_once(recording: RigRecording) -> None:
    """Were the error new for each camera, four cameras would teach more of the arm than they do."""
    before = estimated(recording, 6, known=False)
    pool = Pool.of_views(station.views[0].view for station in recording.stations[6:])
    wanted = [Aim(("left",))]
    together = rig_gains(before, pool, wanted, Sight()).gains
    assert np.all(np.isfinite(together))
    assert np.nanmax(together) < 5


def test_a_request_names_what_it_lacks(recording: RigRecording) -> None:
    estimate = estimated(recording, 14)
    assert RigRequest(100.0, 10.0).missing(estimate) == {}
    tight = RigRequest(1e-3, 1e-3, cameras=("left",), camera_to_camera=(1e-3, 1e-3)).missing(estimate)
    assert set(map(str, tight)) == {"left", "left right", "front side"}
    assert all(factor > 1 for factor in tight.values())
    with pytest.raises(InputError):
        RigRequest(0.0, 1.0)


@pytest.mark.parametrize("camera", ["left", "front"])
def test_what_is_touched_is_weighed_by_its_mean_square_error(recording: RigRecording, camera: str) -> None:
    estimate, work = estimated(recording, 10), Work()
    pair = seen_most(estimate, camera)
    one = estimate.of_pair(*pair)
    laid = lay_out(one, estimate.fit.measurements.pairs[pair], work).touches
    error = touch_error(one, laid)
    wanted = float(np.trace(error.covariances - error.noise, axis1=1, axis2=2).mean())
    rows = rig._combination(estimate, Aim((camera,), work))
    assert float(np.trace(rows @ estimate.covariance @ rows.T)) == pytest.approx(wanted, rel=1e-6)
    worst_m = rig_touch_map(estimate, camera, work).worst_m
    assert worst_m == pytest.approx(error.radii_m.max())
    asked = RigRequest(cameras=(camera,), touch_mm=0.5e3 * worst_m, work=work)
    assert list(asked.missing(estimate).values()) == pytest.approx([2.0])
    assert not RigRequest(cameras=(camera,), touch_mm=1.1e3 * worst_m, work=work).missing(estimate)


def test_planning_for_touches_makes_them_smaller(recording: RigRecording) -> None:
    before = estimated(recording, 8)
    pool = Pool.of_views(station.views[0].view for station in recording.stations[8:])
    names, work = list(before.fit.measurements.cameras), Work()
    found = rig_gains(before, pool, [Aim((name,), work) for name in names], Sight())
    best, worst = int(np.nanargmax(found.gains)), int(np.nanargmin(found.gains))
    left: list[float] = []
    for i in (best, worst):
        stations = (*recording.stations[:8], recording.stations[8 + i])
        after = estimate_rig(RigMeasurements.of(recording.with_stations(stations)), KNOWN)
        maps = [rig_touch_map(after, name, work).mean_m for name in names]
        left.append(float(np.sum(np.log(maps))))
    assert left[0] < left[1]


def test_an_empty_sight_gains_nothing(recording: RigRecording) -> None:
    before = estimated(recording, 8)
    away = Pool.of_poses([Pose.exp([5.0 + k, 5.0, 5.0, 0, 0, 0]) for k in range(5)])
    assert rig_gains(before, away, (), Sight()).best is None


@pytest.mark.parametrize("between", [1.0, 2.0])
def test_information_that_is_not_positive_definite_is_refused(between: float) -> None:
    """Two parameters that cannot be told apart, and what no measurement gives."""
    information = np.eye(7)
    information[0, 6] = information[6, 0] = between
    with pytest.raises(DegenerateError, match="singular"):
        rig._log_sizes(information[np.newaxis], [Aim(("left",))], [np.eye(6, 7)])
