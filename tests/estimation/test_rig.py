"""Several cameras in one estimate: the simple case to the last bit, and what only a rig can say."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.errors import DegenerateError, InputError, SolveError
from handeye.estimation import RigMeasurements, estimate_rig, solve, solve_rig
from handeye.estimation.rig_checks import examine_rig
from handeye.robots import ArmKinematics, open_arm
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.simulation.rigs import RigOptions, simulate_rig
from handeye.types import Camera, CameraView, Chessboard, Mounting, Pose, RigRecording, Station
from handeye.validation import metrics

KNOWN = ArmKinematics(open_arm("ur5e"))


def only(recording: RigRecording, *pairs: tuple[str, str]) -> RigRecording:
    """Return the recording with the views of these pairs, and the cameras and targets that they need."""
    stations = [
        Station(kept)
        for station in recording.stations
        if (kept := tuple(one for one in station.views if (one.camera, one.target) in pairs))
    ]
    return replace(
        recording,
        cameras={n: c for n, c in recording.cameras.items() if n in {camera for camera, _ in pairs}},
        targets={n: t for n, t in recording.targets.items() if n in {target for _, target in pairs}},
        stations=tuple(stations),
        truth=None,
    )


def displaced(station: Station, by: Pose) -> Station:
    """Return a station at which the arm says that it stands elsewhere."""
    return Station(
        tuple(
            replace(one, view=replace(one.view, T_base_flange=by @ one.view.T_base_flange))
            for one in station.views
        )
    )


def test_few_views_of_a_station_that_others_leave_out_are_left_out_too() -> None:
    recording = replace(simulate_rig(ErrorKind.PIXEL_ONLY, 0, seed=3), truth=None)
    by = Pose.exp([0.1, -0.06, 0.05, 0.2, 0.3, 0.1])
    camera, target = recording.stations[0].views[0].camera, recording.stations[0].views[0].target
    stations, seen = [displaced(recording.stations[0], by)], 1
    for station in recording.stations[1:]:
        own = [one for one in station.views if (one.camera, one.target) == (camera, target)]
        others = [one for one in station.views if one not in own]
        seen += bool(own)
        kept = (*others, *own) if seen <= 3 else tuple(others)
        stations += [Station(kept)] if kept else []
    found = examine_rig(RigMeasurements.of(replace(recording, stations=tuple(stations))))
    name = stations[0].name
    few = found[camera, target].measurements
    assert len(few) == 2
    assert "elsewhere" in few.rejected[name]


@pytest.mark.parametrize("mounting", list(Mounting))
@pytest.mark.parametrize("known", [True, False])
def test_one_camera_has_the_same_answer_to_the_last_bit(mounting: Mounting, known: bool) -> None:
    recording = simulate(ErrorKind.MIXTURE_CELL, 2, CellOptions(mounting=mounting))
    kinematics = KNOWN if known else None
    rig = solve_rig(recording, kinematics=kinematics)
    assert rig.cameras["camera"].to_dict() == solve(recording, kinematics=kinematics).to_dict()
    assert rig.targets_of == {"camera": "target"}
    assert not rig.camera_to_camera


@pytest.mark.parametrize("known", [True, False])
def test_regions_hold_the_truth_of_every_transform(known: bool) -> None:
    """Modest: with 95 % of 48 transforms in truth, fewer than 40 are seen once in some thousand times."""
    held = 0
    for number in range(8):
        recording = simulate_rig(ErrorKind.MIXTURE_RANDOM, number, seed=3)
        assert recording.truth is not None
        estimate = estimate_rig(RigMeasurements.of(recording), KNOWN if known else None)
        for name, X in recording.truth.cameras.items():
            one = estimate.of_camera(name)
            squared = metrics.nees(one.X, one.hand_eye_covariance, X)
            held += metrics.region_holds(squared, one.degrees_of_freedom)
        for a, b in recording.rigid_pairs():
            between = estimate.camera_to_camera(a, b)
            true = recording.truth.cameras[a] @ recording.truth.cameras[b].inverse()
            squared = metrics.nees(between.pose, between.covariance, true)
            held += metrics.region_holds(squared, between.degrees_of_freedom)
    assert held >= 40


def test_cameras_of_one_body_are_free_of_the_arm_in_each_other() -> None:
    """Where the arm's noise rules: a third of the error of cameras that are calibrated one at a time."""
    together, apart = [], []
    cell = CellOptions(rotation_sigma_deg=(0.1, 0.1), lever_m=(1.0, 1.0), roll_deg=(-45.0, 45.0))
    options = RigOptions(on_flange=2, beside=0, fewest_seen=2, cell=cell)
    for number in range(4):
        recording = simulate_rig(ErrorKind.WHITE_FLANGE, number, options)
        assert recording.truth is not None
        true = recording.truth.cameras["left"] @ recording.truth.cameras["right"].inverse()
        between = estimate_rig(RigMeasurements.of(recording)).camera_to_camera("left", "right")
        alone = [solve(recording.pair(name, "table")).X for name in ("left", "right")]
        together.append(metrics.absolute_error(between.pose, true).translation_mm)
        apart.append(metrics.absolute_error(alone[0] @ alone[1].inverse(), true).translation_mm)
    assert 3 * np.mean(together) < np.mean(apart)


@pytest.mark.parametrize(
    ("seed", "number", "known"),
    [
        (3500, 0, True),
        (3500, 10, True),
        (3600, 2, False),
        (3600, 47, False),
        (3900, 2, True),
        (3900, 68, True),
    ],
)
def test_an_arm_that_misses_by_a_degree_does_not_part_cameras(seed: int, number: int, known: bool) -> None:
    """Twists of a degree are far from linear: what is free of the arm is, only where the arm truly stood."""
    recording = simulate_rig(ErrorKind.ROBOT_NOISE_1_DEG, number, seed=seed)
    estimate = estimate_rig(RigMeasurements.of(recording), KNOWN if known else None)
    assert estimate.fit.at_rest
    truth = recording.truth
    assert truth is not None
    for a, b in (("left", "right"), ("front", "side")):
        off = estimate.camera_to_camera(a, b).pose @ (truth.cameras[a] @ truth.cameras[b].inverse()).inverse()
        assert np.linalg.norm(off.log()[:3]) < 2e-3
        assert np.linalg.norm(off.log()[3:]) < np.deg2rad(0.2)


def test_a_fixed_camera_is_found_through_a_board_that_another_knows() -> None:
    recording = simulate_rig(ErrorKind.MIXTURE_CELL, 0)
    assert ("front", "table") in recording.pairs
    tied = only(recording, ("left", "table"), ("front", "table"))
    rig = solve_rig(tied, kinematics=KNOWN)
    assert rig.targets_of == {"left": "table", "front": None}
    assert recording.truth is not None
    error = metrics.absolute_error(rig.cameras["front"].X, recording.truth.cameras["front"])
    assert error.translation_mm < 3
    data = rig.to_dict()["cameras"]
    assert isinstance(data, dict)
    assert "T_base_camera" in data["front"]
    assert "T_flange_target" not in data["front"]


def test_what_nothing_ties_to_the_arm_is_named_with_its_cure() -> None:
    recording = simulate_rig(ErrorKind.MIXTURE_CELL, 0)
    loose = only(recording, ("left", "table"), ("front", "tool"))
    few = replace(
        loose,
        stations=tuple(
            Station(tuple(v for v in s.views if v.camera == "left" or k < 2))
            for k, s in enumerate(loose.stations)
        ),
    )
    with pytest.raises(InputError, match="camera front: nothing ties it") as caught:
        solve_rig(few)
    assert caught.value.code == "not_tied"
    assert "a target on the flange at 3 stations" in (caught.value.hint or "")
    with pytest.raises(InputError, match="2 usable stations"):
        solve_rig(replace(recording, stations=recording.stations[:2]))


def test_cameras_that_share_no_station_are_told_so() -> None:
    recording = simulate_rig(ErrorKind.MIXTURE_CELL, 0, RigOptions(stations=16, beside=0, fewest_seen=2))
    apart = replace(
        recording,
        stations=tuple(
            Station(tuple(v for v in s.views if v.camera == ("left", "right")[k % 2]))
            for k, s in enumerate(recording.stations)
        ),
    )
    rig = solve_rig(apart)
    assert rig.camera_to_camera["left", "right"].shared == 0
    assert any("left and right share no station" in warning for warning in rig.warnings)
    shared = solve_rig(recording)
    assert not any("share no station" in warning for warning in shared.warnings)
    radius = [r.camera_to_camera["left", "right"].within_95.translation_mm for r in (shared, rig)]
    assert 2 * radius[0] < radius[1]


def test_what_is_open_is_named_by_camera_and_a_second_camera_may_close_it() -> None:
    """A camera that always stood alike sees nothing of its own motion; its neighbour holds it."""
    recording = simulate_rig(ErrorKind.PIXEL_ONLY, 1, RigOptions(stations=14, beside=0, fewest_seen=2))
    still = recording.stations[:1]
    twice = [replace(still[0].views[0].view, name=f"again_{k}") for k in range(3)]
    alone = only(recording, ("left", "table"))
    alike = replace(
        alone, stations=tuple(Station((replace(still[0].views[0], view=view),)) for view in twice)
    )
    with pytest.raises(DegenerateError, match="not determined"):
        solve_rig(alike)
    few = replace(
        recording,
        stations=tuple(
            Station(tuple(v for v in s.views if v.camera == "left" or k < 1))
            for k, s in enumerate(recording.stations)
        ),
    )
    rig = solve_rig(few)  # one view of the right camera: the left one knows the board
    assert recording.truth is not None
    assert metrics.absolute_error(rig.cameras["right"].X, recording.truth.cameras["right"]).rotation_deg < 0.3


def test_cameras_that_count_from_other_ends_of_a_board_are_brought_to_agree() -> None:
    """A board that looks the same turned by half a turn; the right camera has it upside down, another at times."""
    recording = simulate_rig(ErrorKind.MIXTURE_CELL, 0)
    board = Chessboard(8, 10, 0.025)
    half_turn = board.symmetries[1]

    def cut(one: CameraView, k: int) -> CameraView:
        if one.target != "table":
            return one
        rows, columns = one.view.point_ids // 11, one.view.point_ids % 11
        kept = columns < 10
        ids = rows[kept] * 10 + columns[kept]
        if one.camera == "right" or (one.camera == "front" and k % 2):
            ids = half_turn[ids]
        return replace(one, view=replace(one.view, point_ids=ids, pixels=one.view.pixels[kept]))

    turned = replace(
        recording,
        targets={**recording.targets, "table": replace(recording.targets["table"], target=board)},
        stations=tuple(
            Station(tuple(cut(one, k) for one in station.views))
            for k, station in enumerate(recording.stations)
        ),
    )
    rig = solve_rig(turned, kinematics=KNOWN)
    assert recording.truth is not None
    for name, X in recording.truth.cameras.items():
        assert metrics.absolute_error(rig.cameras[name].X, X).translation_mm < 2.5


def test_a_board_that_would_have_to_be_of_another_size_is_refused() -> None:
    rig = simulate_rig(ErrorKind.MIXTURE_CELL, 0, seed=8)
    halves = {
        name: replace(mounted, target=Chessboard(board.rows, board.columns, 0.5 * board.pitch_m))
        for name, mounted in rig.targets.items()
        if isinstance(board := mounted.target, Chessboard)
    }
    assert halves.keys() == rig.targets.keys()
    with pytest.raises(SolveError, match=r"target .* would be .* larger than stated"):
        estimate_rig(RigMeasurements.of(replace(rig, targets=halves)), KNOWN, camera_fixed=True)


def test_a_camera_that_would_have_to_be_another_is_refused() -> None:
    rig = simulate_rig(ErrorKind.MIXTURE_CELL, 0, seed=8)
    name, mounted = next(iter(rig.cameras.items()))
    camera = mounted.camera
    longer = Camera(
        camera.lens,
        camera.parameters * [1.2, 1.2, 1, 1, *np.ones(len(camera.parameters) - 4)],
        *camera.size_px,
    )
    cameras = {**rig.cameras, name: replace(mounted, camera=longer)}
    with pytest.raises(SolveError, match=f"focal length or centre of camera {name} would be off"):
        estimate_rig(RigMeasurements.of(replace(rig, cameras=cameras)), KNOWN)
