"""A drawing as SVG: one user unit is one millimetre."""

from xml.sax.saxutils import escape

import numpy as np

from handeye.printing.shapes import Area, Disc, Drawing, Line, Shape, printable
from handeye.types.arrays import FloatArray

_FONT = "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif"


def svg(drawing: Drawing) -> bytes:
    """Return the file."""
    width, height = _number(drawing.width_mm), _number(drawing.height_mm)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm"',
        f'  viewBox="0 0 {width} {height}">',
        f"<title>{_escaped(drawing.title)}</title>",
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
        f'<g fill="#000" stroke="none" font-family="{_FONT}">',
        *(_shape(shape) for shape in drawing.shapes),
        "</g>",
        "</svg>",
    ]
    return ("\n".join(lines) + "\n").encode()


def _shape(shape: Shape) -> str:
    if isinstance(shape, Area):
        return f'<path fill-rule="nonzero" d="{" ".join(_loop(loop) for loop in shape.loops)}"/>'
    if isinstance(shape, Disc):
        x, y, r = _number(shape.x), _number(shape.y), _number(shape.radius)
        return f'<circle cx="{x}" cy="{y}" r="{r}"/>'
    if isinstance(shape, Line):
        ends = " ".join(f'{name}="{_number(getattr(shape, name))}"' for name in ("x1", "y1", "x2", "y2"))
        return f'<line {ends} stroke="#000" stroke-width="{_number(shape.width)}"/>'
    weight = ' font-weight="bold"' if shape.bold else ""
    return (
        f'<text x="{_number(shape.x)}" y="{_number(shape.y)}" font-size="{_number(shape.size)}" '
        f'text-anchor="{shape.anchor}"{weight}>{_escaped(shape.text)}</text>'
    )


def _loop(loop: FloatArray) -> str:
    return "M" + " ".join(f"{_number(float(x))} {_number(float(y))}" for x, y in loop) + "Z"


def _number(value: float) -> str:
    """Return a number to the nanometre."""
    text = np.format_float_positional(round(value, 6), trim="-")
    return "0" if text == "-0" else text


def _escaped(text: str) -> str:
    return escape(printable(text))
