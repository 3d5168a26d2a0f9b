"""Simulated cells driven under every policy: the same cells, the same starts, an honest comparison."""

from pathlib import Path

import numpy as np
import pytest

from handeye.datasets import read_recording
from handeye.errors import InputError, OutputError
from handeye.studies.closed_loop import ClosedLoop, LoopOptions, camera_poses, drive_cells
from handeye.studies.closed_loop_picture import closed_loop_figure
from handeye.studies.comparison import POLICIES

OPTIONS = LoopOptions(cells=1, added_views=2, seed=3, points_only=0.1)


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> ClosedLoop:
    return drive_cells(OPTIONS, tmp_path_factory.mktemp("loop") / "session")


def test_all_policies_start_from_the_same_views_and_then_part(shown: ClosedLoop) -> None:
    goals = {
        policy: [entry.goal.matrix for entry in drives[0].entries] for policy, drives in shown.drives.items()
    }
    for policy in POLICIES[1:]:
        assert np.array_equal(goals[policy][:3], goals[POLICIES[0]][:3])
        assert not np.allclose(goals[policy][3], goals[POLICIES[0]][3])
        assert shown.drives[policy][0].translation_mm[0] == shown.shown.translation_mm[0]


def test_the_session_kept_is_the_run_shown(shown: ClosedLoop) -> None:
    recording = read_recording(shown.folder).recording
    assert recording.truth is not None
    assert recording.truth.X is not None
    assert len(recording) == OPTIONS.views[-1] == 5
    off = (shown.shown.X @ recording.truth.X.inverse()).log()
    assert 1e3 * np.linalg.norm(off[:3]) == pytest.approx(shown.shown.translation_mm[-1])
    # Every promise is about the error beside it, in the same unit.
    assert 0.01 < shown.shown.translation_mm[-1] / shown.shown.within_mm[-1] < 2
    # The cameras look down at a board that lies before them; its origin is a corner, nearer than its middle may be.
    for pose in camera_poses(shown.shown):
        assert (shown.shown.Y.translation - pose.translation) @ pose.rotation[:, 2] > 0.1


def test_the_sentence_names_the_policies_by_their_numbers(shown: ClosedLoop) -> None:
    final = {policy: shown.values(policy, "translation_mm")[0, -1] for policy in POLICIES}
    first, second, third = (f"{value:.2g} mm" for value in sorted(final.values()))
    assert shown.sentence.index(first) <= shown.sentence.index(second) <= shown.sentence.index(third)


def test_workers_change_nothing(shown: ClosedLoop, tmp_path: Path) -> None:
    again = drive_cells(OPTIONS, tmp_path / "session", workers=2)
    assert again.to_dict() == shown.to_dict()


def test_picture_has_a_panel_for_each_question(shown: ClosedLoop) -> None:
    titles = [axis.get_title(loc="left") for axis in closed_loop_figure(shown).axes]
    # Points were projected: there are no pictures of the camera to show.
    assert titles == [
        "The loop chooses and drives",
        "What choosing views is worth",
        "Whether it can be trusted",
    ]


def test_what_cannot_be_driven_is_refused(shown: ClosedLoop) -> None:
    with pytest.raises(InputError):
        LoopOptions(cells=0)
    with pytest.raises(OutputError):
        drive_cells(OPTIONS, shown.folder)
