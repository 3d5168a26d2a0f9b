"""Our own camera: the fields of `[camera]` in a recording, alone or in a table `camera`."""

from typing import Any, cast

from handeye.datasets.camera_files.base import CameraFormat, Table
from handeye.types import Camera


def _inner(document: Table) -> dict[str, Any]:
    camera = document.get("camera", document)
    return dict(cast("dict[str, Any]", camera)) if isinstance(camera, dict) else {"camera": camera}


def _recognises(document: Table) -> bool:
    return "lens" in _inner(document) or "camera" in document


def _read(document: Table) -> Camera:
    return Camera.from_dict(_inner(document))


FORMAT = CameraFormat("a camera of handeye", _recognises, _read)
