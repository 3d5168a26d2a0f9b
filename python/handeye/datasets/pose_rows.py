"""Rows of numbers that stand for robot poses, before it is said what they mean, and the ways to read them."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from handeye.codes import Code
from handeye.datasets.reading import located
from handeye.errors import InputError
from handeye.notations import EULER, MAKERS, NOTATIONS, PLAIN, Direction, Notation, Unit
from handeye.notations.forms import Euler, Quaternion, RotationVector, Vector
from handeye.types import Pose
from handeye.types.arrays import FloatArray

QUATERNION = ("qx", "qy", "qz", "qw")
ROTATION_VECTOR = ("rvx", "rvy", "rvz")
POSITION = ("x", "y", "z")
# Units that are tried where none is said.
TRIED_UNITS = (Unit.MM, Unit.M, Unit.CM)


@dataclass(frozen=True)
class Statement:
    """What is said about poses: by the caller or in the file.

    Parameters
    ----------
    notation
        How they are written.
    unit
        Unit of their lengths.
    direction
        Whose pose in which frame.

    Examples
    --------
    >>> from handeye.notations import NOTATIONS
    >>> Statement(NOTATIONS["kuka"]).unit is None  # still to be told
    True
    """

    notation: Notation | None = None
    unit: Unit | None = None
    direction: Direction | None = None

    def over(self, other: "Statement") -> "Statement":
        """Return what this statement says, and the other where it says nothing.

        Raises
        ------
        InputError
            They contradict each other.
        """
        for mine, theirs in (
            (self.notation and self.notation.name, other.notation and other.notation.name),
            (self.unit, other.unit),
            (self.direction, other.direction),
        ):
            if mine is not None and theirs is not None and mine != theirs:
                raise InputError(
                    f"{mine} is stated, but the file says {theirs}",
                    code=Code.CONTRADICTION,
                    hint="leave the option out, or correct the file",
                )
        return Statement(
            self.notation or other.notation, self.unit or other.unit, self.direction or other.direction
        )


NOTHING_STATED = Statement()


@dataclass(frozen=True)
class Reading:
    """One way to read rows.

    Examples
    --------
    >>> from handeye.notations import NOTATIONS, Unit
    >>> Reading(NOTATIONS["ur"], Unit.MM).options
    ('--notation', 'ur', '--unit', 'mm')
    """

    notation: Notation
    unit: Unit
    direction: Direction = Direction.FLANGE_IN_BASE

    @property
    def options(self) -> tuple[str, ...]:
        """Options of the command line that state it."""
        inverse = self.direction is Direction.BASE_IN_FLANGE
        direction = ("--poses-are", self.direction.value.replace("_", "-")) if inverse else ()
        return ("--notation", self.notation.name, "--unit", self.unit.value, *direction)

    def __str__(self) -> str:
        inverse = ", base in flange" if self.direction is Direction.BASE_IN_FLANGE else ""
        return f"{self.notation.name} in {self.unit.value}{inverse}"


@dataclass(frozen=True, eq=False)
class PoseRows:
    r"""Rows of numbers from a file, one a pose.

    Attributes
    ----------
    file
        Where they were read.
    names
        What each row is called, empty where it has no name.
    values
        (N, k) the numbers.
    places
        Where in the file each row is, such as ``line 4``.
    labels
        Names of the k numbers in small letters, empty if the file has none.
    stated
        What the file says of its poses.
    degrees
        Whether the file says that its angles are in degrees or radians; None if it does not.
    has_time
        Whether a column of times was left out.
    accuracies
        What the file calls the accuracies of its poses, which are not read; empty if there are none.
    joints
        (N, n) joint positions of each row, radians; None where they are not known.

    Examples
    --------
    >>> _ = Path("poses.csv").write_text("x,y,z,qx,qy,qz,qw\n0.4,0,0.5,0,0,0,1\n")
    >>> read_pose_rows("poses.csv").values.shape
    (1, 7)
    """

    file: Path
    names: tuple[str, ...]
    values: FloatArray
    places: tuple[str, ...]
    labels: tuple[str, ...] = ()
    stated: Statement = field(default_factory=Statement)
    degrees: bool | None = None
    has_time: bool = False
    accuracies: tuple[str, ...] = ()
    joints: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.names)

    def select(self, kept: Sequence[int]) -> "PoseRows":
        """Return these rows, in this order."""
        return replace(
            self,
            names=tuple(self.names[i] for i in kept),
            values=self.values[list(kept)],
            places=tuple(self.places[i] for i in kept),
            joints=None if self.joints is None else self.joints[list(kept)],
        )

    def matrices(self, reading: Reading) -> FloatArray:
        """Return `T_base_flange` (N, 4, 4), metres, in one reading; NaN where a row is no pose in it."""
        matrices = reading.notation.matrices(self._columns(reading.notation), reading.unit)
        if reading.direction is Direction.BASE_IN_FLANGE:
            turned = matrices[:, :3, :3].transpose(0, 2, 1)
            moved = -(turned @ matrices[:, :3, 3:])[:, :, 0]
            matrices[:, :3, :3], matrices[:, :3, 3] = turned, moved
        return matrices

    def poses(self, reading: Reading) -> tuple[Pose, ...]:
        """Return `T_base_flange` of each row.

        Raises
        ------
        InputError
            A row is no pose in this reading; the message names its place.
        """
        poses: list[Pose] = []
        columns = self._columns(reading.notation)
        for place, numbers in zip(self.places, columns, strict=True):
            with located(f"{self.file}: {place}"):
                pose = reading.notation.pose(numbers.tolist(), reading.unit)
                poses.append(pose.inverse() if reading.direction is Direction.BASE_IN_FLANGE else pose)
        return tuple(poses)

    def readings(self, stated: Statement | None = None) -> tuple[Reading, ...]:
        """Return the ways to read the rows that what is stated leaves; one if all is said.

        Raises
        ------
        InputError
            What is stated contradicts the file, or does not fit its numbers.
        """
        with located(str(self.file)):
            said = (stated or Statement()).over(self.stated)
            if said.notation is None:
                notations: Sequence[Notation] = [n for n in _candidates() if self._fits(n)]
            else:
                self._columns(said.notation)
                notations = [said.notation]
        if not notations:
            raise InputError(
                f"{self.file}: {self.places[0]}: {self.values.shape[1]} numbers, expected 6 (position and "
                "angles), 7 (position and quaternion), 8 (with a time), 12 or 16 (matrix)",
                code=Code.WRONG_SHAPE,
                hint="docs/conventions.md has the table of notations",
            )
        units = (said.unit,) if said.unit else (said.notation.unit,) if said.notation else (None,)
        directions: Sequence[Direction] = tuple(Direction)
        if said.direction is not None or (said.notation is not None and units != (None,)):
            directions = (said.direction or Direction.FLANGE_IN_BASE,)
        return tuple(
            Reading(notation, unit, direction)
            for notation in notations
            for unit in (units if units != (None,) else TRIED_UNITS)
            if unit is not None
            for direction in directions
        )

    def _fits(self, notation: Notation) -> bool:
        """Tell whether the numbers may be in a notation, by their count and names."""
        try:
            self._columns(notation)
        except InputError:
            return False
        if self.labels[-4:] == QUATERNION:
            return notation.name == "quaternion_xyzw"
        rotation = notation.form.rotation if isinstance(notation.form, Vector) else None
        if self.labels[-3:] == ROTATION_VECTOR:
            return isinstance(rotation, RotationVector)
        is_angle = isinstance(rotation, (Euler, RotationVector))
        return self.degrees is None or not is_angle or rotation.degrees == self.degrees

    def _columns(self, notation: Notation) -> FloatArray:
        """Return the numbers in the order of a notation."""
        wanted = [label.lower() for label in notation.labels]
        if wanted and set(wanted) <= set(self.labels):
            return self.values[:, [self.labels.index(label) for label in wanted]]
        values, count = self.values, self.values.shape[1]
        if self.labels[-4:] == QUATERNION:
            form = notation.form
            rotation = form.rotation if isinstance(form, Vector) else None
            if not isinstance(rotation, Quaternion):
                raise InputError(
                    f"the columns are a quaternion, not {notation.name}", code=Code.CONTRADICTION
                )
            x, y, z, w = range(count - 4, count)
            turn = [w, x, y, z] if rotation.real_first else [x, y, z, w]
            order = [*turn, 0, 1, 2] if isinstance(form, Vector) and form.position_last else [0, 1, 2, *turn]
            return np.column_stack([np.zeros((len(self), notation.leading)), values[:, order]])
        if count not in notation.counts and count in notation.form.counts and self.has_time:
            return np.column_stack([np.zeros((len(self), notation.leading)), values])
        if count not in notation.counts:
            expected = " or ".join(map(str, notation.counts))
            raise InputError(
                f"{self.places[0]}: {count} numbers, expected {expected} in the notation {notation.name}",
                code=Code.WRONG_SHAPE,
            )
        return values


def _candidates() -> Sequence[Notation]:
    """Return one notation for every meaning: makers first, then plain ones, then any angles."""
    seen: set[object] = set()
    found: list[Notation] = []
    for notation in (NOTATIONS["ur"], NOTATIONS["kuka"], NOTATIONS["fanuc"], *MAKERS, *PLAIN, *EULER):
        key = (_meaning(notation), notation.leading)
        if key not in seen:
            seen.add(key)
            found.append(notation)
    return found


def _meaning(notation: Notation) -> object:
    """Return what is equal for notations in which the same numbers are the same pose up to the unit.

    Turning about moving axes in one order is turning about fixed axes in the other, but the numbers then
    stand in the other order too, so only the form itself counts.
    """
    return notation.form


def same_meaning(notation: Notation) -> tuple[str, ...]:
    """Return the names of all notations in which the same numbers are the same pose, up to the unit."""
    return tuple(
        other.name
        for other in itertools.chain(MAKERS, PLAIN, EULER)
        if other.form == notation.form and other.leading == notation.leading
    )
