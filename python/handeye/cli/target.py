"""`handeye target`: a calibration target to print, and the file that describes it."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_output
from handeye.codes import Code
from handeye.datasets import read_target
from handeye.datasets.reading import located
from handeye.datasets.writing import replace_file
from handeye.errors import InputError, OutputError
from handeye.printing import Paper, Sheet, largest, lay_out, page, target_file
from handeye.types import Target

if TYPE_CHECKING:
    from rich.console import Console


@Parameter(name="*", group="Measures")
@dataclass(frozen=True)
class Asked:
    """Measures of the target; what is not given is chosen, lengths as large as the paper allows."""

    rows: int | None = None
    """Rows of inner corners (chessboard), circles, squares (charuco), tags or markers."""
    columns: int | None = None
    """Columns of the same."""
    pitch_mm: float | None = None
    """chessboard: side of a square. circle_grid: distance between rows."""
    square_mm: float | None = None
    """charuco: side of a square."""
    marker_mm: float | None = None
    """Side of a marker (aruco_grid, aruco_marker, charuco: three quarters of a square if not given)."""
    separation_mm: float | None = None
    """aruco_grid: space between markers; a quarter of their side if not given."""
    tag_mm: float | None = None
    """aprilgrid: side of a tag."""
    spacing_ratio: float | None = None
    """aprilgrid: space between tags over their side; 0.3 if not given."""
    border_bits: int | None = None
    """Width of the markers' black border: 1, or 2 as Kalibr prints an aprilgrid."""
    dictionary: str | None = None
    """OpenCV's name of the markers' dictionary."""
    id: int | None = None
    """aruco_marker: its number in the dictionary."""
    first_id: int | None = None
    """charuco, aprilgrid, aruco_grid: number of the first marker; the others follow."""
    ids: str | None = None
    """charuco, aprilgrid, aruco_grid: all numbers, with commas, where they do not follow: 3,7,12,..."""
    inverted: bool = False
    """Boards with markers: print light on dark."""
    legacy_pattern: bool = False
    """charuco: the layout of OpenCV before 4.6, another one if rows are even."""
    diameter_mm: float | None = None
    """circle_grid: diameter of a circle; half the pitch if not given."""
    asymmetric: bool = False
    """circle_grid: shift every second row."""
    marked: int | None = None
    """circle_grid: number of the one larger circle, from 0 at the upper left."""
    marked_diameter_mm: float | None = None
    """circle_grid: its diameter; 1.4 times the others' if not given."""

    @property
    def given(self) -> set[str]:
        """Names of the options that were given."""
        return {field.name for field in fields(self) if getattr(self, field.name) is not field.default}

    def target(self, family: str, paper: Paper) -> Target:
        """Return the target that is asked for.

        Raises
        ------
        UsageError
            A measure that the family does not have.
        InputError
            A measure out of its range, an unknown family, or nothing that fits on the paper.
        """
        member = Target.member(family)
        asked: dict[str, Any] = {}
        for name in sorted(self.given):
            field = f"{name.removesuffix('_mm')}_m" if name.endswith("_mm") else name
            if field not in member.fields():
                option = f"--{name.replace('_', '-')}"
                others = ", ".join(map(_option, member.fields()))
                raise UsageError(f"{option} says nothing about {family}", hint=f"it has {others}")
            value = getattr(self, name)
            asked[field] = _metres(value) if field != name else _numbers(value) if name == "ids" else value
        scale = asked.pop(member.scale, None)
        return largest(family, asked, paper) if scale is None else member.usual(scale, asked)


def _option(field: str) -> str:
    name = f"{field}m" if field.endswith("_m") else field
    return f"--{name.replace('_', '-')}"


def _numbers(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError as error:
        raise UsageError(
            f"--ids {text[:40]!r}", hint="write whole numbers with commas, such as 3,7,12"
        ) from error


def _metres(millimetres: float) -> float:
    return round(millimetres / 1000, 12)


def target(
    family: str,
    /,
    *,
    output: Path,
    paper: str = "a4",
    config: Path | None = None,
    measures: Asked = Asked(),
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Write a calibration target to print at true scale, and the file that describes it to solve --target.

    The page has two rulers to check its scale with, and says what it shows.

    Parameters
    ----------
    family
        chessboard, circle_grid, charuco, aprilgrid, aruco_grid or aruco_marker; or the .toml or .json file of
        a target.
    output
        The page, .pdf or .svg.
    paper
        a2, a3, a4, a5, letter, legal, tabloid, or WIDTHxHEIGHT in mm such as 600x400; turned if need be.
    config
        The file that describes the target; if not given, the name of the page with .toml. A file that says
        something else is not replaced.
    """
    sheet = lay_out(_target(family, measures, Paper.of(paper)), Paper.of(paper))
    content = _page(sheet, output)
    config = output.with_suffix(".toml") if config is None else config
    check_output(output)
    check_output(config)
    description = target_file(sheet).encode()
    if config.exists() and not _holds(config, sheet.target):
        raise OutputError(
            f"{config}: describes another target",
            code=Code.EXISTS,
            hint="name another file with --config, or remove this one; it may hold measures of a print",
        )
    replace_file(output, content)
    if not config.exists():
        replace_file(config, description)
    data = _data(sheet, output, config)
    return Answer(data, lambda console: _show(console, sheet, data))


def _target(family: str, measures: Asked, paper: Paper) -> Target:
    name = family.replace("-", "_")
    if name in Target.members or Path(family).suffix.lower() not in {".toml", ".json"}:
        return measures.target(name, paper)
    if measures != Asked():
        raise UsageError("the file says all measures", hint="give no measures, or name a family instead")
    return read_target(family)


def _page(sheet: Sheet, output: Path) -> bytes:
    with located(str(output)):
        return page(sheet.drawing, output.suffix.lower().removeprefix("."))


def _holds(config: Path, target: Target) -> bool:
    try:
        return read_target(config) == target
    except InputError:
        return False


def _data(sheet: Sheet, output: Path, config: Path) -> dict[str, Any]:
    positions = len(sheet.target.symmetries)
    ambiguous = (
        f"the board looks the same in {positions} positions, so a single image cannot tell which way round "
        "it is; an odd and an even number of rows and columns of corners, a marked circle, or markers would"
    )
    return {
        "target": sheet.target.to_dict(),
        "caption": sheet.caption,
        "paper": sheet.paper.name,
        "paper_size_mm": [sheet.paper.width_mm, sheet.paper.height_mm],
        "printed_size_mm": sheet.size_mm.tolist(),
        "origin_on_paper_mm": sheet.origin_mm.tolist(),
        "page": str(output),
        "config": str(config),
        "warnings": [ambiguous] if positions > 1 else [],
    }


def _show(console: "Console", sheet: Sheet, data: dict[str, Any]) -> None:
    from handeye.cli.wording import heading, notices, pairs  # noqa: PLC0415 - as in all commands

    heading(console, sheet.caption)
    way = "landscape" if sheet.paper.is_landscape else "portrait"
    width, height = sheet.size_mm
    pairs(
        console,
        [
            ("paper", f"{sheet.paper.name}, {way}"),
            ("edge to edge", f"{width:.2f} x {height:.2f} mm"),
        ],
    )
    console.print(
        "Print at 100 %, measure both rulers on the print, then: handeye solve FOLDER --target FILE"
    )
    notices(console, "Warnings", data["warnings"])
    console.print(f"written: {data['page']} and {data['config']}", markup=False, soft_wrap=True)
