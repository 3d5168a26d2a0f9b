"""How the answer became certain: radius with 95 % probability against the number of views."""

from collections.abc import Sequence

import numpy as np

from handeye.report.canvas import Canvas
from handeye.report.wording import figures
from handeye.types.arrays import FloatArray

_WIDTH, _HEIGHT = 350.0, 210.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 52.0, 14.0, 24.0, 34.0
_INK, _ASKED, _GRID = "#1565c0", "#c62828", "#e3e7ea"


def curve_picture(
    views: Sequence[int], values: Sequence[float], unit: str, title: str, asked: float | None
) -> str:
    """Draw a curve over numbers of views on a logarithmic scale, with a line at what was asked for."""
    canvas = Canvas(_WIDTH, _HEIGHT, f"{title} against the number of views")
    shown = [*values, *([asked] if asked else [])]
    low, high = _decades(min(shown), max(shown))
    first = min(views)
    last = max(*views, first + 1)

    def place(view: float, value: float) -> FloatArray:
        x = _LEFT + (view - first) / (last - first) * (_WIDTH - _LEFT - _RIGHT)
        y = _TOP + (np.log(high) - np.log(value)) / (np.log(high) - np.log(low)) * (_HEIGHT - _TOP - _BOTTOM)
        return np.array([x, y])

    canvas.text(_LEFT, 14, f"{title} ({unit})", 11, style='font-weight="bold"')
    for value in _ticks(low, high):
        canvas.path(np.array([place(first, value), place(last, value)]), f'stroke="{_GRID}"')
        x, y = place(first, value)
        canvas.text(float(x) - 6, float(y) + 3.5, figures(value, 1), 10, "end", 'fill="#555"')
    for view in _whole_ticks(first, last):
        x, y = place(view, low)
        canvas.path(np.array([[x, y], [x, y + 4]]), 'stroke="#777"')
        canvas.text(float(x), float(y) + 15, str(view), 10, "middle", 'fill="#555"')
    canvas.path(np.array([place(first, high), place(first, low), place(last, low)]), 'stroke="#777"')
    canvas.text(_WIDTH - _RIGHT, _HEIGHT - 4, "views", 10, "end", 'fill="#555"')
    if asked:
        line = np.array([place(first, asked), place(last, asked)])
        canvas.path(line, f'stroke="{_ASKED}" stroke-dasharray="6 4"')
        x, y = line[0].tolist()
        canvas.text(x + 6, y + 13, f"asked {figures(asked, 2)} {unit}", 10, "start", f'fill="{_ASKED}"')
    points = np.array([place(view, value) for view, value in zip(views, values, strict=True)])
    canvas.path(points, f'stroke="{_INK}" stroke-width="1.8" stroke-linejoin="round"')
    canvas.dots(points, 3, f'stroke="{_INK}"')
    return canvas.markup()


def _decades(low: float, high: float) -> tuple[float, float]:
    """Return limits that leave some room and are at least a factor of three apart."""
    low, high = low / 1.25, high * 1.25
    if high / low < 3:
        middle = np.sqrt(low * high)
        low, high = middle / np.sqrt(3), middle * np.sqrt(3)
    return float(low), float(high)


def _ticks(low: float, high: float) -> list[float]:
    """Return 1, 2 and 5 times powers of ten between two numbers; only powers where that were many."""
    powers = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    steps = (1, 2, 5) if high / low < 200 else (1,)
    return [step * 10.0**p for p in powers for step in steps if low <= step * 10.0**p <= high]


def _whole_ticks(first: int, last: int) -> list[int]:
    step = max(1, int(np.ceil((last - first) / 8)))
    return list(range(first, last + 1, step))
