"""Drawing SVG that stands inside a page."""

from html import escape

import numpy as np

from handeye.types.arrays import FloatArray


class Canvas:
    """A picture of a size; later shapes lie over earlier ones.

    Numbers are written with two decimals of a unit, which is about a pixel.
    """

    def __init__(self, width: float, height: float, label: str) -> None:
        """Begin an empty picture; `label` describes it to those who cannot see it."""
        self.width = width
        self.height = height
        self._label = label
        self._parts: list[str] = []

    def path(self, points: FloatArray, style: str, *, closed: bool = False) -> None:
        """Draw a line through points (N, 2)."""
        corners = " ".join(_pair(x, y) for x, y in points.tolist())
        self._parts.append(f'<path d="M{corners}{"Z" if closed else ""}" {_filled(style)}/>')

    def segments(self, starts: FloatArray, ends: FloatArray, style: str) -> None:
        """Draw many straight lines (N, 2) to (N, 2) as one shape."""
        # Steps from where the start is after rounding, so that ends are not off by both roundings.
        steps = ends - np.round(starts, 2)
        pairs = zip(starts.tolist(), steps.tolist(), strict=True)
        lines = "".join(f"M{_pair(x, y)}l{_pair(dx, dy)}" for (x, y), (dx, dy) in pairs)
        self._parts.append(f'<path d="{lines}" {_filled(style)}/>')

    def dots(self, points: FloatArray, radius: float, style: str) -> None:
        """Draw many dots (N, 2) as one shape."""
        dots = "".join(f"M{_pair(x, y)}h0" for x, y in points.tolist())
        self._parts.append(
            f'<path d="{dots}" fill="none" stroke-linecap="round" '
            f'stroke-width="{_number(2 * radius)}" {style}/>'
        )

    def box(self, x: float, y: float, width: float, height: float, style: str) -> None:
        """Draw an upright rectangle."""
        sides = f'x="{_number(x)}" y="{_number(y)}" width="{_number(width)}" height="{_number(height)}"'
        self._parts.append(f"<rect {sides} {_filled(style)}/>")

    def text(
        self, x: float, y: float, text: str, size: float = 11, anchor: str = "start", style: str = ""
    ) -> None:
        """Write a line of text; (x, y) is on its baseline."""
        self._parts.append(
            f'<text x="{_number(x)}" y="{_number(y)}" font-size="{_number(size)}" text-anchor="{anchor}" '
            f"{style}>{escape(text)}</text>"
        )

    def markup(self) -> str:
        """Return the picture."""
        size = f"0 0 {_number(self.width)} {_number(self.height)}"
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{size}" role="img" '
            f'aria-label="{escape(self._label, quote=True)}">{"".join(self._parts)}</svg>'
        )


def _filled(style: str) -> str:
    return style if "fill=" in style else f'fill="none" {style}'


def _pair(x: float, y: float) -> str:
    return f"{_number(x)} {_number(y)}"


def _number(value: float) -> str:
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text in {"-0", ""} else text
