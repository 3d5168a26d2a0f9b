"""Made-up rigs: the same for the same number, seen from in front, with the truth beside them."""

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.simulation.cells import OF_THE_ARM, ErrorKind
from handeye.simulation.rigs import RigOptions, simulate_rig
from handeye.types import Body
from handeye.types.rig import RigTruth


def test_the_same_number_is_the_same_rig() -> None:
    first, again = (simulate_rig(ErrorKind.MIXTURE_CELL, 3, RigOptions(stations=4)) for _ in range(2))
    assert first == again
    assert first != simulate_rig(ErrorKind.MIXTURE_CELL, 4, RigOptions(stations=4))
    assert {one.body for one in first.cameras.values()} == set(Body)
    assert all(len({view.camera for view in station.views}) >= 3 for station in first.stations)


@pytest.mark.parametrize("number", range(3))
def test_pixels_are_those_of_the_truth_where_nothing_is_wrong_but_the_pixels(number: int) -> None:
    recording = simulate_rig(ErrorKind.PIXEL_ONLY, number, RigOptions(stations=4))
    truth = recording.truth or RigTruth()
    for camera, target in recording.pairs:
        if not recording.moves(camera, target):
            continue
        one = recording.pair(camera, target)
        for view in one.views:
            chain = truth.cameras[camera] @ one.mounting.chain(view.T_base_flange) @ truth.targets[target]
            points = one.target.points @ chain.rotation.T + chain.translation
            pixels, seen = one.camera.project(points)
            assert seen.all()
            # The lens is known from a calibration only: a pixel or two.
            assert np.sqrt(np.mean((pixels - view.pixels) ** 2)) < 4.0


@pytest.mark.parametrize("kind", sorted(set(ErrorKind) - set(OF_THE_ARM)))
def test_errors_that_a_rig_does_not_have_are_refused(kind: ErrorKind) -> None:
    with pytest.raises(InputError, match=kind.value) as refused:
        simulate_rig(kind, 0)
    assert "mixture_random" in (refused.value.hint or "")
