"""A camera of the pictures themselves: from those that are used, not from those that are left out."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.detection import Detection
from handeye.importing.own_camera import calibrated_from_used_views, camera_of_views
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Camera, Recording


def with_own_camera(recording: Recording) -> Recording:
    found = {view.name: Detection(view.point_ids, view.pixels) for view in recording.views}
    return replace(recording, camera=camera_of_views(recording.target, found, recording.camera.size_px))


def error(camera: Camera, truth: Camera) -> float:
    return float(np.abs(camera.parameters[:4] - truth.parameters[:4]).max())


@pytest.mark.parametrize("number", range(3))
def test_a_picture_turned_around_does_not_spoil_the_camera(number: int) -> None:
    options = CellOptions(views=(14, 14))
    cell = simulate(ErrorKind.SAME_PICTURES, number, options, seed=3)
    turned = cell.views[4]
    others = tuple(view for view in cell.views if view is not turned)
    clean = with_own_camera(replace(cell, views=others)).camera
    corner = np.array(cell.camera.size_px) - 1.0
    views = tuple(replace(v, pixels=corner - v.pixels) if v is turned else v for v in cell.views)
    spoilt = with_own_camera(replace(cell, views=views))
    mended = calibrated_from_used_views(spoilt)
    assert mended.views == spoilt.views
    assert mended.camera.from_views
    assert error(spoilt.camera, clean) > 0.1
    assert error(mended.camera, clean) < 1e-6


def test_where_all_views_are_used_nothing_changes() -> None:
    cell = with_own_camera(simulate(ErrorKind.SAME_PICTURES, 1, CellOptions(views=(10, 10)), seed=3))
    assert calibrated_from_used_views(cell) is cell
