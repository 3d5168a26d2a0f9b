"""Measure how boards are found, beside OpenCV, and whether a wrong description is answered.

    python tools/measure_boards.py found --family charuco --count 500
    python tools/measure_boards.py descriptions --count 300

Every picture is drawn from its number alone, so parts can be measured one after the other (`--first`).
`found`: perspective up to 60 deg, blur, noise, gamma, uneven light, clutter, things in front of the board and
boards cut by the edge of the picture. Found is a board of which there are four corners, right is one
without a false corner: one further than FALSE_PX from where it is projected to, whatever its name.
`descriptions`: every family is described wrongly in the ways that people do; right is an answer that names
the board that is shown, or corners under their right names where the mistake does not matter.
"""

import argparse
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np
from measure_detection import CAMERA, HEIGHT, WIDTH, posed, projected

from handeye.cameras.render import Appearance, BoardRenderer, clutter
from handeye.detection import Detection, NotFound, detect
from handeye.errors import InputError
from handeye.types import AprilGrid, ArucoGrid, ArucoMarker, Charuco, Chessboard, CircleGrid, Pose, Target
from handeye.types.target import Coded

FALSE_PX = 3.0
FEWEST = 4
DICTIONARIES = ("DICT_4X4_250", "DICT_5X5_250", "DICT_6X6_250", "DICT_7X7_250", "DICT_ARUCO_ORIGINAL")
TAGS = ("DICT_APRILTAG_36h11", "DICT_APRILTAG_36h10")


def charuco(random: np.random.Generator) -> Charuco:
    """A board of 4 to 10 squares a side."""
    rows, columns = random.integers(4, 11, 2).tolist()
    name, share = str(random.choice(DICTIONARIES)), float(random.uniform(0.55, 0.85))
    return Charuco(rows, columns, 0.03, round(0.03 * share, 4), name, bool(random.integers(2)))


def april_grid(random: np.random.Generator) -> AprilGrid:
    """A grid of 2 to 7 tags a side."""
    rows, columns = random.integers(2, 8, 2).tolist()
    border, spacing = int(random.integers(1, 3)), round(float(random.uniform(0.2, 0.4)), 2)
    return AprilGrid(rows, columns, 0.03, spacing, str(random.choice(TAGS)), border)


def aruco_grid(random: np.random.Generator) -> ArucoGrid:
    """A grid of 2 to 7 markers a side."""
    rows, columns = random.integers(2, 8, 2).tolist()
    gap = round(0.03 * float(random.uniform(0.1, 0.5)), 4)
    return ArucoGrid(rows, columns, 0.03, gap, str(random.choice(DICTIONARIES)))


def marker(random: np.random.Generator) -> ArucoMarker:
    """One marker, its margin as wide as easy_handeye's users print it."""
    return ArucoMarker(0.1, str(random.choice((*DICTIONARIES, *TAGS))), int(random.integers(250)))


def chessboard(random: np.random.Generator) -> Chessboard:
    """A board of 4 to 11 inner corners a side."""
    return Chessboard(*random.integers(4, 12, 2).tolist(), 0.03)


def circle_grid(random: np.random.Generator) -> CircleGrid:
    """A grid with straight or shifted rows."""
    if random.integers(2):
        return CircleGrid(*random.integers(4, 10, 2).tolist(), 0.03, 0.016)
    return CircleGrid(int(random.integers(5, 12)), int(random.integers(3, 6)), 0.02, 0.018, asymmetric=True)


FAMILIES: dict[str, Callable[[np.random.Generator], Target]] = {
    "charuco": charuco,
    "aprilgrid": april_grid,
    "aruco_grid": aruco_grid,
    "aruco_marker": marker,
    "chessboard": chessboard,
    "circle_grid": circle_grid,
}


def picture(target: Target, random: np.random.Generator, *, hard: bool) -> tuple[np.ndarray, np.ndarray]:
    """A picture of a board, and where (P, 2) its points are in it."""
    ground = clutter(WIDTH, HEIGHT, random) if random.integers(2) else float(random.uniform(60, 160))
    look = Appearance(
        dark=float(random.uniform(10, 60)),
        light=float(random.uniform(150, 235)),
        background=ground,
        margin_m=target.artwork().quiet_m * float(random.uniform(1.5, 4)),
        gradient=tuple(random.uniform(-0.6, 0.6, 2).tolist()),
        blur_px=float(random.uniform(0.3, 2.0 if hard else 0.9)),
        noise=float(random.uniform(0, 6.0 if hard else 3.0)),
        supersampling=4,
    )
    share = float(random.uniform(0.2, 0.9) if hard else random.uniform(0.35, 0.7))
    pose = posed(target, share, random, 1.05 if hard else 0.6)
    while not (hard or is_whole(target, pose)):
        pose = posed(target, float(random.uniform(0.3, 0.6)), random, 0.6)
    image = BoardRenderer(CAMERA, target, look).image(pose, random)
    truth = projected(target, pose)
    if hard:
        for _ in range(int(random.integers(0, 4))):
            middle = truth[int(random.integers(len(truth)))] + random.normal(scale=20, size=2)
            size = random.uniform(0.01, 0.1, 2) * WIDTH
            box = (tuple(middle.tolist()), tuple(size.tolist()), float(random.uniform(0, 180)))
            cv2.ellipse(image, box, float(random.uniform(0, 255)), -1, cv2.LINE_AA)
        gamma = float(np.exp(random.uniform(np.log(0.4), np.log(2.2))))
        image = np.rint(255 * (image / 255.0) ** gamma).astype(np.uint8)
    return image, truth


def is_whole(target: Target, pose: Pose) -> bool:
    """Whether all that is printed is in the picture."""
    low, high = target.artwork().low, target.artwork().high
    corners = np.array([[low[0], low[1], 0], [high[0], low[1], 0], [*high, 0], [low[0], high[1], 0]])
    pixels, seen = CAMERA.project(pose.act(corners))
    return bool(seen.all() and (pixels > 4).all() and (pixels < [WIDTH - 5, HEIGHT - 5]).all())


def by_opencv(image: np.ndarray, target: Target) -> tuple[np.ndarray, np.ndarray]:
    """Ids (N,) and pixels (N, 2) that OpenCV finds with its own defaults, told the same."""
    if isinstance(target, CircleGrid):
        layout = cv2.CALIB_CB_ASYMMETRIC_GRID if target.asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
        is_found, centres = cv2.findCirclesGrid(image, (target.columns, target.rows), None, layout)
        if not is_found:
            return np.zeros(0, dtype=int), np.zeros((0, 2))
        return np.arange(target.point_count), centres.reshape(-1, 2)
    assert isinstance(target, Coded)
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, target.dictionary))
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = target.border_bits
    if isinstance(target, Charuco):
        size = (target.columns, target.rows)
        board = cv2.aruco.CharucoBoard(size, target.square_m, target.marker_m, dictionary)
        board.setLegacyPattern(target.legacy_pattern)
        detector = cv2.aruco.CharucoDetector(board, cv2.aruco.CharucoParameters(), parameters)
        corners, ids, _, _ = detector.detectBoard(image)
        if ids is None:
            return np.zeros(0, dtype=int), np.zeros((0, 2))
        return ids.ravel(), corners.reshape(-1, 2)
    found, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(image)
    order = target.corner_order if isinstance(target, AprilGrid) else (0, 1, 2, 3)
    index = {number: m for m, number in enumerate(target.marker_ids.tolist())}
    points: dict[int, np.ndarray] = {}
    for number, corners in zip([] if ids is None else ids.ravel().tolist(), found, strict=False):
        if number in index:
            for k in range(4):
                points[4 * index[number] + k] = corners.reshape(4, 2)[order[k]]
    return np.array(list(points), dtype=int), np.array(list(points.values())).reshape(-1, 2)


def away_px(target: Target, ids: np.ndarray, pixels: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Distances (N,) of points from where they are, under whichever labels that look alike fit best."""
    if isinstance(target, CircleGrid):  # OpenCV numbers circles in its own way
        symmetries = [np.linalg.norm(pixels - truth[p[ids]], axis=1) for p in target.symmetries]
        symmetries.append(np.linalg.norm(pixels[:, np.newaxis] - truth, axis=2).min(axis=1))
        return symmetries[-1] if len(ids) == 0 else min(symmetries, key=np.max)
    return np.linalg.norm(pixels - truth[ids], axis=1)


@dataclass
class Tally:
    """What one finder did: boards, those without a false corner, corners, false ones, errors, time."""

    boards: int = 0
    right: int = 0
    corners: int = 0
    false: int = 0
    seconds: float = 0.0
    medians_px: list[float] = field(default_factory=list)

    def add(self, away: np.ndarray, seconds: float) -> bool:
        """Count a picture; tell whether the board was found without a false corner."""
        self.seconds += seconds
        if len(away) < FEWEST:
            return False
        is_right = bool((away <= FALSE_PX).all())
        self.boards, self.right, self.corners = (
            self.boards + 1,
            self.right + is_right,
            self.corners + len(away),
        )
        self.false += int((away > FALSE_PX).sum())
        self.medians_px.append(float(np.median(away)))
        return is_right

    def __str__(self) -> str:
        """The same in words."""
        return (
            f"{self.boards} boards, {self.right} of them right, {self.corners} corners, {self.false} false, "
            f"median {np.median(self.medians_px or [np.nan]):.3f} px, {self.seconds:.1f} s"
        )


def found(family: str, first: int, count: int) -> None:
    """Print how many boards each finds, and how many corners are false."""
    ours, theirs, only = Tally(), Tally(), Counter[str]()
    for number in range(first, first + count):
        random = np.random.default_rng([31, list(FAMILIES).index(family), number])
        target = FAMILIES[family](random)
        image, truth = picture(target, random, hard=True)
        began = time.process_time()
        outcome = detect(image, target)
        middle = time.process_time()
        ids, pixels = by_opencv(image, target)
        ended = time.process_time()
        away = np.zeros(0)
        if isinstance(outcome, Detection):
            away = away_px(target, outcome.point_ids, outcome.pixels, truth)
        here = ours.add(away, middle - began)
        there = theirs.add(away_px(target, ids, pixels, truth), ended - middle)
        if (false := int((away > FALSE_PX).sum())) > 0:
            print(f"false: {family} {number}: {false} corners, {away.max():.1f} px")
        only["ours"] += here and not there
        only["OpenCV"] += there and not here
        if there and not here:
            print(
                f"lost: {family} {number}: {outcome.evidence if isinstance(outcome, NotFound) else 'false'}"
            )
    print(
        f"{family}, pictures {first} to {first + count - 1}:\n  handeye {ours}\n  OpenCV {theirs}\n  "
        f"right by one alone: handeye {only['ours']}, OpenCV {only['OpenCV']}",
        flush=True,
    )


def wrongly(target: Target, random: np.random.Generator) -> tuple[str, Target]:
    """A way in which people describe a board wrongly, and that description."""
    ways: dict[str, dict[str, object]] = {}
    if not isinstance(target, ArucoMarker):
        rows, columns = target.to_dict()["rows"], target.to_dict()["columns"]
        one = {
            "rows": rows + int(random.choice([-1, 1])),
            "columns": columns + int(random.choice([-2, -1, 1, 2])),
        }
        ways |= {"exchanged": {"rows": columns, "columns": rows}, "another size": one}
        step = -1 if isinstance(target, Charuco) else 1
        if isinstance(target, Charuco | Chessboard):
            ways["counted wrongly"] = {"rows": rows + step, "columns": columns + step}
    if isinstance(target, Coded):
        others = [name for name in (*DICTIONARIES, *TAGS) if name[:8] != target.dictionary[:8]]
        if isinstance(target, AprilGrid):
            others = [name for name in TAGS if name != target.dictionary]
        ways["another dictionary"] = {"dictionary": str(random.choice(others))}
        ways["inverted"] = {"inverted": True}
        ways["border"] = {"border_bits": 3 - target.border_bits}
        number = {"id": 251} if isinstance(target, ArucoMarker) else {"first_id": int(random.integers(1, 40))}
        ways["another number"] = dict(number)
    if isinstance(target, Charuco) and target.rows % 2 == 0:
        ways["legacy"] = {"legacy_pattern": not target.legacy_pattern}
    if isinstance(target, CircleGrid):
        ways["asymmetric"] = {"asymmetric": not target.asymmetric, "diameter_m": 0.5 * target.pitch_m}
    way = str(random.choice(list(ways)))
    return way, target.changed(**ways[way])


def of_another_family(target: Target, random: np.random.Generator) -> Target:
    """A usual board of another family."""
    return FAMILIES[str(random.choice([name for name in FAMILIES if name != target.family]))](random)


def same(shown: Target, target: Target) -> bool:
    """Whether two boards are one, apart from lengths, from a quarter turn and from a dictionary's size."""
    a, b = ({k: v for k, v in board.to_dict().items() if not k.endswith("_m")} for board in (shown, target))
    for fields in (a, b):
        fields.pop("spacing_ratio", None)
        if isinstance(target, Charuco) and target.rows % 2:
            fields.pop("legacy_pattern", None)
        name = str(fields.get("dictionary", ""))
        fields["dictionary"] = name.rsplit("_", 1)[0] if "X" in name else name
        turns = isinstance(target, Chessboard) or (isinstance(target, CircleGrid) and not target.asymmetric)
        if turns:
            fields["rows"], fields["columns"] = sorted((fields["rows"], fields["columns"]))
    return a == b


def descriptions(first: int, count: int) -> None:
    """Print how many wrong descriptions are answered rightly."""
    right, answered, labels = Counter[str](), Counter[str](), 0
    for number in range(first, first + count):
        random = np.random.default_rng([37, number])
        family = list(FAMILIES)[number % len(FAMILIES)]
        target, way, described = FAMILIES[family](random), "", None
        while described is None or described == target:
            try:
                way, described = wrongly(target, random)
                if random.uniform() < 0.1:
                    way, described = "another family", of_another_family(target, random)
            except InputError:
                target = FAMILIES[family](random)
        shown = target
        if way == "inverted":  # the board is, the description is not
            shown, described = described, target
        image, truth = picture(shown, random, hard=False)
        outcome = detect(image, described)
        key = f"{family}: {way}"
        answered[key] += 1
        if isinstance(outcome, NotFound):
            good = outcome.shown is not None and same(outcome.shown, shown)
        else:
            good = labelled_rightly(outcome, described, truth, shown)
            if not good:
                labels += 1
        right[key] += good
        if not good:
            print(
                f"wrong: {number} {key}: described {described.caption}; shown {shown.caption}; {outcome}"[
                    :600
                ]
            )
    for key in sorted(answered):
        print(f"{key}: {right[key]} of {answered[key]}")
    print(
        f"descriptions {first} to {first + count - 1}: {right.total()} of {answered.total()} right, "
        f"{labels} with corners of a wrong label",
        flush=True,
    )


def labelled_rightly(outcome: Detection, described: Target, truth: np.ndarray, shown: Target) -> bool:
    """Whether every corner lies on the board as the description puts it, up to a motion of the board."""
    plane = described.points[outcome.point_ids, :2]
    away = np.linalg.norm(outcome.pixels[:, np.newaxis] - truth, axis=2)
    if away.min(axis=1).max() > FALSE_PX:
        return False
    there = shown.points[away.argmin(axis=1), :2]
    # The best rotation and shift between the two planes.
    a, b = plane - plane.mean(axis=0), there - there.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return bool(np.abs(a @ turn - b).max() < 1e-6)


def main() -> None:
    """Run one of the measurements."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("found", "descriptions"))
    parser.add_argument(
        "--family", choices=[name for name in FAMILIES if name != "chessboard"], default="charuco"
    )
    parser.add_argument("--first", type=int, default=0, help="number of the first picture")
    parser.add_argument("--count", type=int, default=500, help="number of pictures")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    if options.what == "found":
        found(options.family, options.first, options.count)
    else:
        descriptions(options.first, options.count)


if __name__ == "__main__":
    main()
