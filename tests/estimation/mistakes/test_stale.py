"""Robot poses that were not read again are named; two pictures of one stop are no mistake."""

from dataclasses import replace

import pytest

from handeye.errors import InputError
from handeye.estimation import solve
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Mounting


@pytest.mark.parametrize("mounting", list(Mounting))
@pytest.mark.parametrize("step", [1, 2, 3])
def test_poses_that_were_not_read_again_are_named(mounting: Mounting, step: int) -> None:
    for number in range(4):
        recording = simulate(ErrorKind.WHITE_FLANGE, number, CellOptions(views=(12, 12), mounting=mounting))
        views = [
            view
            if k < step or k % (step + 1) == 0
            else replace(view, T_base_flange=recording.views[k - step].T_base_flange)
            for k, view in enumerate(recording.views)
        ]
        with pytest.raises(InputError, match="the same to the last digit") as caught:
            solve(recording.with_views(views))
        assert "view_0" in caught.value.message


def test_two_pictures_of_one_stop_are_no_mistake() -> None:
    recording = simulate(ErrorKind.PIXEL_ONLY, 1, CellOptions(views=(8, 8)))
    twice = [*recording.views, *(replace(v, name=f"again_{v.name}") for v in recording.views[:3])]
    assert len(solve(recording.with_views(twice)).used) == 11
