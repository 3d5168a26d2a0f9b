"""A camera that nobody has calibrated: it is found from the session's own views, again after every view.

The same views always lead to the same camera, so a session that was broken off goes on as if it had not been.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.detection import CameraCalibration, Detection, calibrate_camera
from handeye.errors import HandeyeError, InputError
from handeye.types import Camera, Recording, Target, View
from handeye.types.ordinary_lens import DISTORTION_SIGMAS, ordinary_lens

SETTING = "self_calibration"
# Until something is known: as wide as it is far away.
NOMINAL_FOCAL = 1.0
# A view that fits so many times worse than the median, and worse than this, does not teach the camera.
OUTLIER_RATIO, OUTLIER_PX = 3.0, 1.0
# Fewer views than these cannot speak against one of them.
FEWEST_VIEWS = 5


def nominal_camera(size_px: tuple[int, int], lens: str | None = None) -> Camera:
    """Return what is believed of a camera before its first picture; its covariance is wide.

    Raises
    ------
    InputError
        A lens that cannot be found from few views.
    """
    names = list(DISTORTION_SIGMAS)
    if lens is not None and lens not in names:
        raise InputError(
            f"lens {lens!r}, expected one of {', '.join(names)}",
            code=Code.UNKNOWN_LENS,
            hint="other lenses need a calibration of their own: give it with --camera",
        )
    model = lens or names[0]
    mean, sigmas = ordinary_lens(model, size_px, NOMINAL_FOCAL * size_px[0])
    return Camera(model, mean, *size_px, np.diag(sigmas**2))


class SelfCalibration:
    """Finds the camera of a session from its views.

    Parameters
    ----------
    target
        What the views show.
    size_px
        Width and height of the images.
    lens
        Name of the lens; None to have the views choose.
    """

    def __init__(self, target: Target, size_px: tuple[int, int], lens: str | None = None) -> None:
        self._target, self._size_px, self._lens = target, size_px, lens
        self._known: list[tuple[tuple[View, ...], Camera | None]] = []

    @classmethod
    def of_session(cls, asked: Mapping[str, Any], begun_with: Recording) -> "SelfCalibration | None":
        """Return what a session's settings ask for; None where its camera was given."""
        setting = asked.get(SETTING)
        if not isinstance(setting, Mapping):
            return None
        lens = setting.get("lens")  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
        return cls(begun_with.target, begun_with.camera.size_px, None if lens is None else str(lens))  # pyright: ignore[reportUnknownArgumentType]

    def setting(self) -> dict[str, Any]:
        """Return plain values for a session's settings; `of_session` reads them back."""
        return {SETTING: {"lens": self._lens}}

    def camera(self, views: Sequence[View]) -> Camera | None:
        """Return the camera that views teach, with its covariance; None where they do not determine it."""
        for known, camera in self._known:
            if len(known) == len(views) and all(a is b for a, b in zip(known, views, strict=True)):
                return camera
        camera = self._found(views)
        self._known = [*self._known[-1:], (tuple(views), camera)]
        return camera

    def _found(self, views: Sequence[View]) -> Camera | None:
        found = {view.name: Detection(view.point_ids, view.pixels) for view in views}
        try:
            fit = calibrate_camera(self._target, found, self._size_px, lens=self._lens, ordinary=True)
            # One after the other: a wrong view makes others look wrong too.
            while (worst := _outlier(fit)) is not None:
                del found[worst]
                fit = calibrate_camera(self._target, found, self._size_px, lens=self._lens, ordinary=True)
        except HandeyeError:
            return None
        camera = fit.camera
        return Camera(camera.lens, camera.parameters, *camera.size_px, camera.covariance, from_views=True)

    def put_into(self, recording: Recording) -> Recording:
        """Return a recording with the camera that its views teach; as it is while they do not."""
        camera = self.camera(recording.views)
        return recording if camera is None else replace(recording, camera=camera)


def _outlier(fit: CameraCalibration) -> str | None:
    """Return the view that fits worst, if it fits much worse than the others."""
    errors = fit.view_rmse_px
    if len(errors) < FEWEST_VIEWS:
        return None
    worst = max(errors, key=lambda name: errors[name])
    limit = max(OUTLIER_PX, OUTLIER_RATIO * float(np.median(list(errors.values()))))
    return worst if errors[worst] > limit else None


def same_camera(one: Camera, other: Camera) -> bool:
    """Tell whether two cameras are the same but for the rounding of another machine."""
    return (
        one.lens == other.lens
        and one.size_px == other.size_px
        and one.from_views == other.from_views
        and bool(np.allclose(one.parameters, other.parameters, rtol=1e-6, atol=1e-6))
    )
