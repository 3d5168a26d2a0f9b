"""Measure how well points are measured: stated deviations beside errors, and errors under a camera's gamma.

    python tools/measure_points.py quality --firsts 5000 6000 7000 --views 4
    python tools/measure_points.py gamma --firsts 9100 --views 4

Targets of fewer than 16 points are seen in `--few` times as many views.
"""

import argparse

import cv2
import numpy as np
from measure_detection import CAMERA, TARGETS, posed, projected, rms

from handeye.cameras.render import Appearance, BoardRenderer
from handeye.detection import Detection, NotFound, detect
from handeye.types import ArucoGrid, ArucoMarker, Charuco, Chessboard, CircleGrid, Target

GRIDS: dict[str, Target] = {"ArUco grid": ArucoGrid(5, 7, 0.03, 0.006, "DICT_5X5_100")}
# Further boards whose deviations are compared: other layouts, light on dark, and few points.
OTHERS: dict[str, Target] = {
    "ChArUco, legacy": Charuco(8, 6, 0.03, 0.0225, "DICT_5X5_100", legacy_pattern=True),
    "ChArUco, inverted": Charuco(7, 10, 0.03, 0.0225, "DICT_5X5_100", inverted=True),
    "ArUco grid, inverted": ArucoGrid(5, 7, 0.03, 0.006, "DICT_5X5_100", inverted=True),
    "chessboard, 3 x 4": Chessboard(3, 4, 0.03),
    "ChArUco, 4 x 4": Charuco(4, 4, 0.03, 0.0225, "DICT_5X5_100"),
    "circle grid, 4 x 3": CircleGrid(4, 3, 0.03, 0.015),
    "three ArUco markers": ArucoGrid(1, 3, 0.03, 0.006, "DICT_5X5_100"),
    "ArUco marker": ArucoMarker(0.06, "DICT_5X5_100", 3),
    "AprilTag": ArucoMarker(0.06, "DICT_APRILTAG_36h11", 3),
}
# So few points leave little to be told from one view.
FEW_POINTS = 16
# Looks under which stated deviations are compared with errors.
LOOKS: dict[str, dict[str, float]] = {
    "sharp": {"blur_px": 0.4, "noise": 1.0},
    "blurred": {"blur_px": 2.0, "noise": 1.0},
    "noisy": {"blur_px": 0.7, "noise": 6.0},
    "gamma 0.45": {"blur_px": 0.7, "noise": 2.0, "gamma": 0.45},
    "gamma 2.2": {"blur_px": 0.7, "noise": 2.0, "gamma": 2.2},
    "JPEG": {"blur_px": 0.7, "noise": 1.0, "quality": 70},
}


def quality(targets: dict[str, Target], firsts: list[int], views: int, few: int) -> None:
    """Print squared errors over stated variances, for each family and look, and median deviations.

    Beside each mean is its standard error, as the means of the views tell it: points of a view go together.
    Views are those from each of some numbers on; of targets with few points, `few` times as many.
    """
    print("| target | " + " | ".join(LOOKS) + " | all |\n|---" + "|---" * (len(LOOKS) + 1) + "|")
    for name, target in targets.items():
        # Finely, as edges along the rows of pixels are otherwise drawn up to a sixteenth of a pixel off.
        renderer = BoardRenderer(CAMERA, target, Appearance(supersampling=16))
        cells: list[str] = []
        everything: list[np.ndarray] = []
        drawn: dict[int, np.ndarray] = {}
        for look in LOOKS.values():
            ratios: list[np.ndarray] = []
            sigmas: list[float] = []
            count = views * (few if target.point_count < FEW_POINTS else 1)
            for view in [first + k for first in firsts for k in range(count)]:
                random = np.random.default_rng([23, view])
                pose = posed(target, float(random.uniform(0.25, 0.7)), random)
                if view not in drawn:
                    drawn[view] = renderer.image(pose)
                found = detect(taken(drawn[view], look, random), target)
                if isinstance(found, NotFound) or found.sigmas_px is None:
                    continue
                truth = projected(target, pose)
                squares = [
                    ((found.pixels - truth[p[found.point_ids]]) ** 2).sum(axis=1) for p in target.symmetries
                ]
                ratios.append(min(squares, key=np.sum) / 2 / found.sigmas_px**2)
                sigmas.extend(found.sigmas_px)
            cells.append(f"{mean_of(ratios)} ({np.median(sigmas):.3f} px)")
            everything.extend(ratios)
        print(f"| {name} | {' | '.join(cells)} | {mean_of(everything)} |", flush=True)


def mean_of(views: list[np.ndarray]) -> str:
    """The mean of all values of some views and its standard error, in words."""
    counts, sums = (np.array([f(v) for v in views], dtype=np.float64) for f in (len, np.sum))
    mean = sums.sum() / counts.sum()
    return f"{mean:.2f} +- {np.linalg.norm(sums - mean * counts) / counts.sum():.2f}"


def taken(image: np.ndarray, look: dict[str, float], random: np.random.Generator) -> np.ndarray:
    """A picture out of focus, as a camera with another gamma and noise gives it, and as JPEG."""
    grey = cv2.GaussianBlur(image.astype(np.float64), (0, 0), look["blur_px"])
    grey = 255 * (grey / 255) ** look.get("gamma", 1.0) + random.normal(scale=look["noise"], size=grey.shape)
    bytes_ = np.rint(grey.clip(0, 255)).astype(np.uint8)
    if "quality" in look:
        coded = cv2.imencode(".jpg", bytes_, [cv2.IMWRITE_JPEG_QUALITY, int(look["quality"])])[1]
        bytes_ = np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)
    return bytes_


def gamma(firsts: list[int], views: int) -> None:
    """Print errors of grids of markers under gamma and blur: over all views, and of the worst of them."""
    cells = [(value, blur) for value in (0.45, 2.2) for blur in (0.5, 1.0)]
    print(
        "| target | " + " | ".join(f"gamma {g}, blur {b} px" for g, b in cells) + " |\n|---|---|---|---|---|"
    )
    for name in ("AprilGrid", "AprilGrid, border 1", "ArUco grid"):
        target = (TARGETS | GRIDS)[name]
        renderer = BoardRenderer(CAMERA, target, Appearance(supersampling=16))
        errors: dict[tuple[float, float], list[float]] = {cell: [] for cell in cells}
        for view in [first + k for first in firsts for k in range(views)]:
            random = np.random.default_rng([23, view])
            pose = posed(target, float(random.uniform(0.25, 0.7)), random)
            image, truth = renderer.image(pose), projected(target, pose)
            for value, blur in cells:
                look = {"blur_px": blur, "noise": 2.0, "gamma": value}
                found = detect(taken(image, look, random), target)
                if isinstance(found, Detection):
                    errors[value, blur].append(rms(target, found, truth))
        row = [f"{np.sqrt(np.mean(np.square(e))):.3f}, at most {max(e):.3f} px" for e in errors.values()]
        print(f"| {name} | {' | '.join(row)} |", flush=True)


def main() -> None:
    """Run one of the measurements."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("quality", "gamma"))
    parser.add_argument("--firsts", type=int, nargs="+", default=[0], help="numbers of first views")
    parser.add_argument("--views", type=int, default=4, help="views from each of these on")
    parser.add_argument("--few", type=int, default=1, help="times as many of targets with few points")
    parser.add_argument("--only", nargs="+", choices=tuple(TARGETS | GRIDS | OTHERS), help="some targets")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    targets = TARGETS | GRIDS | OTHERS
    if options.what == "gamma":
        gamma(options.firsts, options.views)
    else:
        chosen = {name: targets[name] for name in options.only or targets}
        quality(chosen, options.firsts, options.views, options.few)


if __name__ == "__main__":
    main()
