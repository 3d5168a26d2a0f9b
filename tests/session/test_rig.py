"""The loop on a rig: it ends as asked, and goes on after kills and faults as if nothing had been."""

from pathlib import Path

import pytest

from handeye.datasets import read_rig
from handeye.errors import InputError
from handeye.planning.rig import RigRequest
from handeye.session.faults import FaultRates
from handeye.session.rig import RigEndReason, RigWish, open_or_create
from handeye.studies.rig_loop import drive, judged, rig_cell
from handeye.types import Station

WISH = RigWish(request=None, most_stations=7, candidates=60, seed=3)


class Killed(BaseException):
    """The process is gone."""


def test_a_request_for_all_cameras_is_met_and_kept() -> None:
    wish = RigWish(request=RigRequest(1.5, 0.15), candidates=100)
    cell = rig_cell(5)
    end = drive(cell, wish)
    assert end.reason is RigEndReason.ACCURACY_REACHED
    run = judged(cell, end, wish)
    assert set(run.inside) == {"left", "right", "front", "side"}
    assert all(run.inside.values())


@pytest.mark.parametrize("after", [1, 4, 6])
def test_a_run_that_is_killed_goes_on_as_if_nothing_had_been(tmp_path: Path, after: int) -> None:
    whole = drive(rig_cell(3), WISH, tmp_path / "whole").recording

    def kill(station: Station, estimate: object) -> None:
        del estimate
        if station.name == f"station_{after:02d}":
            raise Killed

    with pytest.raises(Killed):
        drive(rig_cell(3), WISH, tmp_path / "killed", taken=kill)
    assert len(read_rig(tmp_path / "killed").recording) == after
    # A file that the next station had begun to leave is no trouble.
    (tmp_path / "killed" / "corners" / f"station_{after + 1:02d}.left.table.csv").write_text("id,u_px")
    end = drive(rig_cell(3), WISH, tmp_path / "killed")
    assert end.recording == whole
    assert read_rig(tmp_path / "killed").recording == end.recording


def test_drivers_that_fail_cost_attempts_but_no_station(tmp_path: Path) -> None:
    rates = FaultRates(refused=0.2, robot_dies=0.2, off_target=0.2)
    end = drive(rig_cell(4, faults=rates), WISH, tmp_path / "faults")
    assert end.reason is RigEndReason.STATIONS_TAKEN
    assert end.attempts > len(end.recording) == 7
    never = drive(rig_cell(4, faults=FaultRates(refused=1.0)), WISH)
    assert never.reason is RigEndReason.TOO_MANY_FAILURES
    assert len(never.recording) == 0


def test_the_folder_of_another_cell_is_refused(tmp_path: Path) -> None:
    open_or_create(tmp_path / "a", rig_cell(1).empty)
    with pytest.raises(InputError) as caught:
        open_or_create(tmp_path / "a", rig_cell(2).empty)
    assert caught.value.code == "other_cell"
