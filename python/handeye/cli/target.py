"""`handeye target`: a calibration target to print, and the file that describes it."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_output
from handeye.datasets import read_target
from handeye.datasets.reading import located
from handeye.datasets.writing import replace_file
from handeye.errors import InputError, OutputError
from handeye.printing import BOARDS, Measures, Paper, Sheet, board_of, largest, lay_out, page, target_file
from handeye.types import Target

if TYPE_CHECKING:
    from rich.console import Console

_COMMON = frozenset({"rows", "columns"})
# The measure that the others of a family follow, and what else can be asked of it.
_SCALES = {"chessboard": "pitch_mm", "circle_grid": "pitch_mm", "charuco": "square_mm", "aprilgrid": "tag_mm"}
_OWN = {
    "chessboard": frozenset[str](),
    "circle_grid": frozenset({"diameter_mm", "asymmetric", "marked", "marked_diameter_mm"}),
    "charuco": frozenset({"marker_mm", "dictionary"}),
    "aprilgrid": frozenset({"spacing_ratio", "border_bits", "dictionary"}),
}


@Parameter(name="*", group="Measures")
@dataclass(frozen=True)
class Asked:
    """Measures of the target; what is not given is chosen, lengths as large as the paper allows."""

    rows: int | None = None
    """Rows of inner corners (chessboard), circles, squares (charuco) or tags."""
    columns: int | None = None
    """Columns of the same."""
    pitch_mm: float | None = None
    """chessboard: side of a square. circle_grid: distance between rows."""
    square_mm: float | None = None
    """charuco: side of a square."""
    marker_mm: float | None = None
    """charuco: side of a marker; three quarters of a square if not given."""
    tag_mm: float | None = None
    """aprilgrid: side of a tag."""
    spacing_ratio: float | None = None
    """aprilgrid: space between tags over their side; 0.3 if not given."""
    border_bits: int | None = None
    """aprilgrid: width of the black border, 2 (as Kalibr prints) or 1."""
    dictionary: str | None = None
    """charuco, aprilgrid: OpenCV's name of the markers."""
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
        board = board_of(family)
        known = _COMMON | _OWN[family] | {_SCALES[family]}
        for name in sorted(self.given - known):
            option = f"--{name.replace('_', '-')}"
            others = ", ".join(f"--{other.replace('_', '-')}" for other in sorted(known))
            raise UsageError(f"{option} says nothing about {family}", hint=f"it has {others}")
        asked = Measures(
            self.rows,
            self.columns,
            _metres(self.diameter_mm),
            self.asymmetric,
            self.marked,
            _metres(self.marked_diameter_mm),
            _metres(self.marker_mm),
            self.dictionary,
            self.spacing_ratio,
            self.border_bits,
        )
        scale = _metres(getattr(self, _SCALES[family]))
        return largest(family, asked, paper) if scale is None else board.usual(scale, asked)


def _metres(millimetres: float | None) -> float | None:
    return None if millimetres is None else round(millimetres / 1000, 12)


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
        chessboard, circle_grid, charuco or aprilgrid; or the .toml or .json file of a target.
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
            code="exists",
            hint="name another file with --config, or remove this one; it may hold measures of a print",
        )
    replace_file(output, content)
    if not config.exists():
        replace_file(config, description)
    data = _data(sheet, output, config)
    return Answer(data, lambda console: _show(console, sheet, data))


def _target(family: str, measures: Asked, paper: Paper) -> Target:
    name = family.replace("-", "_")
    if name in BOARDS or Path(family).suffix.lower() not in {".toml", ".json"}:
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
