"""Files: the drawing to the micrometre, in PDF and SVG, the same bytes every time."""

import re
import zlib
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from handeye.errors import OutputError
from handeye.printing import Paper, largest, lay_out
from handeye.printing.page import page
from handeye.printing.shapes import Area, Disc, Drawing, Line, Words, rectangle
from handeye.types import Target
from handeye.types.arrays import FloatArray
from ink import is_black, is_inside

POINTS_PER_MM = 72 / 25.4
SVG = "{http://www.w3.org/2000/svg}"


def a_drawing(family: str, paper: str = "a4") -> Drawing:
    shape = {"rows": 4, "columns": 5} if "rows" in Target.member(family).fields() else {}
    measures = {**shape, **({"marked": 3} if family == "circle_grid" else {})}
    return lay_out(largest(family, measures, Paper.of(paper)), Paper.of(paper)).drawing


def pdf_content(content: bytes) -> str:
    """The drawing commands of the page: its longest stream that has such commands."""
    streams = [
        zlib.decompress(part)
        for part in re.findall(rb"/FlateDecode.*?stream\r?\n(.*?)\r?\nendstream", content, re.DOTALL)
    ]
    return max((s for s in streams if b" re\n" in s or b" l\n" in s or b" m\n" in s), key=len).decode(
        "latin-1"
    )


def pdf_loops(content: str, height_mm: float) -> list[FloatArray]:
    """Closed paths in mm from the upper left; of curves, the ends."""
    loops: list[list[list[float]]] = []
    for line in content.splitlines():
        words = line.split()
        if words[-1:] == ["m"]:
            loops.append([[float(words[0]), float(words[1])]])
        elif words[-1:] in (["l"], ["c"]):
            loops[-1].append([float(words[-3]), float(words[-2])])
    return [
        np.column_stack([x / POINTS_PER_MM, height_mm - y / POINTS_PER_MM])
        for x, y in (np.array(loop).T for loop in loops)
    ]


@pytest.mark.parametrize(
    ("family", "paper"),
    [*((family, "a4") for family in Target.members), ("chessboard", "letter"), ("aprilgrid", "333x222")],
)
def test_pdf_has_true_scale(family: str, paper: str) -> None:
    drawing = a_drawing(family, paper)
    content = page(drawing, "pdf")
    (box,) = re.findall(rb"/MediaBox \[ *0 0 ([0-9.]+) ([0-9.]+) *\]", content)
    np.testing.assert_allclose(
        [float(side) / POINTS_PER_MM for side in box], [drawing.width_mm, drawing.height_mm], atol=1e-6
    )
    assert b"/UserUnit" not in content
    commands = pdf_content(content)
    loops = pdf_loops(commands, drawing.height_mm)
    expected = [shape for shape in drawing.shapes if not isinstance(shape, Words)]
    first = 0
    for shape in expected:
        if isinstance(shape, Area):
            for loop in shape.loops:
                np.testing.assert_allclose(loops[first][: len(loop)], loop, atol=1e-5)
                first += 1
        elif isinstance(shape, Disc):
            reach = np.hypot(*(loops[first] - [shape.x, shape.y]).T)
            np.testing.assert_allclose(reach, shape.radius, atol=1e-4)
            first += 1
        else:
            middle = loops[first][:4].mean(axis=0)
            np.testing.assert_allclose(
                middle, [(shape.x1 + shape.x2) / 2, (shape.y1 + shape.y2) / 2], atol=1e-5
            )
            first += 1
    assert first == len(loops)
    assert re.search(r"^f$", commands, re.MULTILINE)  # filled by the nonzero rule, as the outlines need it
    assert not re.search(r"^f\*$", commands, re.MULTILINE)


@pytest.mark.parametrize("family", Target.members)
def test_svg_has_true_scale(family: str) -> None:
    drawing = a_drawing(family)
    root = ET.fromstring(page(drawing, "svg"))
    assert root.get("width") == f"{drawing.width_mm:g}mm"
    assert root.get("height") == f"{drawing.height_mm:g}mm"
    assert root.get("viewBox") == f"0 0 {drawing.width_mm:g} {drawing.height_mm:g}"
    loops = [
        np.array(part.split(), dtype=float).reshape(-1, 2)
        for path in root.iter(f"{SVG}path")
        for part in re.findall(r"M([^Z]*)Z", str(path.get("d")))
    ]
    discs = [
        Disc(*(float(str(circle.get(name))) for name in ("cx", "cy", "r")))
        for circle in root.iter(f"{SVG}circle")
    ]
    shapes = [Area(tuple(loops)), *discs]
    places = np.random.default_rng(3).uniform(0, [drawing.width_mm, drawing.height_mm], size=(2000, 2))
    np.testing.assert_array_equal(is_black(shapes, places), is_black(drawing.shapes, places))
    for loop, other in zip(
        loops, (loop for s in drawing.shapes if isinstance(s, Area) for loop in s.loops), strict=True
    ):
        np.testing.assert_allclose(loop, other, atol=1e-6)
    lines = [
        Line(*(float(str(line.get(n))) for n in ("x1", "y1", "x2", "y2", "stroke-width")))
        for line in root.iter(f"{SVG}line")
    ]
    assert len(lines) == sum(isinstance(shape, Line) for shape in drawing.shapes)
    assert not list(root.iter(f"{SVG}image"))


@pytest.mark.parametrize("kind", ["pdf", "svg"])
def test_the_same_drawing_gives_the_same_bytes(kind: str) -> None:
    drawing = a_drawing("charuco")
    assert page(drawing, kind) == page(drawing, kind)


def test_words_stay_words() -> None:
    words = "<script>a & \"b\" 'c'</script> $x_1^2$ \x00 \u202e ü"
    drawing = Drawing(100, 60, words, (Words(10, 10, words, 3), Area((rectangle(20, 20, 10, 10),))))
    root = ET.fromstring(page(drawing, "svg"))
    assert not list(root.iter(f"{SVG}script"))
    (text,) = root.iter(f"{SVG}text")
    assert text.text == words.replace("\x00", "?").replace("\u202e", "?")
    assert page(drawing, "pdf").startswith(b"%PDF")


def test_nothing_but_words_can_be_drawn() -> None:
    drawing = Drawing(100, 60, "t", (Words(10, 10, "alone", 3, "end", bold=True),))
    assert page(drawing, "pdf").startswith(b"%PDF")


def test_other_kinds_are_refused() -> None:
    with pytest.raises(OutputError, match="png"):
        page(a_drawing("chessboard"), "png")


def test_holes_are_holes() -> None:
    ring = Area((rectangle(0, 0, 30, 30), rectangle(10, 10, 10, 10)[::-1]))
    assert is_inside(ring.loops, np.array([[5.0, 5], [15, 15], [40, 5]])).tolist() == [True, False, False]
