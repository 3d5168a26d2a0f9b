"""The layout of industrial_calibration as it is today: one file with everything.

::

    data: [{pose: poses/0.yaml, image: images/0.png}, ...]       paths relative to the file
    target_finder: {type: CharucoGridTargetFinder, rows, cols, chessboard_dim, aruco_marker_dim, dictionary}
    intrinsics: {fx, fy, cx, cy}
    static_camera: false                                         true: the camera stands beside the robot

Source: ros-industrial/industrial_calibration, `examples/data` and `extrinsic_hand_eye`. Poses and targets are
those of `handeye.datasets.robot_cal_tools`.
"""

from collections.abc import Mapping
from pathlib import Path

import msgspec

from handeye.codes import Code
from handeye.datasets import robot_cal_tools
from handeye.datasets.image_set import ImageSet, ImportOptions, common_image_size
from handeye.datasets.importer import Importer
from handeye.datasets.plausibility import camera_warnings, pose_warnings, target_warnings
from handeye.datasets.reading import is_file, located
from handeye.datasets.yaml_reading import read_yaml
from handeye.errors import InputError
from handeye.types import Camera, Mounting
from handeye.types.plain import read_document

FILE = "cal_data.yaml"


class _Document(msgspec.Struct):
    data: list[robot_cal_tools.Entry]
    target_finder: robot_cal_tools.Finder | None = None
    intrinsics: robot_cal_tools.Intrinsics | None = None
    static_camera: str = "false"


def recognises(path: Path) -> bool:
    """Tell whether a file, or the file in a folder, holds data and target together."""
    file = path / FILE if path.is_dir() else path
    if file.suffix.lower() not in {".yaml", ".yml"} or not is_file(file):
        return False
    try:
        document = read_yaml(file)
    except InputError:
        return False
    return isinstance(document, Mapping) and "data" in document and "target_finder" in document


def read(path: Path, options: ImportOptions) -> ImageSet:
    """Read a set.

    Raises
    ------
    InputError
        A file that is missing or not what it should be, or a kind of target that is not known here.
    """
    file = path / FILE if path.is_dir() else path
    folder = file.parent
    document = read_document(read_yaml(file), _Document, str(file), lax=True)
    shots = robot_cal_tools.shots_of(document.data, file)
    size = common_image_size(folder, shots)
    target, warnings = options.target, ()
    if target is None:
        if document.target_finder is None:
            raise InputError(f"{file}: target_finder is missing", code=Code.INVALID_FIELD)
        with located(str(file)):
            target, warnings = robot_cal_tools.target_of(document.target_finder)
    camera = None
    if document.intrinsics is not None and size is not None:
        k = document.intrinsics
        with located(str(file)):
            camera = Camera("pinhole", [k.fx, k.fy, k.cx, k.cy], *size)
    beside = document.static_camera.strip().lower() in {"true", "yes", "on", "1"}
    named_poses = ((shot.name, shot.T_base_flange) for shot in shots)
    return ImageSet(
        name=folder.resolve().name,
        layout=IMPORTER.name,
        folder=folder,
        mounting=options.mounting or (Mounting.EYE_TO_HAND if beside else Mounting.EYE_IN_HAND),
        target=target,
        shots=shots,
        image_size_px=size,
        camera=camera,
        source=f"industrial_calibration, {file.name} in folder {folder.resolve().name}",
        warnings=(
            *warnings,
            *(() if camera is None else camera_warnings(camera)),
            *pose_warnings(named_poses),
            *target_warnings(target),
        ),
    )


IMPORTER = Importer(
    "industrial_calibration", f"a folder with {FILE} that holds data and target_finder", recognises, read
)
