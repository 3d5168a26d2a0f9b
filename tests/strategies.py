"""Hypothesis strategies shared by all tests: valid values of every type, and hostile input for parsers."""

from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from handeye.types import (
    LENSES,
    AprilGrid,
    ArucoGrid,
    ArucoMarker,
    Camera,
    Charuco,
    Chessboard,
    CircleGrid,
    Mounting,
    Pose,
    Recording,
    Target,
    Truth,
    View,
)

WIDTH_PX, HEIGHT_PX = 1280, 960


def floats(low: float, high: float) -> st.SearchStrategy[float]:
    """Finite numbers in a closed range."""
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


def vectors(n: int, size: float) -> st.SearchStrategy[NDArray[np.float64]]:
    """Vectors (n,) with entries from -size to size."""
    return st.lists(floats(-size, size), min_size=n, max_size=n).map(np.array)


@st.composite
def twists(draw: st.DrawFn, metres: float = 3.0, angle_rad: float = np.pi) -> NDArray[np.float64]:
    """Twists (6,), with rotation angles up to `angle_rad`, very small ones and zero among them."""
    direction = draw(vectors(3, 1.0))
    norm = np.linalg.norm(direction)
    axis = direction / norm if norm > 1e-3 else np.array([0.0, 0.0, 1.0])
    angle = draw(st.one_of(floats(0.0, angle_rad), st.sampled_from([0.0, 1e-12, 1e-8, 1e-5, 1e-3])))
    return np.concatenate([draw(vectors(3, metres)), angle * axis])


def poses(metres: float = 3.0, angle_rad: float = 0.999 * np.pi) -> st.SearchStrategy[Pose]:
    """Poses with any rotation up to `angle_rad`."""
    return twists(metres, angle_rad).map(Pose.exp)


@st.composite
def cameras(draw: st.DrawFn, lens: str | None = None) -> Camera:
    """Cameras of 1280 x 960 pixels with mild distortion, so that the model is one to one over the image."""
    lens = draw(st.sampled_from(sorted(LENSES))) if lens is None else lens
    focal = draw(floats(900.0, 2000.0))
    centre = [draw(floats(600.0, 680.0)), draw(floats(440.0, 520.0))]
    coefficients = [draw(floats(-1e-3, 1e-3)) for _ in LENSES[lens][4:]]
    return Camera(
        lens, [focal, focal * draw(floats(0.99, 1.01)), *centre, *coefficients], WIDTH_PX, HEIGHT_PX
    )


def chessboards() -> st.SearchStrategy[Chessboard]:
    """Chessboards of 2 to 12 corners a side."""
    return st.builds(Chessboard, st.integers(2, 12), st.integers(2, 12), floats(0.005, 0.2))


@st.composite
def circle_grids(draw: st.DrawFn) -> CircleGrid:
    """Symmetric and asymmetric circle grids, with and without a marked circle."""
    rows, columns, pitch = draw(st.integers(2, 12)), draw(st.integers(2, 12)), draw(floats(0.005, 0.2))
    diameter = pitch * draw(floats(0.2, 0.8))
    marked = draw(st.none() | st.integers(0, rows * columns - 1))
    marked_diameter = None if marked is None else draw(st.none() | st.just(1.1 * diameter))
    return CircleGrid(rows, columns, pitch, diameter, draw(st.booleans()), marked, marked_diameter)


def numbers(dictionary_size: int, markers: int) -> st.SearchStrategy[dict[str, object]]:
    """How the markers of a board are numbered, and whether it is printed light on dark."""
    listed = st.permutations(range(dictionary_size)).map(lambda order: tuple(order[:markers]))
    first = st.integers(0, dictionary_size - markers).map(lambda number: {"first_id": number})
    which = st.just({}) | first | listed.map(lambda ids: {"ids": ids})
    return st.builds(lambda how, inverted: {**how, "inverted": inverted}, which, st.booleans())


@st.composite
def charucos(draw: st.DrawFn) -> Charuco:
    """ChArUco boards of 3 to 12 squares a side."""
    square = draw(floats(0.005, 0.2))
    rows, columns = draw(st.integers(3, 12)), draw(st.integers(3, 12))
    marker = square * draw(floats(0.4, 0.9))
    how = draw(numbers(100, rows * columns // 2))
    return Charuco(rows, columns, square, marker, "DICT_5X5_100", draw(st.booleans()), **how)


@st.composite
def aprilgrids(draw: st.DrawFn) -> AprilGrid:
    """AprilGrids of 1 to 8 tags a side."""
    rows, columns = draw(st.integers(1, 8)), draw(st.integers(1, 8))
    how = draw(numbers(587, rows * columns))
    border = draw(st.integers(1, 2))
    return AprilGrid(
        rows, columns, draw(floats(0.01, 0.2)), draw(floats(0.1, 0.5)), border_bits=border, **how
    )


@st.composite
def aruco_grids(draw: st.DrawFn) -> ArucoGrid:
    """Grids of 1 to 7 markers a side."""
    rows, columns = draw(st.integers(1, 7)), draw(st.integers(1, 7))
    side = draw(floats(0.01, 0.2))
    how = draw(numbers(250, rows * columns))
    return ArucoGrid(rows, columns, side, side * draw(floats(0.05, 1.5)), "DICT_6X6_250", **how)


def aruco_markers() -> st.SearchStrategy[ArucoMarker]:
    """Single markers."""
    return st.builds(ArucoMarker, floats(0.01, 0.2), st.just("DICT_ARUCO_ORIGINAL"), st.integers(0, 1023))


def targets() -> st.SearchStrategy[Target]:
    """Targets of every family."""
    return st.one_of(chessboards(), circle_grids(), charucos(), aprilgrids(), aruco_grids(), aruco_markers())


@st.composite
def views(draw: st.DrawFn, name: str, target: Target) -> View:
    """Views of some points of a target, at pixels inside the image that need not fit any pose."""
    count = draw(st.integers(1, min(target.point_count, 20)))
    ids = draw(st.permutations(range(target.point_count)))[:count]
    pixels = [[draw(floats(0.0, WIDTH_PX - 1.0)), draw(floats(0.0, HEIGHT_PX - 1.0))] for _ in ids]
    return View(
        name,
        draw(poses()),
        ids,
        pixels,
        timestamp_s=draw(st.none() | floats(0.0, 2e9)),
        joints_rad=draw(st.none() | st.lists(floats(-6.0, 6.0), min_size=6, max_size=6)),
    )


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    """Recordings of 0 to 3 views, valid but not consistent geometrically."""
    target = draw(targets())
    count = draw(st.integers(0, 3))
    truths = st.builds(Truth, poses(), st.none() | poses()) | st.builds(Truth, st.none(), poses())
    printable = st.characters(exclude_categories=("Cc", "Cf", "Cn", "Co", "Cs", "Zl", "Zp", "Zs"))
    return Recording(
        name=draw(st.text(printable, min_size=1, max_size=20)),
        mounting=draw(st.sampled_from(Mounting)),
        camera=draw(cameras()),
        target=target,
        views=tuple(draw(views(f"view_{index:02d}", target)) for index in range(count)),
        truth=draw(st.none() | truths),
        source=draw(st.text(printable | st.just("\n"), max_size=20)),
    )


def plain_values() -> st.SearchStrategy[object]:
    """Whatever JSON or TOML can hold, with numbers at the edges."""
    scalars = (
        st.none()
        | st.booleans()
        | st.integers()
        | st.sampled_from([2**31, 2**63, 2**64, -(2**63), 10**400])
        | st.floats(allow_nan=True, allow_infinity=True)
        | st.text(max_size=8)
    )
    return st.recursive(
        scalars,
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
        max_leaves=10,
    )


@st.composite
def mutated(draw: st.DrawFn, original: bytes, words: Sequence[bytes] = ()) -> bytes:
    """A valid file with bytes replaced, cut out, doubled or cut off, or with words put in."""
    content = bytearray(original)
    vocabulary = [
        b"nan",
        b"inf",
        b"-1",
        b"1e400",
        b"../..",
        b"/etc",
        b"\x00",
        b"\xff\xfe",
        b"9" * 5000,
        *words,
    ]
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(content)))
        stop = min(len(content), start + draw(st.integers(0, 30)))
        change = draw(st.sampled_from(["replace", "cut", "double", "truncate", "word"]))
        if change == "replace":
            content[start:stop] = draw(st.binary(max_size=10))
        elif change == "cut":
            del content[start:stop]
        elif change == "double":
            content[start:start] = content[start:stop]
        elif change == "truncate":
            del content[start:]
        else:
            content[start:stop] = draw(st.sampled_from(vocabulary))
    return bytes(content)
