"""Robot poses that were not read again are named; two pictures of one stop are no mistake."""

from dataclasses import replace

import numpy as np
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
    noise = np.random.default_rng(0).normal(0, 0.1, (3, *recording.views[0].pixels.shape))
    again = [
        replace(view, name=f"again_{view.name}", pixels=view.pixels + more)
        for view, more in zip(recording.views, noise, strict=False)
    ]
    assert len(solve(recording.with_views([*recording.views, *again])).used) == 11


def test_a_view_that_is_there_twice_counts_once() -> None:
    recording = simulate(ErrorKind.PIXEL_ONLY, 1, CellOptions(views=(8, 8)))
    twice = [*recording.views, *(replace(v, name=f"again_{v.name}") for v in recording.views[:3])]
    calibration = solve(recording.with_views(twice))
    assert calibration.used == tuple(view.name for view in recording.views)
    (finding,) = (f for f in calibration.diagnosis if f.code == "view_repeated")
    assert finding.evidence["same_as"] == {f"again_{v.name}": v.name for v in recording.views[:3]}
