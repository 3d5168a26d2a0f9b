"""The samples of easy_handeye2, `~/.ros2/easy_handeye2/samples/NAME.samples`.

::

    parameters: {calibration_type: '', ...}          written empty by the tool itself
    samples:
    - robot:    {translation: {x, y, z}, rotation: {x, y, z, w}}
      tracking: {translation: {x, y, z}, rotation: {x, y, z, w}}

Source: easy_handeye2, `handeye_sampler.py` and `easy_handeye2_msgs`. For a camera in the hand `robot` is the
effector in the base, for one beside the robot the base in the effector: the middle of the chain is the
inverse of `robot` both times, so the samples cannot tell the two apart. `tracking` is `T_camera_target`.
Lengths are metres.
"""

from pathlib import Path

import msgspec

from handeye.codes import Code
from handeye.datasets.image_set import ImportOptions
from handeye.datasets.importer import Importer
from handeye.datasets.plausibility import pose_warnings
from handeye.datasets.pose_pairs import PosePairs, numbered
from handeye.datasets.reading import is_file, located
from handeye.datasets.yaml_reading import read_yaml
from handeye.errors import InputError
from handeye.types import Mounting, Pose
from handeye.types.plain import read_document

SUFFIX = ".samples"
_TYPES = {"eye_in_hand": Mounting.EYE_IN_HAND, "eye_on_base": Mounting.EYE_TO_HAND}


class Vector(msgspec.Struct):
    """A translation in metres."""

    x: float
    y: float
    z: float


class Quaternion(msgspec.Struct):
    """A unit quaternion."""

    x: float
    y: float
    z: float
    w: float


class Transform(msgspec.Struct):
    """A transform as ROS writes it."""

    translation: Vector
    rotation: Quaternion

    @property
    def pose(self) -> Pose:
        """The transform; raises `InputError` where the quaternion is not of norm 1."""
        t, q = self.translation, self.rotation
        return Pose.from_quaternion([t.x, t.y, t.z], [q.x, q.y, q.z, q.w])


class _Sample(msgspec.Struct):
    robot: Transform
    tracking: Transform


class _Parameters(msgspec.Struct):
    calibration_type: str = ""


class _Document(msgspec.Struct):
    samples: list[_Sample]
    parameters: _Parameters = msgspec.field(default_factory=_Parameters)


def recognises(path: Path) -> bool:
    """Tell whether it is a file of samples."""
    return path.suffix == SUFFIX and is_file(path)


def read(path: Path, options: ImportOptions) -> PosePairs:
    """Read a file of samples.

    Raises
    ------
    InputError
        Not such a file, a quaternion that is not of norm 1, or nothing that says where the camera sits.
    """
    document = read_document(read_yaml(path), _Document, str(path), lax=True)
    mounting = options.mounting or _TYPES.get(document.parameters.calibration_type)
    if mounting is None:
        raise InputError(
            f"{path}: the samples do not say where the camera sits; easy_handeye2 leaves it out",
            code=Code.MOUNTING_UNSTATED,
            hint="state --mounting eye_in_hand or eye_to_hand; the numbers fit both",
        )
    poses: list[tuple[Pose, Pose]] = []
    for index, sample in enumerate(document.samples, start=1):
        with located(f"{path}: sample {index}"):
            robot = sample.robot.pose
            base_flange = robot if mounting is Mounting.EYE_IN_HAND else robot.inverse()
            poses.append((base_flange, sample.tracking.pose))
    pairs = numbered(poses)
    return PosePairs(
        name=path.stem,
        layout=IMPORTER.name,
        mounting=mounting,
        pairs=pairs,
        source=f"samples of easy_handeye2, {path.name}",
        warnings=tuple(pose_warnings((pair.name, pair.T_base_flange) for pair in pairs)),
    )


IMPORTER = Importer("easy_handeye2", f"a file {SUFFIX} of easy_handeye2", recognises, read)
