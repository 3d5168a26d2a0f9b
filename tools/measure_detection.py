"""Measure detection: time with and without a prediction, accuracy, and views lost.

    python tools/measure_detection.py speed
    python tools/measure_detection.py rendered --first 0 --count 200 --rows rows.csv
    python tools/measure_detection.py summary --rows rows.csv
    python tools/measure_detection.py none
    python tools/measure_detection.py large
    HANDEYE_DATA=... python tools/measure_detection.py public

Times are of one processor; those of `speed` are the least of several, the others medians over the views.
Parts of the 1,000 rendered views can be measured one after the other: their rows are added to a file.
"""

import argparse
import os
import time
from pathlib import Path

import cv2
import numpy as np

from handeye import _core
from handeye.cameras.render import Appearance, BoardRenderer, clutter
from handeye.datasets import ImageSet, load
from handeye.detection import Detection, NotFound, Prediction, calibrate_camera, detect, relabeled
from handeye.detection.registration import printed
from handeye.types import AprilGrid, Camera, Charuco, Chessboard, CircleGrid, Pose, Target

WIDTH, HEIGHT = 1280, 1024
CAMERA = Camera("brown_conrady_5", [1400, 1396, 645, 508, -0.12, 0.08, 5e-4, -4e-4, 0.0], WIDTH, HEIGHT)
TARGETS: dict[str, Target] = {
    "chessboard": Chessboard(6, 9, 0.03),
    "circle grid": CircleGrid(7, 9, 0.03, 0.015),
    "circle grid, asymmetric": CircleGrid(11, 4, 0.02, 0.018, asymmetric=True),
    "circle grid, marked": CircleGrid(7, 9, 0.03, 0.012, marked=31, marked_diameter_m=0.02),
    "ChArUco": Charuco(7, 10, 0.03, 0.0225, "DICT_5X5_100"),
    "AprilGrid": AprilGrid(5, 6, 0.035, 0.3),
    "AprilGrid, border 1": AprilGrid(5, 6, 0.035, 0.3, border_bits=1),
}
PUBLIC = (
    "rwhe-calib/CS_synthetic_1", "rwhe-calib/CS_synthetic_2", "rwhe-calib/CS_synthetic_3",
    "rwhe-calib/kuka_1", "rwhe-calib/kuka_2", "robot_cal_tools/test_set_10x10",
)  # fmt: skip
ERROR_PX, MARGIN_PX = 8.0, 20.0


def posed(target: Target, share: float, random: np.random.Generator, tilt_rad: float = 0.6) -> Pose:
    """A pose in which the longer side of the board takes a share of the image's width."""
    turn = random.uniform(-1, 1, 3) * [tilt_rad, tilt_rad, 0.8]
    rotation = Pose.exp(np.concatenate([np.zeros(3), turn])).rotation
    low, high = target.points.min(axis=0), target.points.max(axis=0)
    distance = CAMERA.parameters[0] * float((high - low).max()) / (share * WIDTH)
    room = max(0.0, 0.42 - share / 2)
    aside = random.uniform(-room, room, 2) * [1.0, HEIGHT / WIDTH] * WIDTH / CAMERA.parameters[0] * distance
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    matrix[:3, 3] = np.append(aside, distance) - rotation @ ((low + high) / 2)
    return Pose(matrix)


def projected(target: Target, pose: Pose) -> np.ndarray:
    """Pixels (P, 2) of the points."""
    return _core.project_features(CAMERA.lens, CAMERA.parameters, pose.matrix, target.points, target.radii_m)[
        0
    ]


def off(pixels: np.ndarray, random: np.random.Generator) -> Prediction:
    """A prediction that is off by a shift, a turn and a change of size."""
    middle = np.nanmean(pixels, axis=0)
    angle, size = random.normal(scale=0.01), 1 + random.normal(scale=0.01)
    turn = size * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return Prediction((pixels - middle) @ turn + middle + random.normal(scale=ERROR_PX, size=2), MARGIN_PX)


def timed(image: np.ndarray, target: Target, predicted: Prediction | None, rounds: int = 3) -> float:
    """Least processor time in ms."""
    times: list[float] = []
    for _ in range(rounds):
        began = time.process_time()
        detect(image, target, predicted=predicted)
        times.append(time.process_time() - began)
    return 1e3 * min(times)


def differences(target: Target, a: Detection, b: Detection) -> tuple[float, float]:
    """Largest and root mean square distance in px of points found both ways, under the best of the labels."""
    best = np.inf, np.inf
    for permutation in target.symmetries:
        named = relabeled(b, permutation)
        common, here, there = np.intersect1d(a.point_ids, named.point_ids, return_indices=True)
        if len(common):
            away = np.linalg.norm(a.pixels[here] - named.pixels[there], axis=1)
            best = min(best, (float(away.max()), float(np.sqrt((away**2).mean()))))
    return best


def rms(target: Target, found: Detection, truth: np.ndarray) -> float:
    """Root mean square distance from the projection, under the labels that fit best."""
    squares = [
        ((found.pixels - truth[p[found.point_ids]]) ** 2).sum(axis=1).mean() for p in target.symmetries
    ]
    return float(np.sqrt(min(squares)))


def speed(views: int) -> None:
    """Print a table of times and ratios for each family, on a plain and on a cluttered background."""
    print("| target | background | whole image | predicted | ratio |\n|---|---|---|---|---|")
    for name, target in TARGETS.items():
        for background in ("plain", "cluttered"):
            look = Appearance(blur_px=0.6, noise=2.0)
            if background == "cluttered":
                look = Appearance(
                    background=clutter(WIDTH, HEIGHT, np.random.default_rng(3)), blur_px=0.6, noise=2.0
                )
            renderer = BoardRenderer(CAMERA, target, look)
            random = np.random.default_rng(7)
            whole, part = 0.0, 0.0
            for _ in range(views):
                pose = posed(target, float(random.uniform(0.3, 0.5)), random)
                image = renderer.image(pose, random)
                prediction = off(projected(target, pose), random)
                whole += timed(image, target, None) / views
                part += timed(image, target, prediction) / views
            print(
                f"| {name} | {background} | {whole:.0f} ms | {part:.1f} ms | {whole / part:.1f} |", flush=True
            )


def boardless() -> dict[str, np.ndarray]:
    """Pictures of 2.3 MP without a board: clutter, noise, and a wall lit from one side."""
    width, height = 1920, 1200
    random = np.random.default_rng(77)
    pictures = {f"clutter {k}": clutter(width, height, random).astype(float) for k in range(3)}
    pictures |= {"grey": np.full((height, width), 120.0)}
    pictures |= {"wall": np.broadcast_to(np.linspace(60, 180, width), (height, width))}
    looks = {name: (picture, 2.0) for name, picture in pictures.items()}
    looks |= {f"{name}, noise of 12": (pictures[name], 12.0) for name in ("clutter 0", "grey")}
    return {
        name: np.rint(
            (cv2.GaussianBlur(picture, (0, 0), 0.8) + random.normal(scale=noise, size=picture.shape)).clip(
                0, 255
            )
        ).astype(np.uint8)
        for name, (picture, noise) in looks.items()
    }


def without_board() -> None:
    """Print the processor time that pictures without a board cost, for each family."""
    print("| picture | " + " | ".join(TARGETS) + " |\n|---" + "|---" * len(TARGETS) + "|")
    for name, image in boardless().items():
        cells = [f"{timed(image, target, None):.0f} ms" for target in TARGETS.values()]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def large() -> None:
    """Print the processor time of pictures of 20 MP, with a board and without, beside OpenCV."""
    for name, target in TARGETS.items():
        look = Appearance(blur_px=0.6, noise=2.0)
        random = np.random.default_rng(7)
        small = BoardRenderer(CAMERA, target, look).image(posed(target, 0.4, random), random)
        image = cv2.resize(small, (5472, 3648), interpolation=cv2.INTER_CUBIC)
        empty = cv2.resize(boardless()["clutter 0"], (5472, 3648), interpolation=cv2.INTER_CUBIC)
        found = detect(image, target)
        points = 0 if isinstance(found, NotFound) else len(found)
        line = f"{name}: {points} points, {timed(image, target, None, 1):.0f} ms; "
        line += f"without a board {timed(empty, target, None, 1):.0f} ms"
        if isinstance(target, Chessboard):
            began = time.process_time()
            cv2.findChessboardCornersSB(image, (target.columns, target.rows))
            line += f"; OpenCV {1e3 * (time.process_time() - began):.0f} ms"
        print(line, flush=True)


def rendered(first: int, count: int, file: Path | None) -> None:
    """Print, for some of the rendered views, what was found with and without a prediction, and how well."""
    names = list(TARGETS)
    backgrounds = [110.0, *(clutter(WIDTH, HEIGHT, np.random.default_rng(seed)) for seed in range(3))]
    renderers: dict[tuple[str, int], BoardRenderer] = {}
    rows: dict[str, list[tuple[float, ...]]] = {name: [] for name in names}
    for number in range(first, first + count):
        random = np.random.default_rng([11, number])
        name = names[number % len(names)]
        target, ground = TARGETS[name], int(random.integers(len(backgrounds)))
        if (name, ground) not in renderers:
            look = Appearance(background=backgrounds[ground], blur_px=0.6, noise=2.0)
            renderers[name, ground] = BoardRenderer(CAMERA, target, look)
        pose = posed(target, float(random.uniform(0.2, 0.75)), random)
        image, truth = renderers[name, ground].image(pose, random), projected(target, pose)
        prediction = off(truth, random)
        printed(target)
        began = time.process_time()
        whole = detect(image, target)
        middle = time.process_time()
        part = detect(image, target, predicted=prediction)
        ended = time.process_time()
        row = compared(target, whole, part)
        error = np.nan if isinstance(part, NotFound) else rms(target, part, truth)
        rows[name].append((*row, error, middle - began, ended - middle))
        if row[0] and not row[1]:
            print(f"lost: view {number}, {name}: {part}")
    for name, found in rows.items():
        report(name, found)
    if file is not None:
        with file.open("a", encoding="utf-8") as out:
            for name, found in rows.items():
                out.writelines(f"{name};{';'.join(map(repr, map(float, row)))}\n" for row in found)


def summary(file: Path) -> None:
    """Print what the rows of a file say together."""
    rows: dict[str, list[tuple[float, ...]]] = {}
    for line in file.read_text(encoding="utf-8").splitlines():
        name, *values = line.split(";")
        rows.setdefault(name, []).append(tuple(map(float, values)))
    for name, found in rows.items():
        report(name, found)


def public(root: Path) -> None:
    """Print the same for the public recordings; the prediction is what was found, off by some pixels."""
    for folder in PUBLIC:
        images = load(root / folder)
        if not isinstance(images, ImageSet):
            continue
        random = np.random.default_rng(5)
        rows: list[tuple[float, ...]] = []
        found: dict[str, Detection] = {}
        size = (0, 0)
        for shot in images.shots:
            image = images.grey(shot)
            size = image.shape[::-1]
            printed(images.target)
            began = time.process_time()
            whole = detect(image, images.target)
            middle = time.process_time()
            if isinstance(whole, NotFound):
                print(f"not found: {folder} {shot.name}: {whole}")
                continue
            found[shot.name] = whole
            pixels = np.full((images.target.point_count, 2), np.nan)
            pixels[whole.point_ids] = whole.pixels
            prediction = off(pixels, random)
            again = time.process_time()
            part = detect(image, images.target, predicted=prediction)
            ended = time.process_time()
            row = compared(images.target, whole, part)
            if not row[1]:
                print(f"lost: {folder} {shot.name}: {part}")
            rows.append((*row, np.nan, middle - began, ended - again))
        report(folder, rows)
        fit = calibrate_camera(images.target, found, size)
        print(f"    reprojection {fit.rmse_px:.3f} px with {fit.camera.lens}", flush=True)


def compared(target: Target, whole: Detection | NotFound, part: Detection | NotFound) -> tuple[float, ...]:
    """Found whole, found with the prediction, points each way, largest and mean square difference in px."""
    a, b = isinstance(whole, Detection), isinstance(part, Detection)
    largest, mean = np.nan, np.nan
    if isinstance(whole, Detection) and isinstance(part, Detection):
        largest, mean = differences(target, whole, part)
    numbers = [len(found) if isinstance(found, Detection) else 0 for found in (whole, part)]
    return float(a), float(b), *numbers, largest, mean


def report(name: str, rows: list[tuple[float, ...]]) -> None:
    """Print one line."""
    if not rows:
        return
    table = np.array(rows)
    lost = int(((table[:, 0] > 0) & (table[:, 1] == 0)).sum())
    gained = int(((table[:, 0] == 0) & (table[:, 1] > 0)).sum())
    worst, mean = np.nanmax(table[:, 4]), np.sqrt(np.nanmean(table[:, 5] ** 2))
    error = f"{np.nanmedian(table[:, 6]):.3f}" if np.isfinite(table[:, 6]).any() else "-"
    # Views that are not found are looked for in the whole image both ways.
    found = table[table[:, 0] > 0]
    before, after = 1e3 * np.median(found[:, 7]), 1e3 * np.median(found[:, 8])
    print(
        f"{name}: {len(rows)} views, found {int(table[:, 0].sum())} whole and {int(table[:, 1].sum())} "
        f"predicted ({lost} lost, {gained} gained), points {int(table[:, 2].sum())} and "
        f"{int(table[:, 3].sum())}, difference {worst:.4f} px at most, {mean:.4f} px root mean square, "
        f"median error {error} px, medians {before:.0f} and {after:.1f} ms, ratio {before / after:.1f}",
        flush=True,
    )


def main() -> None:
    """Run one of the measurements."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("speed", "none", "large", "rendered", "summary", "public"))
    parser.add_argument("--first", type=int, default=0, help="number of the first view")
    parser.add_argument("--count", type=int, default=1000, help="number of rendered views")
    parser.add_argument(
        "--rows", type=Path, help="file that rows of rendered views are added to or read from"
    )
    parser.add_argument("--views", type=int, default=4, help="views per line of a table")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    if options.what == "speed":
        speed(options.views)
    elif options.what == "none":
        without_board()
    elif options.what == "large":
        large()
    elif options.what == "rendered":
        rendered(options.first, options.count, options.rows)
    elif options.what == "summary":
        summary(options.rows)
    else:
        public(Path(os.environ["HANDEYE_DATA"]))


if __name__ == "__main__":
    main()
