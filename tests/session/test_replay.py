"""The loop on recorded views: with and without an arm, with pictures or points, broken off and gone on with."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from folders import made_recording, written
from handeye.datasets import read_recording, write_recording
from handeye.datasets.images import read_image
from handeye.errors import InputError
from handeye.estimation import solve
from handeye.robots.protocol import Goal
from handeye.robots.replay import ReplayRobot
from handeye.session.configuration import Prepared, begin, go_on, prepare
from handeye.session.deciding import EndReason
from handeye.session.entry import Failure
from handeye.session.loop import End
from handeye.session.settings import Configuration
from handeye.session.store import SessionStore
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Pose, View
from sessions import Outcome, configured, run


def replayed(folder: Path, session: Path, **changes: object) -> tuple[End, Prepared, SessionStore]:
    usual: dict[str, object] = {"robot": None, "accuracy_mm": None, "most_views": 99} | changes
    configuration = Configuration(driver=f"replay:{folder}", images="replay", **usual)  # type: ignore[arg-type]
    prepared = prepare(configuration)
    loop, store = begin(prepared, session)
    try:
        return loop.run(), prepared, store
    finally:
        store.close()


def test_all_of_a_recording_in_the_end_and_a_recording_again(tmp_path: Path) -> None:
    source = made_recording(9)
    end, prepared, store = replayed(written(source, tmp_path / "source"), tmp_path / "s")
    assert (end.reason, end.views, end.attempts) == (EndReason.NO_CANDIDATE, 9, 9)
    assert "none of the 9 recorded views is left" in end.sentence
    assert prepared.start is None
    # The session is the recording in another order, with the names that its views had.
    again = read_recording(tmp_path / "s").recording
    assert again.mounting is source.mounting
    by_name = {view.name: view for view in source.views}
    assert sorted(by_name) == sorted(view.name for view in again.views)
    for view in again.views:
        assert np.array_equal(view.pixels, by_name[view.name].pixels)
        assert view.T_base_flange == by_name[view.name].T_base_flange
    whole = solve(source)
    assert end.calibration is not None
    assert np.linalg.norm((end.calibration.X @ whole.X.inverse()).log()) < 1e-5
    planned = [entry.decision for entry in store.entries if entry.phase == "plan"]
    assert len(planned) == 6
    assert planned[0]["predicted_gain"] == pytest.approx(max(planned[0]["candidates"].values()), abs=1e-5)


def test_it_ends_with_the_accuracy_reached_and_few_views_teach_more(tmp_path: Path) -> None:
    folder = written(made_recording(20), tmp_path / "source")
    end, _, _ = replayed(folder, tmp_path / "s", accuracy_mm=5.0, accuracy_deg=0.5)
    assert (end.reason, end.views) == (EndReason.ACCURACY_REACHED, 6)
    chosen, _, _ = replayed(folder, tmp_path / "chosen", most_views=6)
    assert (chosen.reason, chosen.views) == (EndReason.VIEWS_TAKEN, 6)


def test_views_chosen_for_their_gain_teach_more_than_random_ones(tmp_path: Path) -> None:
    """Over several cells: of one, six views find the noise levels too roughly to tell."""
    stated: dict[str, list[float]] = {"next_best_view": [], "random": []}
    for number in range(6):
        recording = simulate(ErrorKind.WHITE_FLANGE, number, CellOptions(views=(20, 20)))
        folder = written(recording, tmp_path / f"source_{number}")
        for policy, radii in stated.items():
            place = tmp_path / f"{policy}_{number}"
            end, _, _ = replayed(folder, place, most_views=6, policy=policy, seed=1)
            assert end.reach is not None
            radii.append(end.reach.translation_mm)
    chosen, random = (np.exp(np.mean(np.log(radii))) for radii in stated.values())
    assert chosen < 0.9 * random, stated


def test_it_goes_on_where_it_was_broken_off(tmp_path: Path) -> None:
    folder = written(made_recording(9), tmp_path / "source")
    replayed(folder, tmp_path / "whole")
    configuration = Configuration(
        None, driver=f"replay:{folder}", images="replay", accuracy_mm=None, most_views=99
    )
    session, store = begin(prepare(configuration), tmp_path / "broken")
    for _ in range(5):
        step = session.next()
        assert not isinstance(step, End)
        session.take(step)
    store.close()
    session, store, _ = go_on(tmp_path / "broken")
    session.run()
    store.close()
    assert Outcome.of(tmp_path / "broken") == Outcome.of(tmp_path / "whole")


def test_with_the_arm_its_joints_are_weighed(tmp_path: Path) -> None:
    recording = simulate(ErrorKind.JOINT_OFFSETS, 3, CellOptions(offset_sigma_deg=(0.05, 0.05)))
    folder = written(recording, tmp_path / "source")
    known, prepared, _ = replayed(folder, tmp_path / "known", most_views=10, robot="ur5e")
    blind, _, _ = replayed(folder, tmp_path / "blind", most_views=10)
    assert prepared.arm.name == "ur5e"
    assert known.calibration is not None
    assert blind.calibration is not None
    assert known.calibration.joint_offsets
    assert not blind.calibration.joint_offsets
    # Times are known from the joints.
    quick, _, _ = replayed(folder, tmp_path / "quick", most_views=6, policy="gain_per_second")
    assert quick.views == 6
    with pytest.raises(InputError):
        replayed(folder, tmp_path / "wrong", robot="epson_c4l")


def test_pictures_come_along_where_they_were_kept(tmp_path: Path) -> None:
    run(configured(4, points_only=None, most_views=4, camera_error=0.0), tmp_path / "source")
    source = read_recording(tmp_path / "source").recording
    # Of one view no picture was kept, that of another is gone once the session has begun.
    bare, broken = source.views[1], source.views[3]
    views = tuple(replace(view, image=None) if view is bare else view for view in source.views)
    folder = tmp_path / "kept"
    write_recording(replace(source, views=views), folder, images_from=tmp_path / "source")
    prepared = prepare(Configuration(None, driver=f"replay:{folder}", images="replay", accuracy_mm=None))
    (folder / str(broken.image)).unlink()
    session, store = begin(prepared, tmp_path / "s")
    end = session.run()
    store.close()
    assert (end.views, end.attempts) == (3, 4)
    failed = [entry for entry in store.entries if entry.failure is not None]
    assert [(entry.label, entry.failure) for entry in failed] == [(f"{broken.name}.1", Failure.CAMERA_FAILED)]
    again = {view.name: view for view in read_recording(tmp_path / "s").recording.views}
    assert again[bare.name].image is None
    kept = again[source.views[0].name]
    assert kept.image is not None
    shown = (read_image(tmp_path / "s" / kept.image), read_image(folder / str(source.views[0].image)))
    assert np.array_equal(*shown)


def test_labels_stay_as_they_were_recorded(tmp_path: Path) -> None:
    # A board that looks the same when turned by half a turn, seen from all around.
    source = made_recording(12, seed=5)
    assert len(source.target.symmetries) == 2
    _, _, store = replayed(written(source, tmp_path / "source"), tmp_path / "s")
    by_name = {view.name: view for view in source.views}
    assert len(store.recording.views) == 12
    assert all(np.array_equal(v.point_ids, by_name[v.name].point_ids) for v in store.recording.views)


def test_views_at_one_place_are_told_apart_by_name() -> None:
    pose = Pose.exp([0.3, 0, 0.4, 0, 0, 0.2])
    views = [View(name, pose, [0], [[1.0, 2.0]]) for name in ("a", "b")]
    robot = ReplayRobot(views)
    for label, name in (("b.1", "b"), ("a.1", "a"), ("other.1", "a")):
        robot.move_to(Goal(label, pose))
        assert robot.view is not None
        assert robot.view.name == name


def test_too_few_views_end_in_words(tmp_path: Path) -> None:
    source = made_recording(9)
    folder = written(replace(source, views=source.views[:3]), tmp_path / "three")
    end, _, _ = replayed(folder, tmp_path / "s")
    assert end.reason is EndReason.NO_CANDIDATE
    two = written(replace(source, views=source.views[:2]), tmp_path / "two")
    end, _, _ = replayed(two, tmp_path / "t")
    assert (end.reason, end.calibration) == (EndReason.NO_START, None)
    assert "2 recorded views" in end.sentence


@pytest.mark.skipif("HANDEYE_DATA" not in os.environ, reason="HANDEYE_DATA is not set")
def test_a_public_recording_of_pictures(tmp_path: Path) -> None:
    folder = Path(os.environ["HANDEYE_DATA"]) / "rwhe-calib" / "CS_synthetic_1"
    end, prepared, store = replayed(folder, tmp_path / "s", most_views=8)
    assert (end.reason, end.views) == (EndReason.VIEWS_TAKEN, 8)
    assert prepared.recorded is not None
    assert len(prepared.recorded) == 15
    assert all(entry.view is not None and entry.view.image is not None for entry in store.entries)
