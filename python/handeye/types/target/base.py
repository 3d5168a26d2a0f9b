"""What every calibration target has."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, replace
from functools import cached_property
from typing import Any, ClassVar, Self, cast

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.plain import read_document, without_none
from handeye.types.target.artwork import Artwork
from handeye.types.target.symmetry import Turn, turns_onto_itself

MAX_POINTS = 100_000


class Target(ABC):
    """A flat board with points at known places.

    Frame: z = 0 on the board, metres, origin at point 0, x along the columns to the right and y along the
    rows downwards as one looks at its front, so z points into the board and its front faces -z, as usual
    with OpenCV.

    A member of the family is a frozen dataclass with the measures of the board as its fields. What few
    boards have is a keyword-only field; files hold it only where it is not the usual.

    Examples
    --------
    >>> from handeye.types import Chessboard
    >>> Chessboard(6, 9, 0.025).point_count
    54
    """

    family: ClassVar[str]
    """Name of the family, as in files."""

    scale: ClassVar[str]
    """The field, a length in metres, that all other lengths usually follow."""

    usual_measures: ClassVar[Mapping[str, Any]]
    """The other fields of a usual board; lengths (`_m`) as shares of the scale."""

    members: ClassVar[dict[str, type["Target"]]] = {}
    """Every family by its name."""

    def __init_subclass__(cls, **kwargs: Any) -> None:  # noqa: ANN401 - passed on as it is
        super().__init_subclass__(**kwargs)
        if "family" in vars(cls):
            Target.members[cls.family] = cls

    @abstractmethod
    def _layout(self) -> FloatArray:
        """Return the points (P, 2) in the plane of the board, in metres."""

    @abstractmethod
    def artwork(self) -> Artwork:
        """Return what is printed on the board."""

    @property
    @abstractmethod
    def caption(self) -> str:
        """The board in one line, for a person."""

    @property
    @abstractmethod
    def spacing_m(self) -> float:
        """Distance of what is repeated on the board: squares, circles, or markers."""

    @classmethod
    def usual(cls, scale_m: float, asked: Mapping[str, Any]) -> Self:
        """Return a board with the measures that are asked for, and usual ones else.

        Raises
        ------
        InputError
            A measure out of its range.
        """
        shares = {
            name: round(value * scale_m, 9) if name.endswith("_m") else value
            for name, value in cls.usual_measures.items()
        }
        return cls(**{cls.scale: scale_m, **shares, **asked})

    @classmethod
    def fields(cls) -> tuple[str, ...]:
        """Return the names of the fields."""
        return tuple(field.name for field in cls._described())

    @classmethod
    def _described(cls) -> "list[Field[Any]]":
        """Return the fields as they are in files: those of every board of the family first."""
        every: tuple[Field[Any], ...] = fields(cast("Any", cls))
        return sorted(every, key=lambda field: bool(field.kw_only))

    def _looks_the_same(self, turn: Turn) -> bool:
        """Tell whether the picture of the board, not only its points, is the same after a turn."""
        return turn.quarters == 0

    @cached_property
    def points(self) -> FloatArray:
        """(P, 3) points in the frame of the target, metres, read-only; the row is the id of the point."""
        layout = self._layout()
        points = np.column_stack([layout, np.zeros(len(layout))])
        points.flags.writeable = False
        return points

    @property
    def point_count(self) -> int:
        """Number of points P."""
        return len(self.points)

    @property
    def radius_m(self) -> float:
        """Radius of the circles in metres; 0 where the points are corners."""
        return 0.0

    @cached_property
    def radii_m(self) -> FloatArray:
        """(P,) radius of the circle at each point in metres, 0 for a corner; read-only."""
        radii = self._radii()
        radii.flags.writeable = False
        return radii

    def _radii(self) -> FloatArray:
        """Return the radii (P,) of the circles at the points."""
        return np.full(self.point_count, self.radius_m)

    @cached_property
    def turns(self) -> tuple[Turn, ...]:
        """Turns about the centre that bring points onto points, however they look; identity first."""
        return turns_onto_itself(self.points)

    @cached_property
    def symmetries(self) -> tuple[IndexArray, ...]:
        """Permutations (P,) of the points under which the board looks the same, identity first.

        A detection that says point i may as well mean point `symmetry[i]` for each of them: the picture
        cannot tell. They form a group and stand for turns of the board about its centre.
        """
        return tuple(turn.permutation for turn in self.turns if self._looks_the_same(turn))

    def changed(self, **measures: Any) -> Self:  # noqa: ANN401 - of any family
        """Return the board with other measures.

        Raises
        ------
        InputError
            A measure out of its range.
        """
        return cast("Self", replace(cast("Any", self), **measures))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON or TOML; `Target.from_dict` reads them back."""
        values: dict[str, Any] = {}
        for field in self._described():
            value = getattr(self, field.name)
            if not (field.kw_only and field.default is not MISSING and value == field.default):
                values[field.name] = [*cast("tuple[int, ...]", value)] if isinstance(value, tuple) else value
        return {"family": self.family, **without_none(**values)}

    @staticmethod
    def member(family: object) -> type["Target"]:
        """Return the family of a name.

        Raises
        ------
        InputError
            No such family.
        """
        member = Target.members.get(family) if isinstance(family, str) else None
        if member is None:
            raise InputError(
                f"target: family {family!r}, expected one of {', '.join(sorted(Target.members))}",
                code=Code.UNKNOWN_TARGET,
            )
        return member

    @staticmethod
    def from_dict(data: object) -> "Target":
        """Read what `to_dict` of any family wrote.

        Raises
        ------
        InputError
            An unknown family; a missing, unknown or unusable field.
        """
        table = dict(read_document(data, Mapping[str, Any], "target"))
        family = table.pop("family", None)
        member = Target.member(family)
        names = member.fields()
        unknown = sorted(set(table) - set(names))
        if unknown:
            raise InputError(
                f"target: {family} has no field {unknown[0]!r}, expected {', '.join(names)}",
                code=Code.INVALID_FIELD,
            )
        return read_document(table, member, f"target: {family}")


def mm(metres: float) -> str:
    """Return a length in millimetres with as many digits as it has, up to a nanometre."""
    return f"{round(metres * 1000, 6):.10g} mm"


def check_point_count(points: int, what: str) -> None:
    """Refuse a board of more points than any camera resolves.

    Raises
    ------
    InputError
        More than 100 000 points.
    """
    if points > MAX_POINTS:
        raise InputError(f"{what}: {points} points, expected at most {MAX_POINTS}", code=Code.OUT_OF_RANGE)


def grid(rows: int, columns: int, pitch_m: float) -> FloatArray:
    """Return a lattice (rows * columns, 2) of points, row by row, x fastest."""
    y, x = np.divmod(np.arange(rows * columns), columns)
    return np.column_stack([x, y]) * pitch_m
