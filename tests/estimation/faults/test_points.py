"""Gross points are found, all of them and no others."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.estimation import Measurements
from handeye.estimation.faults.points import without_gross_points
from handeye.studies.planted import made_up


def test_clean_points_stay() -> None:
    measurements = Measurements.of_recording(made_up(0, 3))
    assert without_gross_points(measurements) == (measurements, ())


@pytest.mark.parametrize(("number", "share"), [(0, 0.02), (0, 0.2), (1, 0.1), (1, 0.3)])
def test_gross_points_are_left_out(number: int, share: float) -> None:
    clean = made_up(number, 3)
    random = np.random.default_rng(number)
    view = clean.views[2]
    bad = random.choice(len(view), max(1, int(share * len(view))), replace=False)
    pixels = view.pixels.copy()
    towards_middle = np.sign([640.0, 512.0] - pixels[bad])
    pixels[bad] += towards_middle * random.uniform(3, 60, (len(bad), 2))
    views = list(clean.views)
    views[2] = replace(view, pixels=pixels)
    kept, findings = without_gross_points(Measurements.of_recording(clean.with_views(views)))
    assert [f.code for f in findings] == ["points_outlying"]
    assert sorted(findings[0].evidence["points"][view.name]) == sorted(view.point_ids[bad].tolist())
    assert len(kept.views[2]) == len(view) - len(bad)
    assert kept.poses[2].rmse_px < 1.0


def test_a_view_that_does_not_show_the_board_is_left_out() -> None:
    clean = made_up(0, 3)
    views = list(clean.views)
    order = np.random.default_rng(0).permutation(len(views[1]))
    views[1] = replace(views[1], pixels=views[1].pixels[order])
    measurements = Measurements.of_recording(clean.with_views(views))
    kept, findings = without_gross_points(measurements)
    name = views[1].name
    assert name in kept.rejected
    # Either no pose was found at all, or it was seen to be none.
    assert name in measurements.rejected or [f.code for f in findings] == ["view_misdetected"]
