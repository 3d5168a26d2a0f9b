"""Sketches of where things stand: the whole cell, and the camera on its mount."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from handeye.report.canvas import Canvas
from handeye.report.document import Answer
from handeye.report.gathering import Scene
from handeye.report.projection import Outlook, outlook_on
from handeye.report.wording import figures, fixed
from handeye.types import Camera, Mounting, Pose
from handeye.types.arrays import FloatArray

# Axes x, y, z; ink of things.
_RED, _GREEN, _BLUE = "#c62828", "#2e7d32", "#1565c0"
_CAMERA, _LEFT_OUT, _TARGET, _FLOOR = "#37474f", "#e08e0b", "#6d4c41", "#d9dde1"
_WIDTH, _HEIGHT, _MARGIN = 720.0, 430.0, 34.0
_SMALL = (400.0, 340.0)
# A pinhole of this half width over its distance, where the camera is not known.
_USUAL_FIELD = (0.5, 0.35)
_MOST_NUMBERED = 40


@dataclass
class _Sketch:
    """Shapes with their places, drawn from far to near."""

    shapes: list[tuple[FloatArray, Callable[[Canvas, FloatArray], None]]] = field(
        default_factory=list[tuple[FloatArray, Callable[[Canvas, FloatArray], None]]]
    )
    notes: list[tuple[FloatArray, str, str, float, str]] = field(
        default_factory=list[tuple[FloatArray, str, str, float, str]]
    )
    extent: list[FloatArray] = field(default_factory=list[FloatArray])

    def line(self, points: FloatArray, style: str, *, closed: bool = False) -> None:
        """Add a line through points (N, 3)."""
        self.shapes.append((points, lambda canvas, places: canvas.path(places, style, closed=closed)))
        self.extent.append(points)

    def note(self, point: FloatArray, text: str, style: str, size: float = 11, anchor: str = "start") -> None:
        """Add words beside a point (3,)."""
        self.notes.append((point, text, style, size, anchor))

    def triad(self, pose: Pose, length: float, width: float, name: str = "") -> None:
        """Add the axes of a frame."""
        origin = pose.translation
        for axis, colour in zip(pose.rotation.T, (_RED, _GREEN, _BLUE), strict=True):
            ends = np.array([origin, origin + length * axis])
            self.line(ends, f'stroke="{colour}" stroke-width="{width}" stroke-linecap="round"')
        if name:
            # Where none of the axes goes.
            beside = origin - 0.3 * length * pose.rotation.sum(axis=1)
            self.note(beside, name, 'font-weight="bold" fill="#111"', 12, "middle")

    def camera(self, pose: Pose, camera: Camera | None, depth: float, colour: str, width: float) -> None:
        """Add the pyramid that a camera sees."""
        corners = pose.act(_pyramid(camera) * depth)
        style = f'stroke="{colour}" stroke-width="{width}" stroke-linejoin="round"'
        self.line(corners[1:], f'{style} fill="{colour}" fill-opacity="0.10"', closed=True)
        for corner in corners[1:]:
            self.line(np.array([corners[0], corner]), style)
        # Which way is up in the picture.
        above = np.array(
            [corners[1], (corners[1] + corners[2]) / 2 + 0.25 * (corners[1] - corners[4]), corners[2]]
        )
        self.line(above, f'{style} fill="{colour}" fill-opacity="0.35"', closed=True)

    def drawn(self, outlook: Outlook, label: str, width: float = _WIDTH, height: float = _HEIGHT) -> Canvas:
        """Draw everything, words last."""
        canvas = Canvas(width, height, label)
        order = sorted(self.shapes, key=lambda shape: float(outlook.nearness(shape[0]).mean()))
        for points, draw in order:
            draw(canvas, outlook(points))
        room = _Room()
        for point, text, style, size, anchor in self.notes:
            x, y = outlook(point[np.newaxis])[0].tolist()
            shift = 5 if anchor == "start" else 0
            # A white rim keeps words readable on lines.
            canvas.text(
                x + shift,
                room.baseline(x + shift, y - 4, text, size, anchor),
                text,
                size,
                anchor,
                f'{style} paint-order="stroke" stroke="#fff" stroke-width="3" stroke-linejoin="round"',
            )
        return canvas


class _Room:
    """Where words may stand: no line of them over another."""

    def __init__(self) -> None:
        self._taken: list[tuple[float, float, float, float]] = []

    def baseline(self, x: float, y: float, text: str, size: float, anchor: str) -> float:
        """Return the baseline nearest to y on which a text lies over no other, and take it."""
        # Letters are at most about so wide, on average; a line is as high as its letters and a rim.
        width, height = 0.62 * size * len(text), 1.15 * size
        left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * width
        steps = (sign * 0.5 * k * height for k in range(40) for sign in (1, -1))
        place = next(y + step for step in steps if not self._covers(left, y + step, width, height))
        self._taken.append((left, place - height, left + width, place))
        return place

    def _covers(self, left: float, baseline: float, width: float, height: float) -> bool:
        return any(
            left < right and low < left + width and baseline - height < below and above < baseline
            for low, above, right, below in self._taken
        )


def cell_picture(scene: Scene) -> str:
    """Draw base, flanges, cameras and target of all views, as seen from a corner of the cell."""
    sketch = _Sketch()
    places = np.vstack([np.zeros(3), *_places(scene)])
    size = _size(places)
    step = _floor(sketch, places, size)
    sketch.triad(Pose.identity(), 0.13 * size, 2.6, "base")
    _views(sketch, scene, size, numbered=False)
    canvas = _drawn(sketch, "Base, flange poses, cameras and target")
    words = f"grid: z = 0 of the base, {figures(1000 * step, 1)} mm"
    canvas.text(_WIDTH - 6, _HEIGHT - 6, words, 10, "end", 'fill="#8a949c"')
    return canvas.markup()


def views_picture(scene: Scene) -> str:
    """Draw the views alone, so that they can be told apart: cameras and target, with their numbers."""
    sketch = _Sketch()
    _views(sketch, scene, _size(np.vstack(_places(scene))), numbered=True)
    return _drawn(sketch, "Cameras and target of every view, numbered").markup()


def _drawn(sketch: _Sketch, label: str) -> Canvas:
    return sketch.drawn(outlook_on(np.vstack(sketch.extent), _WIDTH, _HEIGHT, _MARGIN), label)


def _size(places: FloatArray) -> float:
    return float(np.ptp(places, axis=0).max()) or 1.0


def _places(scene: Scene) -> list[FloatArray]:
    """Return where flanges, cameras and targets are."""
    cameras, targets = _cameras_and_targets(scene)
    flanges = [pose for _, pose, _ in scene.flanges]
    return [pose.translation for pose in (*flanges, *cameras, *targets)]


def _cameras_and_targets(scene: Scene) -> tuple[list[Pose], list[Pose]]:
    """Return the poses of cameras and targets in the base: one still, one for every view."""
    if scene.mounting is Mounting.EYE_IN_HAND:
        return [pose @ scene.T_parent_camera for _, pose, _ in scene.flanges], [scene.T_fixed_target]
    return [scene.T_parent_camera], [pose @ scene.T_fixed_target for _, pose, _ in scene.flanges]


def _views(sketch: _Sketch, scene: Scene, size: float, *, numbered: bool) -> None:
    in_hand = scene.mounting is Mounting.EYE_IN_HAND
    cameras, targets = _cameras_and_targets(scene)
    # Many small ones are easier to tell apart than many large ones.
    crowd = max(1.0, np.sqrt(len(scene.flanges) / 8))
    flanges = [pose.translation for _, pose, _ in scene.flanges]
    if len(flanges) > 1:
        sketch.line(np.array(flanges), 'stroke="#9aa5ad" stroke-width="0.8" stroke-dasharray="3 3"')
    for number, (_, pose, used) in enumerate(scene.flanges, start=1):
        colour = _CAMERA if used else _LEFT_OUT
        sketch.triad(pose, 0.045 * size / crowd, 1.3)
        if in_hand:
            camera = cameras[number - 1]
            ends = np.array([pose.translation, camera.translation])
            sketch.line(ends, f'stroke="{colour}" stroke-width="1"')
            sketch.camera(camera, scene.camera, 0.09 * size / crowd, colour, 0.8)
        else:
            _target(sketch, scene, targets[number - 1], size, faint=True, used=used)
        if numbered and len(scene.flanges) <= _MOST_NUMBERED:
            # In the picture of the camera, as flanges often turn on the spot.
            ahead = np.array([[0.0, 0.0, 0.09 * size / crowd]])
            place = cameras[number - 1].act(ahead)[0] if in_hand else targets[number - 1].translation
            sketch.note(place, str(number), 'fill="#333"', 10)
    if in_hand:
        _target(sketch, scene, scene.T_fixed_target, size, faint=False, used=True)
        sketch.triad(scene.T_fixed_target, 0.1 * size, 2.0, "target")
    else:
        sketch.camera(scene.T_parent_camera, scene.camera, 0.14 * size, _CAMERA, 1.2)
        sketch.triad(scene.T_parent_camera, 0.06 * size, 1.6, "camera")


def mount_picture(scene: Scene, answer: Answer) -> str:
    """Draw the camera in the frame that it is fixed to, with the region of its position, enlarged."""
    sketch = _Sketch()
    pose = scene.T_parent_camera
    size = max(float(np.linalg.norm(pose.translation)), 1e-3)
    sketch.camera(pose, scene.camera, 0.45 * size, _CAMERA, 1.0)
    _steps(sketch, pose.translation, answer.position_mm)
    sketch.triad(Pose.identity(), 0.5 * size, 2.6, answer.parent)
    sketch.triad(pose, 0.3 * size, 2.2, "camera")
    longest = answer.position_axes[0].half_length_mm / 1000
    factor = _round_down(0.22 * size / max(longest, 1e-12))
    halves = np.array(
        [np.multiply(axis.direction_in_parent, axis.half_length_mm / 1000) for axis in answer.position_axes]
    )
    around = np.linspace(0, 2 * np.pi, 49)
    for i, j in ((0, 1), (0, 2), (1, 2)):
        ring = np.outer(np.cos(around), halves[i]) + np.outer(np.sin(around), halves[j])
        sketch.line(
            pose.translation + factor * ring,
            'stroke="#8e24aa" stroke-width="1" fill="#8e24aa" fill-opacity="0.08"',
        )
    width, height = _SMALL
    outlook = outlook_on(np.vstack(sketch.extent), width, height, _MARGIN)
    canvas = sketch.drawn(outlook, f"The camera in the frame of the {answer.parent}", width, height)
    times = f"{factor:,.0f}".replace(",", "\N{NARROW NO-BREAK SPACE}")
    enlarged = f"{times} times enlarged" if factor > 1 else "not enlarged"
    canvas.text(
        width - 4, height - 6, f"95 % region of the position, {enlarged}", 11, "end", 'fill="#8e24aa"'
    )
    return canvas.markup()


def _steps(sketch: _Sketch, translation: FloatArray, position_mm: list[float]) -> None:
    """Draw the way to the camera along x, y and z, with its lengths."""
    corner = np.zeros(3)
    for axis, (name, colour) in enumerate(zip("xyz", (_RED, _GREEN, _BLUE), strict=True)):
        following = corner.copy()
        following[axis] = translation[axis]
        sketch.line(
            np.array([corner, following]), f'stroke="{colour}" stroke-width="1" stroke-dasharray="5 3"'
        )
        sketch.note((corner + following) / 2, f"{name} {fixed(position_mm[axis], 2)} mm", f'fill="{colour}"')
        corner = following


def _floor(sketch: _Sketch, places: FloatArray, size: float) -> float:
    """Draw the plane z = 0 of the base as a grid of round steps; return the step."""
    step = _round_down(size / 4)
    low = np.floor(places.min(axis=0) / step)[:2]
    high = np.maximum(np.ceil(places.max(axis=0) / step)[:2], low + 1)
    style = f'stroke="{_FLOOR}" stroke-width="1"'
    for axis in (0, 1):
        for at in range(int(low[axis]), int(high[axis]) + 1):
            ends = np.zeros((2, 3))
            ends[:, axis] = at
            ends[:, 1 - axis] = low[1 - axis], high[1 - axis]
            sketch.line(ends * step, style)
    return step


def _target(sketch: _Sketch, scene: Scene, pose: Pose, size: float, *, faint: bool, used: bool) -> None:
    if scene.target is None:
        half = 0.06 * size
        outline = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
    else:
        low, high = scene.target.points.min(axis=0), scene.target.points.max(axis=0)
        edge = 0.06 * float(np.max(high - low))
        (x0, y0, _), (x1, y1, _) = low - edge, high + edge
        outline = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]])
    colour = _TARGET if used else _LEFT_OUT
    opacity = "0.04" if faint else "0.16"
    style = (
        f'stroke="{colour}" stroke-width="{0.8 if faint else 1.4}" fill="{colour}" fill-opacity="{opacity}"'
    )
    sketch.line(pose.act(outline), style, closed=True)


def _pyramid(camera: Camera | None) -> FloatArray:
    """Return the tip and the four corners (5, 3), upper left first, of what a camera sees at distance one."""
    if camera is None:
        x, y = _USUAL_FIELD
        return np.array([[0, 0, 0], [-x, -y, 1], [x, -y, 1], [x, y, 1], [-x, y, 1]], dtype=float)
    fx, fy, cx, cy = camera.parameters[:4]
    left, right = -(cx + 0.5) / fx, (camera.width_px - cx - 0.5) / fx
    top, bottom = -(cy + 0.5) / fy, (camera.height_px - cy - 0.5) / fy
    return np.array(
        [[0, 0, 0], [left, top, 1], [right, top, 1], [right, bottom, 1], [left, bottom, 1]], dtype=float
    )


def _round_down(value: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20, ... (and their fractions) that is not more."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-9)) * power)
