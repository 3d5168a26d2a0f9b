"""The paper's table I taken apart: what of the difference comes from the corners, and what from the camera.

The same protocol, 3 random views and 5 more by each policy, on the simulated sets of Ali et al. (2019): with
OpenCV's corners and camera in the paper's model, with our corners in the same model, and with the default.
The robot poses of these sets carry no noise, so nothing there is about the arm. Their real sets have no
truth: there the same three rows are judged by a third of the views, held out, and by how well halves agree.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from handeye.codes import Code
from handeye.compute.parallel import Progress, Workers, part_of
from handeye.datasets.images import read_image
from handeye.errors import InputError
from handeye.studies.comparison import Comparison, SetResult, compare, piece_count, pooled
from handeye.studies.data import find_set
from handeye.studies.holdout import study_holdout
from handeye.studies.protocol import Protocol
from handeye.types import Camera, Chessboard, Recording, View
from handeye.types.calibration import ModelName

# Table I as printed: millimetres and degrees (Yang, Rebello and Waslander 2023).
PRINTED = {
    "next_best_view": {"translation_mm": 2.95, "rotation_deg": 0.015},
    "random": {"translation_mm": 4.12, "rotation_deg": 0.016},
    "max_distance": {"translation_mm": 4.74, "rotation_deg": 0.014},
}
# Half the window of `cornerSubPix` and its end, as in OpenCV's tutorial.
WINDOW, MOST_STEPS, SMALL_STEP = (11, 11), 30, 1e-3
NEAR_PX = 5.0


@dataclass(frozen=True)
class Table1Parts:
    """Errors after the last view: by row and policy, all sets together."""

    seed: int
    trials: int
    rows: dict[str, tuple[SetResult, ...]]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        measured = {
            row: {
                policy: {
                    name: float(np.mean(pooled(sets, policy, name)))
                    for name in ("translation_mm", "rotation_deg")
                }
                for policy in PRINTED
            }
            for row, sets in self.rows.items()
        }
        rows = {"printed": PRINTED, **measured}
        mm = {row: found["next_best_view"]["translation_mm"] for row, found in rows.items()}
        return {
            "seed": self.seed,
            "trials_per_set": self.trials,
            "rows": rows,
            "factor_of_corners": mm["opencv_corners"] / mm["our_corners"],
            "factor_of_camera": mm["our_corners"] / mm["default"],
        }


def study_table1_parts(
    folder: Path,
    recordings: Sequence[Recording],
    *,
    trials: int = 20,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Table1Parts:
    """Run the protocol of table I three times, with one thing changed each time.

    Parameters
    ----------
    folder
        Folder that holds the sets of the recordings.

    Raises
    ------
    InputError
        A set is missing, or its target is no chessboard.
    """
    protocol = Protocol(trials=trials, seed=seed)
    cases = _cases(folder, recordings)
    count = piece_count(len(recordings), protocol)
    rows: dict[str, tuple[SetResult, ...]] = {}
    for number, (name, sets, model) in enumerate(cases):
        told = part_of(progress, number * count, len(cases) * count)
        comparison = Comparison(protocol, model)
        rows[name] = tuple(compare(sets, comparison, workers=workers, progress=told))
    return Table1Parts(seed, trials, rows)


def study_real_parts(
    folder: Path,
    recordings: Sequence[Recording],
    *,
    trials: int = 20,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> dict[str, dict[str, Any]]:
    """Run the same three rows on sets without truth; return means by set and row.

    Parameters
    ----------
    folder
        Folder that holds the sets of the recordings.

    Raises
    ------
    InputError
        A set is missing, its target is no chessboard, or it has too few views.
    """
    cases = _cases(folder, recordings)
    found: dict[str, dict[str, Any]] = {one.name: {} for one in recordings}
    for number, (row, sets, model) in enumerate(cases):
        result = study_holdout(sets, model=model, trials=trials, seed=seed, workers=workers)
        for name, one in result.to_dict()["sets"].items():
            found[name][row] = {
                **{
                    policy: {
                        "translation_mm": part["relative_translation_mm"]["mean"],
                        "rotation_deg": part["relative_rotation_deg"]["mean"],
                    }
                    for policy, part in one["policies"].items()
                },
                "halves": {
                    "translation_mm": one["split_half_translation_mm"]["mean"],
                    "rotation_deg": one["split_half_rotation_deg"]["mean"],
                },
            }
        if progress is not None:
            progress(number + 1, len(cases))
    return found


def _cases(
    folder: Path, recordings: Sequence[Recording]
) -> tuple[tuple[str, Sequence[Recording], ModelName], ...]:
    """Return the rows: their name, the recordings, the model."""
    theirs = [with_opencv_corners(one, find_set(folder, one.name)) for one in recordings]
    return (
        ("opencv_corners", theirs, ModelName.PAPER),
        ("our_corners", recordings, ModelName.PAPER),
        ("default", recordings, ModelName.AUTO),
    )


def with_opencv_corners(recording: Recording, place: Path) -> Recording:
    """Return a recording with the corners and the camera that OpenCV finds in its pictures.

    Corners get the ids of those of ours that they lie next to, so that both name the board's symmetry alike.

    Raises
    ------
    InputError
        No chessboard, or pictures that are not there.
    """
    target = recording.target
    if not isinstance(target, Chessboard):
        raise InputError(f"{recording.name}: not a chessboard", code=Code.UNSUPPORTED_TARGET)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, MOST_STEPS, SMALL_STEP)
    views: list[View] = []
    for view in recording.views:
        image = read_image(place / f"{view.name}.png")
        found, corners = cv2.findChessboardCorners(image, (target.columns, target.rows))
        if not found:
            continue
        pixels = cv2.cornerSubPix(image, corners, WINDOW, (-1, -1), criteria).reshape(-1, 2).astype(float)
        distances = np.linalg.norm(view.pixels[:, np.newaxis] - pixels, axis=2)
        nearest = distances.argmin(axis=1)
        kept = distances[np.arange(len(nearest)), nearest] < NEAR_PX
        views.append(
            replace(view, point_ids=view.point_ids[kept], pixels=pixels[nearest[kept]], sigmas_px=None)
        )
    size = recording.camera.size_px
    _, matrix, distortion, _, _ = cv2.calibrateCamera(
        [target.points[view.point_ids].astype(np.float32) for view in views],
        [view.pixels.astype(np.float32) for view in views],
        size,
        np.eye(3),
        np.zeros(5),
    )
    parameters = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *np.ravel(distortion)[:5]]
    camera = Camera("brown_conrady_5", np.array(parameters), *size)
    return replace(recording, views=tuple(views), camera=camera)
