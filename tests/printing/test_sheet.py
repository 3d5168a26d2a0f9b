"""Layout on paper: what fits, where it is, and what is beside it."""

import numpy as np
import pytest
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

from handeye.datasets import read_target
from handeye.errors import InputError
from handeye.printing import Paper, largest, lay_out, target_file
from handeye.printing.ink import ink_of
from handeye.printing.shapes import Area, Disc, Line, Words
from handeye.printing.sheet import MARGIN_MM
from handeye.types import Chessboard, CircleGrid, Target

PAPERS = ["a4", "a3", "letter", "100x80", "600x400", "60x900"]


@pytest.mark.parametrize("family", Target.members)
@pytest.mark.parametrize("name", PAPERS)
def test_the_largest_fits_and_a_larger_one_does_not(family: str, name: str) -> None:
    paper = Paper.of(name)
    target = largest(family, {}, paper)
    lay_out(target, paper)
    measures = target.to_dict()
    field = Target.member(family).scale
    scale_mm = measures[field] * 1000
    step = 1.0 if scale_mm >= 10 else 0.5 if scale_mm >= 5 else 0.1
    assert scale_mm / step == pytest.approx(round(scale_mm / step))
    with pytest.raises(InputError, match="needs"):
        lay_out(Target.member(family).usual((scale_mm + 1.25 * step) / 1000, {}), paper)


@pytest.mark.parametrize("family", Target.members)
@pytest.mark.parametrize("name", PAPERS)
def test_nothing_leaves_the_paper_or_comes_near_the_board(family: str, name: str) -> None:
    sheet = lay_out(largest(family, {}, Paper.of(name)), Paper.of(name))
    drawing = sheet.drawing
    ink = ink_of(sheet.target)
    low, high = ink.low + sheet.origin_mm, ink.high + sheet.origin_mm
    free = ink.quiet_mm - 1e-9
    beside = 0
    for shape in drawing.shapes:
        if isinstance(shape, Area):
            places = np.vstack(shape.loops)
        elif isinstance(shape, Disc):
            places = np.array([shape.x, shape.y]) + np.array([[-1], [1]]) * shape.radius
        else:
            beside += 1
            if isinstance(shape, Line):
                places = np.array([[shape.x1, shape.y1], [shape.x2, shape.y2]])
            else:
                font = FontProperties(family="DejaVu Sans", weight="bold" if shape.bold else "normal")
                wide = TextPath((0, 0), shape.text, shape.size, prop=font).get_extents().width
                start = shape.x - {"start": 0, "middle": wide / 2, "end": wide}[shape.anchor]
                places = np.array([[start, shape.y - shape.size], [start + wide, shape.y]])
            inside = (places.max(axis=0) > low - free) & (places.min(axis=0) < high + free)
            assert not inside.all(), shape
        assert (places >= MARGIN_MM - 0.5).all(), shape
        assert (places <= np.array([drawing.width_mm, drawing.height_mm]) - MARGIN_MM + 0.5).all(), shape
    assert beside > 20


def test_rulers_are_as_long_as_they_say() -> None:
    drawing = lay_out(Chessboard(6, 9, 0.025), Paper.of("a4")).drawing
    numbers = [shape for shape in drawing.shapes if isinstance(shape, Words) and shape.text[0].isdigit()]
    lines = [shape for shape in drawing.shapes if isinstance(shape, Line)]
    across = [n for n in numbers if n.anchor == "middle"]
    down = [n for n in numbers if n.anchor == "start"]
    assert [n.text for n in across] == ["0", "50", "100", "150", "200 mm"]
    assert [n.text for n in down] == ["0", "50", "100", "150"]
    for numbers_of, axis in ((across, "x"), (down, "y")):
        first, last = getattr(numbers_of[0], axis), getattr(numbers_of[-1], axis)
        assert last - first == pytest.approx(float(numbers_of[-1].text.split()[0]), abs=1e-12)
        ticks = {
            getattr(line, f"{axis}1")
            for line in lines
            if getattr(line, f"{axis}1") == getattr(line, f"{axis}2")
            and np.hypot(line.x2 - line.x1, line.y2 - line.y1) < 5
        }
        assert len(ticks) == round(last - first) + 1


def test_sheet_is_turned_if_need_be() -> None:
    assert lay_out(Chessboard(6, 9, 0.025), Paper.of("a4")).paper.is_landscape
    assert not lay_out(Chessboard(9, 6, 0.025), Paper.of("a4")).paper.is_landscape
    assert not lay_out(
        Chessboard(3, 4, 0.01), Paper.of("a4")
    ).paper.is_landscape  # as it comes, if that will do


def test_origin_is_where_the_first_point_is() -> None:
    sheet = lay_out(CircleGrid(4, 5, 0.03, 0.01), Paper.of("a4"))
    first = next(shape for shape in sheet.drawing.shapes if isinstance(shape, Disc))
    assert [first.x, first.y] == pytest.approx(sheet.origin_mm)


@pytest.mark.parametrize("family", Target.members)
def test_target_file_reads_back(family: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    sheet = lay_out(largest(family, {}, Paper.of("a4")), Paper.of("a4"))
    path = tmp_path_factory.mktemp("target") / "board.toml"
    path.write_text(target_file(sheet))
    assert read_target(path) == sheet.target


def test_what_cannot_fit_says_so() -> None:
    with pytest.raises(InputError, match="does not fit"):
        largest("chessboard", {"rows": 60, "columns": 4}, Paper.of("50x50"))
    with pytest.raises(InputError, match="A4") as caught:
        lay_out(Chessboard(6, 9, 0.05), Paper.of("a4"))
    assert caught.value.code == "does_not_fit"


@pytest.mark.parametrize(
    "text", ["", "a9", "100", "100x", "0x100", "1e9x5", "-5x100", "100x100x100", "nanxnan", "9999x9"]
)
def test_paper_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        Paper.of(text)


def test_paper_by_name_and_by_size() -> None:
    assert Paper.of("A4") == Paper(210, 297, "A4")
    assert Paper.of("Letter").width_mm == 215.9
    assert Paper.of("600x400") == Paper(600, 400, "600 x 400 mm")
    assert Paper.of("600x400").turned.height_mm == 600
