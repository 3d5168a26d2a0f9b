"""What a calibration found, as far as others need it: from a solve, or from the JSON that a solve wrote."""

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from handeye.codes import Code
from handeye.datasets.reading import MIB, located, read_text
from handeye.errors import InputError
from handeye.export.solved import Rows, Solved
from handeye.types import Camera, Mounting, Pose
from handeye.types.arrays import FloatArray, finite_array
from handeye.types.calibration import Calibration
from handeye.types.plain import read_document

MAX_BYTES = 16 * MIB


@dataclass(frozen=True, eq=False)
class Result:
    """The answer of a calibration.

    Parameters
    ----------
    mounting
        Where the camera sits.
    T_parent_camera
        Pose of the camera in the frame that it is fixed to: `T_flange_camera` or `T_base_camera`.
    T_fixed_target
        Pose of the target in the frame that it is fixed to: `T_base_target` or `T_flange_target`.
    covariance
        (6, 6) covariance of the camera's pose: of a twist in the camera frame, metres and radians.
    camera
        The camera, None if it was not kept.
    recording
        Name of the recording.
    view_count
        Number of views that the answer rests on.
    warnings
        What to know before it is used.
    degrees_of_freedom
        How sure the covariance itself is.
    solved
        All that the solve said; None where it was not one of pictures.

    Examples
    --------
    >>> 1e3 * result.sigma_translation_m < 10.0  # mm
    True
    """

    mounting: Mounting
    T_parent_camera: Pose
    T_fixed_target: Pose
    covariance: FloatArray
    camera: Camera | None = None
    recording: str = ""
    view_count: int = 0
    warnings: tuple[str, ...] = ()
    degrees_of_freedom: float = float("inf")
    solved: Solved | None = None

    @classmethod
    def of(
        cls,
        calibration: Calibration,
        recording: str,
        warnings: Iterable[str] = (),
        **more: Any,  # noqa: ANN401 - further keys of the document
    ) -> "Result":
        """Return the answer of a calibration, with warnings about the recording before its own."""
        table = {**calibration.to_dict(), "recording": recording, **more}
        table["warnings"] = [*warnings, *calibration.warnings]
        return _result(read_document(table, Solved, recording))

    @property
    def sigma_translation_m(self) -> float:
        """Standard deviation of the camera's position: root of the sum of the three variances."""
        return float(np.sqrt(np.trace(self.covariance[:3, :3])))

    @property
    def sigma_rotation_rad(self) -> float:
        """Standard deviation of the camera's rotation: root of the sum of the three variances."""
        return float(np.sqrt(np.trace(self.covariance[3:, 3:])))


def read_result(path: str | os.PathLike[str], camera: str | None = None) -> Result:
    """Read the JSON object that a solve printed or wrote.

    Parameters
    ----------
    path
        The file.
    camera
        The name of one of several cameras.

    Raises
    ------
    InputError
        Not such a file; the message names file and field. Or a camera that is not in it.

    Examples
    --------
    >>> import json
    >>> from handeye.estimation import solve
    >>> _ = Path("answer.json").write_text(json.dumps(solve(recording).to_dict()))
    >>> read_result("answer.json").mounting.value
    'eye_in_hand'
    """
    file = Path(path)
    document = read_document(_of_camera(_read_json(file), camera, file), Solved, str(file))
    with located(str(file)):
        return _result(document)


def _result(document: Solved) -> Result:
    poses: list[Pose] = []
    for name in document.mounting.result_names:
        rows = cast("Rows | None", getattr(document, name))
        if rows is None:
            raise InputError(
                f"{name} is missing, though mounting is {document.mounting.value}", code=Code.INVALID_FIELD
            )
        with located(name):
            poses.append(Pose(rows))
    freedom = document.degrees_of_freedom
    return Result(
        document.mounting,
        *poses,
        covariance=_covariance(document.covariance),
        camera=None if document.camera is None else Camera.from_dict(document.camera),
        recording=document.recording,
        view_count=len(document.views.used),
        warnings=_once([*(found.sentence for found in document.unobservable), *document.warnings]),
        degrees_of_freedom=float("inf") if freedom is None else freedom,
        solved=document,
    )


def _of_camera(table: dict[str, Any], camera: str | None, file: Path) -> dict[str, Any]:
    """Return the answer of one camera, where a solve had several."""
    cameras = table.get("cameras")
    if cameras is None and camera is None:
        return table
    found = cast("dict[str, Any]", cameras) if isinstance(cameras, dict) else {}
    chosen = found.get(camera or "")
    if not isinstance(chosen, dict):
        asked = "" if camera is None else f"no camera {camera[:60]!r}; "
        raise InputError(
            f"{file}: {asked}{len(found)} cameras ({', '.join(map(str, found))[:100]})",
            code=Code.SEVERAL_CAMERAS if found else Code.INVALID_FIELD,
            hint="name one with --only" if found else "leave --only out: the answer is that of one camera",
        )
    return {"recording": table.get("recording", ""), **cast("dict[str, Any]", chosen)}


def _read_json(file: Path) -> dict[str, Any]:
    """Return the JSON object in a file that a solve wrote.

    Raises
    ------
    InputError
        It cannot be read, is no JSON object, or says that the solve failed.
    """
    text = read_text(file, MAX_BYTES)
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file}: not JSON: {error}", code=Code.NOT_JSON) from error
    if not isinstance(data, dict):
        raise InputError(f"{file}: expected the JSON object that a solve writes", code=Code.INVALID_FIELD)
    table = cast("dict[str, Any]", data)
    if "error" in table and not {"mounting", "cameras"} & set(table):
        raise InputError(
            f"{file}: no result but an error",
            code=Code.NO_RESULT,
            hint="look at the message in it and solve again",
        )
    return table


def _covariance(rows: Rows) -> FloatArray:
    covariance = finite_array(rows, (6, 6), "covariance")
    scale = np.sqrt(np.abs(np.outer(np.diag(covariance), np.diag(covariance))))
    symmetric = bool(np.all(np.abs(covariance - covariance.T) <= 1e-6 * scale))
    if not symmetric or bool(np.any(np.diag(covariance) < 0)):
        raise InputError("covariance: not symmetric, or a variance below zero", code=Code.INVALID_FIELD)
    return covariance


def _once(sentences: list[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(sentences))
