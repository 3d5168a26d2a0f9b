"""Measure what is taken for a chessboard's corner and is none, side by side with OpenCV's two finders.

    python tools/measure_corners.py boards --first 0 --count 2000

Boards of 3 x 3 to 9 x 12 corners with margins of 0.2 to 1 square are drawn through a lens before a plain,
dark or cluttered ground, with hard shadows, reflections, defocus, gamma of 0.4 to 2.2, noise and JPEG; some
are cut by the picture's edge or covered in part, some of another size than
is looked for, some not there.
"""

import argparse
import time
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from handeye import _core
from handeye.cameras.render import Appearance, BoardRenderer, clutter
from handeye.detection import Detection, NotFound, detect
from handeye.types import Camera, Chessboard, Pose

WIDTH, HEIGHT = 960, 720
CAMERA = Camera("brown_conrady_5", [1050, 1047, 484, 356, -0.12, 0.08, 5e-4, -4e-4, 0.0], WIDTH, HEIGHT)
# A corner further off is none; OpenCV, which does not measure as finely, is allowed more.
WRONG_PX, OPENCV_PX = 1.0, 3.0


@dataclass(frozen=True, eq=False)
class Drawn:
    """A picture, what is looked for in it, and where (P, 2) the corners are; None where they are not."""

    image: np.ndarray
    target: Chessboard
    truth: np.ndarray | None
    kind: str


@cache
def ground(seed: int) -> np.ndarray:
    """A cluttered ground."""
    return clutter(WIDTH, HEIGHT, np.random.default_rng(seed))


def pose(target: Chessboard, random: np.random.Generator, aside: float) -> Pose:
    """A pose in which the board with its margin is in the picture, or off its middle by so much of it."""
    tilt = random.uniform(-1, 1, 3) * [0.75, 0.75, np.pi]
    rotation = Pose.exp(np.concatenate([np.zeros(3), tilt])).rotation
    squares = max(target.rows, target.columns) + 2
    side = random.uniform(14, 0.85 * HEIGHT / squares)
    distance = CAMERA.parameters[0] * target.pitch_m / side
    angle = random.uniform(0, 2 * np.pi)
    room = max(0.0, 0.4 - side * squares / WIDTH / 2) if aside == 0 else aside
    shift = room * distance * WIDTH / CAMERA.parameters[0] * np.array([np.cos(angle), 0.7 * np.sin(angle)])
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    middle = target.points.mean(axis=0)
    matrix[:3, 3] = np.append(shift, distance) - rotation @ middle
    return Pose(matrix)


def drawn(number: int) -> Drawn:
    """One of the pictures."""
    random = np.random.default_rng([17, number])
    kinds = ("whole", "whole", "whole", "shadow", "shadow", "glare", "cut", "covered", "other size", "none")
    kind = kinds[number % len(kinds)]
    rows, columns = sorted((int(random.integers(3, 10)), int(random.integers(3, 13))))
    target = Chessboard(rows, columns, 0.03)
    margin = float(random.uniform(0.2, 1.0))
    before = (15.0, 60.0, 200.0, ground(0), ground(1), ground(2))[int(random.integers(6))]
    if kind == "none":
        image = ground(int(random.integers(40))).astype(np.float64)
        truth = None
    else:
        look = Appearance(margin_m=margin * target.pitch_m, background=before)
        where = pose(target, random, float(random.uniform(0.25, 0.6)) if kind == "cut" else 0.0)
        image = BoardRenderer(CAMERA, target, look).image(where).astype(np.float64)
        truth = _core.project_features(
            CAMERA.lens, CAMERA.parameters, where.matrix, target.points, target.radii_m
        )[0]
    spoil(image, kind, truth, random)
    image = cv2.GaussianBlur(image, (0, 0), random.uniform(0.4, 1.6))
    image = 255 * (image.clip(0, 255) / 255) ** np.exp(random.uniform(np.log(0.4), np.log(2.2)))
    image = image + random.normal(scale=random.uniform(0, 4), size=image.shape)
    grey = np.rint(image.clip(0, 255)).astype(np.uint8)
    if random.random() < 0.3:
        grey = cv2.imdecode(cv2.imencode(".jpg", grey, [1, 85])[1], cv2.IMREAD_GRAYSCALE)
    if kind == "other size":
        step = (1, 0) if random.random() < 0.5 else (0, -1) if columns > 3 else (0, 1)
        return Drawn(grey, Chessboard(rows + step[0], columns + step[1], 0.03), None, kind)
    return Drawn(grey, target, truth, kind)


def spoil(image: np.ndarray, kind: str, truth: np.ndarray | None, random: np.random.Generator) -> None:
    """Cast a shadow or a reflection, or lay something over the board."""
    v, u = np.indices(image.shape)
    middle = np.array([WIDTH, HEIGHT]) / 2 if truth is None else truth.mean(axis=0)
    reach = 100.0 if truth is None else float(np.ptp(truth, axis=0).min()) / 2
    angle, off = random.uniform(0, 2 * np.pi), random.uniform(-0.8, 0.8) * reach
    away = (u - middle[0]) * np.cos(angle) + (v - middle[1]) * np.sin(angle) - off
    if kind == "shadow":
        image[away > 0] *= random.uniform(0.25, 0.7)
    elif kind == "glare":
        at = middle + random.uniform(-1, 1, 2) * reach
        size = random.uniform(0.1, 0.7) * reach
        image += 400 * np.exp(-((((u - at[0]) ** 2 + (v - at[1]) ** 2) / (2 * size**2)) ** 2))
    elif kind == "covered":
        part = (away > 0) & (away < random.uniform(0.2, 1.0) * reach)
        image[part] = random.uniform(0, 255)


def off_px(target: Chessboard, found: Detection, truth: np.ndarray) -> float:
    """Largest distance of a corner from where it is, under whichever labels that look alike fit best."""
    away = [
        np.linalg.norm(found.pixels - truth[turn.permutation[found.point_ids]], axis=1).max()
        for turn in target.turns
    ]
    return float(min(away))


def opencv(image: np.ndarray, target: Chessboard, truth: np.ndarray | None) -> list[str]:
    """What OpenCV's two finders make of it: right, wrong or not found."""
    answers: list[str] = []
    size = (target.columns, target.rows)
    for finder in (cv2.findChessboardCorners, cv2.findChessboardCornersSB):
        found, corners = finder(image, size)
        if not found:
            answers.append("not found")
            continue
        if truth is None:
            answers.append("wrong")
            continue
        away = np.linalg.norm(corners.reshape(-1, 1, 2) - truth, axis=2).min(axis=1)
        answers.append("wrong" if away.max() > OPENCV_PX else "right")
    return answers


def boards(first: int, count: int, is_alone: bool) -> None:
    """Print for each kind of picture how many boards were found, rightly and wrongly."""
    tables: dict[str, dict[str, int]] = {}
    squares: list[float] = []
    for number in range(first, first + count):
        picture = drawn(number)
        row = tables.setdefault(picture.kind, dict.fromkeys(COLUMNS, 0))
        row["pictures"] += 1
        began = time.process_time()
        found = detect(picture.image, picture.target)
        row["ms"] += round(1e3 * (time.process_time() - began))
        is_right = False
        if isinstance(found, NotFound):
            row["not found"] += 1
        elif picture.truth is None or off_px(picture.target, found, picture.truth) > WRONG_PX:
            row["wrong"] += 1
            away = None if picture.truth is None else off_px(picture.target, found, picture.truth)
            print(
                f"wrong: {number} {picture.kind} {picture.target} {len(found)} points, {away} px", flush=True
            )
        else:
            is_right = True
            row["right"] += 1
            row["points left out"] += picture.target.point_count - len(found)
            squares.append(off_px(picture.target, found, picture.truth))
        if is_alone:
            continue
        answers = opencv(picture.image, picture.target, picture.truth)
        row["OpenCV right"] += "right" in answers
        row["OpenCV wrong"] += "wrong" in answers
        if "right" in answers and not is_right:
            row["OpenCV only"] += 1
            print(f"OpenCV only: {number} {picture.kind} {picture.target} {found}", flush=True)
    print("| picture | " + " | ".join(COLUMNS) + " |\n|---" * (len(COLUMNS) + 1) + "|")
    total = dict.fromkeys(COLUMNS, 0)
    for kind, row in tables.items():
        print(f"| {kind} | " + " | ".join(str(row[column]) for column in COLUMNS) + " |")
        total = {column: total[column] + row[column] for column in COLUMNS}
    print("| all | " + " | ".join(str(total[column]) for column in COLUMNS) + " |")
    worst = np.percentile(squares, [50, 90, 99, 100]) if squares else []
    print("largest error of a picture, px: 50, 90, 99, 100 % of the pictures:", np.round(worst, 3))


COLUMNS = (
    "pictures", "right", "wrong", "not found", "points left out", "ms", "OpenCV right", "OpenCV wrong",
    "OpenCV only",
)  # fmt: skip


def main() -> None:
    """Run one of the measurements."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("boards",))
    parser.add_argument("--first", type=int, default=0, help="number of the first picture")
    parser.add_argument("--count", type=int, default=2000, help="number of pictures")
    parser.add_argument("--alone", action="store_true", help="without OpenCV")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    boards(options.first, options.count, options.alone)


if __name__ == "__main__":
    main()
