"""A camera calibrated from the very pictures that are solved."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from handeye.detection import Detection, calibrate_camera
from handeye.errors import HandeyeError
from handeye.estimation import Measurements
from handeye.estimation.faults import examine
from handeye.types import Camera, Recording, Target, View

# Through a better camera other views may stand out; that comes to rest soon.
MOST_CALIBRATIONS = 3


def camera_of_views(target: Target, found: Mapping[str, Detection], size: tuple[int, int]) -> Camera:
    """Calibrate a camera from what was found in the pictures that will be solved.

    Raises
    ------
    InputError, DegenerateError
        As `calibrate_camera`.
    """
    camera = calibrate_camera(target, found, size).camera
    return Camera(camera.lens, camera.parameters, *camera.size_px, camera.covariance, from_views=True)


def calibrated_from_used_views(recording: Recording) -> Recording:
    """Return a recording whose camera is calibrated from the views and points that solving it uses.

    A view that is left out, such as one of a board that was turned around, has spoilt the camera too. Where
    too little is left, or all views share a mistake, the recording stays as it is: solving it says so.
    """
    before = _points(recording.views)
    for _ in range(MOST_CALIBRATIONS):
        try:
            used = examine(Measurements.of_recording(recording)).measurements.views
            if _points(used) == before:
                break
            found = {view.name: Detection(view.point_ids, view.pixels, view.sigmas_px) for view in used}
            camera = camera_of_views(recording.target, found, recording.camera.size_px)
        except HandeyeError:
            break
        recording, before = replace(recording, camera=camera), _points(used)
    return recording


def _points(views: Sequence[View]) -> dict[str, tuple[int, ...]]:
    return {view.name: tuple(view.point_ids.tolist()) for view in views}
