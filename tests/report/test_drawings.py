"""Camera pictures on the page: what was found drawn over them, and why in some it was not."""

import base64
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from handeye.importing import Opened
from handeye.report.drawings import SIDE_PX, drawings_of
from handeye.types import Recording, View
from pages import opened_cell


def opened(folder: Path) -> Opened:
    """A cell of which one picture is kept, one is damaged, one shows nothing, and the others are not kept."""
    cell = opened_cell(missed={"none.png": "no board in sight"})
    first, second, *others = cell.recording.views
    size = (cell.recording.camera.height_px, cell.recording.camera.width_px)
    for name in ("first.png", "none.png"):
        cv2.imwrite(str(folder / name), np.full(size, 128, dtype=np.uint8))
    (folder / "second.png").write_bytes(b"no picture")
    kept = [
        View(view.name, view.T_base_flange, view.point_ids, view.pixels, f"{name}.png")
        for name, view in (("first", first), ("second", second))
    ]
    r = cell.recording
    recording = Recording(r.name, r.mounting, r.camera, r.target, (*kept, *others), r.truth, r.source)
    return replace(cell, recording=recording, folder=folder)


def test_each_picture_that_is_kept_is_drawn(tmp_path: Path) -> None:
    cell = opened(tmp_path)
    missed, first, second = drawings_of(cell)
    assert (missed.name, missed.note) == ("none.png", "no board in sight")
    assert first.note == f"{len(cell.recording.views[0])} points"
    assert second.uri == ""
    assert "second.png" in second.note
    for drawing in (missed, first):
        kind, _, content = drawing.uri.partition(",")
        assert kind == "data:image/jpeg;base64"
        picture = cv2.imdecode(np.frombuffer(base64.b64decode(content), np.uint8), 1)
        assert max(picture.shape) <= SIDE_PX
        # Something coloured is drawn over the grey.
        assert np.ptp(picture.astype(int), axis=2).max() > 60
