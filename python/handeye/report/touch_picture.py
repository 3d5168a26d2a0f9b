"""The touch error over a box of work: level by level, as seen from above."""

import numpy as np

from handeye.export.solved import Touch
from handeye.report.canvas import Canvas
from handeye.report.wording import figures, fixed
from handeye.types.arrays import FloatArray

_SIDE, _GAP, _LEFT, _TOP, _BOTTOM = 150.0, 24.0, 46.0, 22.0, 30.0
_LOW, _HIGH = np.array([227.0, 238.0, 249.0]), np.array([21.0, 101.0, 192.0])
_WORST = 'stroke="#c62828" stroke-width="2"'
_EDGE = 'stroke="#b0b8be" stroke-width="0.8"'
# White words on what is darker than this share of the scale.
_DARK = 0.7


def touch_picture(touch: Touch) -> str:
    """Draw the radius at every point of the map, one square for each height; darker is farther off.

    Parameters
    ----------
    touch
        The map; a point that is out of reach or sight is missing in it, and stays white.

    Returns
    -------
    str
        An SVG picture.

    Examples
    --------
    >>> touch_picture(touch).startswith("<svg")
    True
    """
    points = np.array([one.point_mm for one in touch.map])
    radii = np.array([one.radius_mm for one in touch.map])
    xs, ys, zs = (np.unique(np.round(points[:, axis], 3)) for axis in range(3))
    width = _LEFT + len(zs) * (_SIDE + _GAP)
    canvas = Canvas(width, _TOP + _SIDE + _BOTTOM, "Touch error over the box of work, by height")
    low, high = float(radii.min()), float(radii.max())
    cell = np.array([_SIDE / len(xs), _SIDE / len(ys)])
    worst = int(radii.argmax())
    for level, z in enumerate(zs):
        corner = np.array([_LEFT + level * (_SIDE + _GAP), _TOP])
        canvas.text(float(corner[0]), 14, f"at z = {fixed(float(z), 0)} mm", 11, style='font-weight="bold"')
        canvas.box(float(corner[0]), float(corner[1]), _SIDE, _SIDE, f'fill="#ffffff" {_EDGE}')
        for number in np.flatnonzero(np.isclose(points[:, 2], z, atol=1e-2)):
            column, row = np.abs(xs - points[number, 0]).argmin(), np.abs(ys - points[number, 1]).argmin()
            # x to the right and y upwards, as on a drawing of the cell from above.
            at = corner + cell * np.array([column, len(ys) - 1 - row])
            share = (radii[number] - low) / (high - low) if high > low else 0.0
            inset = 1.5 if number == worst else 0.0
            x, y = (at + inset).tolist()
            w, h = (cell - 2 * inset).tolist()
            canvas.box(x, y, w, h, f'fill="{_colour(share)}" {_WORST if number == worst else _EDGE}')
            ink = "#ffffff" if share > _DARK else "#263238"
            x, y = (at + cell / 2).tolist()
            canvas.text(x, y + 4, figures(float(radii[number]), 2), 11, "middle", f'fill="{ink}"')
        for x, value in zip((0.5, len(xs) - 0.5), (xs[0], xs[-1]), strict=True):
            canvas.text(
                float(corner[0] + x * cell[0]), _TOP + _SIDE + 13, fixed(float(value), 0), 10, "middle"
            )
        canvas.text(float(corner[0]) + _SIDE / 2, _TOP + _SIDE + 26, "x in mm", 10, "middle")
    for row, value in ((len(ys) - 1, ys[0]), (0, ys[-1])):
        canvas.text(_LEFT - 5, _TOP + (row + 0.5) * float(cell[1]) + 3, fixed(float(value), 0), 10, "end")
    canvas.text(_LEFT - 5, _TOP + _SIDE / 2 + 3, "y", 10, "end")
    return canvas.markup()


def _colour(share: float) -> str:
    mixed: FloatArray = _LOW + share * (_HIGH - _LOW)
    return "#" + "".join(f"{round(value):02x}" for value in mixed.tolist())
