"""Measure how data that people have got wrong are answered, each kind varied.

    python tools/measure_cases.py --count 20

Made-up cells, the camera in the hand and beside the robot in turns, boards of three sizes, 6 to 14 views,
pixel noise of 0.05 to 0.2 px, robot noise of 0 to 0.2 mm and 0.02 deg, each set from its number. Kinds:

size       a camera file of another size                           must be refused
pinhole    a lens of mild distortion given as one without any      a region that holds the truth
decimals   rotations and positions rounded to 4 decimals           a region that holds the truth
camera     a file of ROS, Kalibr, RealSense, OpenCV; dotted numbers  a region that holds the truth
mixture    a camera beside an arm with ordinary errors of all sorts  a region that holds the truth
signs      Euler angles with signs turned                          refused, or a region that holds the truth
readings   poses read in a convention of another robot             the same
mirrored   pictures flipped                                        the same
inverse    base in flange                                          the same
gimbal     a pan-tilt unit, base in flange                         the same
stale      the pose of the view before, in pairs or throughout     the same

Folders with a file of poses are those of tools/measure_notations.py. Right is what the list says. A region
holds the truth if the camera's centre is off by no more than the stated 95 % radius; where an answer is due,
one in twenty may miss it. Wrong is an answer beyond that radius and beyond 3 mm.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from cells import Cell
from handeye.datasets import read_camera, write_recording
from handeye.errors import HandeyeError
from handeye.estimation import solve
from handeye.estimation.confidence import within
from handeye.importing import SourceOptions, open_folder
from handeye.notations import NOTATIONS
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Camera, Chessboard, Mounting, Pose, Recording, Truth, View

BOARDS = (Chessboard(6, 9, 0.025), Chessboard(7, 9, 0.03), Chessboard(8, 11, 0.02))
LENS = [1200.0, 1200.0, 639.5, 511.5, -0.1, 0.05, 5e-4, -5e-4, 0.0]
WRONG_M = 3e-3
DUE = frozenset({"pinhole", "decimals", "camera", "mixture"})
READINGS = (
    ("kuka", "euler_xyz_fixed_deg"), ("ur", "euler_xyz_fixed_rad"), ("doosan", "kuka"), ("kuka", "doosan"),
    ("fanuc", "kuka"), ("staubli", "fanuc"), ("quaternion_xyzw", "quaternion_wxyz"),
    ("euler_xyz_fixed_rad", "ur"),
)  # fmt: skip


def cell_of(number: int, seed: int, kind: str) -> tuple[Recording, np.random.Generator]:
    """The right recording of a number, with its truth."""
    random = np.random.default_rng([seed, number, sum(map(ord, kind))])
    if kind == "mixture":
        options = CellOptions(mounting=Mounting.EYE_TO_HAND, target=BOARDS[number % 3], views=(6, 14))
        return simulate(ErrorKind.MIXTURE_CELL, number, options, seed=seed), random
    mounting = (Mounting.EYE_IN_HAND, Mounting.EYE_TO_HAND)[number % 2]
    camera = Camera("brown_conrady_5", LENS, 1280, 1024)
    if kind == "pinhole":
        mild = [*random.uniform([-0.06, -0.05], [0.06, 0.05]), *random.uniform(-3e-4, 3e-4, 2), 0.0]
        camera = Camera("brown_conrady_5", [*LENS[:4], *mild], 1280, 1024)
    cell = Cell(random, mounting, BOARDS[number % 3], camera)
    count = int(random.integers(6, 15))
    if kind == "gimbal":
        reported = pan_tilt(random, cell, count)
    else:
        reported = [cell.robot_pose(cell.look(0.5, 1.0)) for _ in range(count)]
    level = random.uniform(0, 2e-4)
    noise = [level] * 3 + [np.deg2rad(level * 100)] * 3
    true = [pose @ Pose.exp(random.normal(size=6) * noise) for pose in reported]
    views = cell.views(true, sigma_px=float(random.uniform(0.05, 0.2)))
    views = [with_pose(view, pose) for view, pose in zip(views, reported, strict=True)]
    truth = Truth(cell.X, cell.Y)
    return Recording("case", mounting, camera, cell.target, tuple(views), truth, "made up"), random


def pan_tilt(random: np.random.Generator, cell: Cell, count: int) -> list[Pose]:
    """Poses that turn about two axes through one place."""
    first = cell.robot_pose(cell.look(0.1, 0.1))
    cell.X = Pose.exp([*random.uniform(-0.02, 0.02, 3), *random.uniform(-0.5, 0.5, 3)])
    seen = cell.look(0.1, 0.1)
    A = cell.mounting.chain(first)
    cell.Y = A.inverse() @ cell.X.inverse() @ seen
    poses: list[Pose] = []
    while len(poses) < count:
        pan, tilt = random.uniform(-0.4, 0.4, 2)
        # One after the other: both at once, about axes in a plane, are conjugate to their inverse.
        pose = first @ Pose.exp([0, 0, 0, 0, pan, 0]) @ Pose.exp([0, 0, 0, tilt, 0, 0])
        chain = cell.X @ cell.mounting.chain(pose) @ cell.Y
        pixels, seen = cell.camera.project(chain.act(cell.target.points))
        if seen.all() and (pixels > 20).all() and (pixels < np.array(cell.camera.size_px) - 20).all():
            poses.append(pose)
    return poses


def with_pose(view: View, pose: Pose) -> View:
    """The view with another pose of the robot."""
    return View(view.name, pose, view.point_ids, view.pixels)


def posed(recording: Recording, poses: list[Pose], camera: Camera | None = None) -> Recording:
    """The recording with other poses, and another camera."""
    views = tuple(with_pose(v, p) for v, p in zip(recording.views, poses, strict=True))
    r = recording
    return Recording(r.name, r.mounting, camera or r.camera, r.target, views, r.truth, r.source)


def spoilt(
    kind: str, number: int, recording: Recording, random: np.random.Generator, folder: Path
) -> tuple[Recording, Camera | None]:
    """The recording as someone has got it wrong, and a camera to give with it."""
    poses = [view.T_base_flange for view in recording.views]
    if kind == "size":
        width, height = (int(v * random.uniform(0.4, 2.5)) for v in recording.camera.size_px)
        return recording, Camera("brown_conrady_5", LENS, width + 1, height)
    if kind == "pinhole":
        return posed(recording, poses, Camera("pinhole", LENS[:4], 1280, 1024)), None
    if kind == "camera":
        return recording, read_camera(camera_file(folder, recording.camera, number))
    if kind == "mixture":
        return recording, None
    return posed(recording, changed(kind, poses, random)) if kind != "mirrored" else flipped(
        recording, random
    ), None


def changed(kind: str, poses: list[Pose], random: np.random.Generator) -> list[Pose]:
    """Poses as someone has got them wrong."""
    if kind == "decimals":
        return [Pose(np.round(pose.matrix, 4)) for pose in poses]
    if kind in {"inverse", "gimbal"}:
        return [pose.inverse() for pose in poses]
    if kind == "stale":
        every = int(random.choice([2, 3, len(poses)]))
        return [poses[k - k % every] for k in range(len(poses))]
    if kind == "signs":
        signs = np.array(
            [1, 1, 1, *random.choice([[-1, -1, -1], [1, -1, 1], [-1, 1, 1], [1, 1, -1], [-1, -1, 1]])]
        )
        notation = NOTATIONS["euler_xyz_fixed_deg"]
        return [notation.pose((signs * notation.numbers(pose)).tolist()) for pose in poses]
    written, read = (NOTATIONS[name] for name in READINGS[int(random.integers(len(READINGS)))])
    return [read.pose(written.numbers(pose)) for pose in poses]


def flipped(recording: Recording, random: np.random.Generator) -> Recording:
    """The recording with its pictures mirrored left to right, or upside down."""
    axis = int(random.integers(2))
    size = recording.camera.size_px[axis]

    def mirrored(view: View) -> View:
        pixels = view.pixels.copy()
        pixels[:, axis] = size - 1 - pixels[:, axis]
        return View(view.name, view.T_base_flange, view.point_ids, pixels)

    r = recording
    return Recording(r.name, r.mounting, r.camera, r.target, tuple(map(mirrored, r.views)), r.truth, r.source)


def camera_file(folder: Path, camera: Camera, number: int) -> Path:
    """The camera in a file of one of the formats: each in turn, numbers as NumPy prints them."""
    fx, fy, cx, cy, *distortion = (f"{v:.6f}".rstrip("0") for v in camera.parameters)
    k, d = f"[{fx}, 0., {cx}, 0., {fy}, {cy}, 0., 0., 1.]", f"[{', '.join(distortion)}]"
    width, height = camera.size_px
    texts = {
        "parsers.yaml": f"image_width: {width}\nimage_height: {height}\n"
        f"camera_matrix: {{rows: 3, cols: 3, data: {k}}}\n"
        f"distortion_model: plumb_bob\ndistortion_coefficients: {{rows: 1, cols: 5, data: {d}}}\n",
        "ros1.yaml": f"height: {height}\nwidth: {width}\ndistortion_model: plumb_bob\nD: {d}\nK: {k}\n---\n",
        "ros2.yaml": f"height: {height}\nwidth: {width}\ndistortion_model: plumb_bob\nd: {d}\nk: {k}\n---\n",
        "kalibr.yaml": "cam0:\n  camera_model: pinhole\n  distortion_model: radtan\n"
        f"  distortion_coeffs: [{', '.join(distortion[:4])}]\n  intrinsics: [{fx}, {fy}, {cx}, {cy}]\n"
        f"  resolution: [{width}, {height}]\n",
        "realsense.json": json.dumps(
            {"width": width, "height": height, "model": "brown_conrady", "fx": float(fx), "fy": float(fy)}
            | {"ppx": float(cx), "ppy": float(cy), "coeffs": [float(v) for v in distortion]}
        ),
    }
    name = [*texts, "storage.yml"][number % (len(texts) + 1)]
    if name in texts:
        (folder / name).write_text(texts[name])
        return folder / name
    storage = cv2.FileStorage(str(folder / name), cv2.FILE_STORAGE_WRITE)
    for key, value in (("image_width", width), ("image_height", height), ("camera_matrix", camera.matrix)):
        storage.write(key, value)
    storage.write("distortion_coefficients", np.array([[float(v) for v in distortion]]))
    storage.release()
    return folder / name


def outcome(kind: str, number: int, seed: int) -> tuple[str, str]:
    """What comes of one set: refused, holds, misses or wrong, and what is said."""
    recording, random = cell_of(number, seed, kind)
    truth = recording.truth
    assert truth is not None
    with tempfile.TemporaryDirectory() as parent:
        given, camera = spoilt(kind, number, recording, random, Path(parent))
        folder = Path(parent) / "set"
        write_recording(given, folder)
        try:
            calibration = solve(open_folder(folder, SourceOptions(camera=camera)).recording)
        except HandeyeError as error:
            return "refused", f"{error.code}: {error.message[:160]}"
    # The twist of X moves the camera's centre by its translation.
    off = float(np.linalg.norm((truth.X @ calibration.X.inverse()).log()[:3]))
    radius = within(calibration.covariance, calibration.degrees_of_freedom).translation_mm / 1e3
    if off <= radius:
        return "holds", ""
    return ("wrong" if off > WRONG_M else "misses"), f"{1e3 * off:.3g} mm off, stated {1e3 * radius:.3g} mm"


KINDS = (
    "size",
    "pinhole",
    "decimals",
    "camera",
    "mixture",
    "signs",
    "readings",
    "mirrored",
    "inverse",
    "gimbal",
    "stale",
)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--kind", choices=KINDS, action="append")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    print(f"{'kind':10}{'right':>8}{'refused':>9}{'misses':>8}{'wrong':>7}   of {arguments.count}")
    for kind in arguments.kind or KINDS:
        results = [outcome(kind, number, arguments.seed) for number in range(arguments.count)]
        for number, (result, said) in enumerate(results):
            if result == "wrong" or (result == "refused" and kind in DUE):
                print(f"  {kind} {number} {result}: {said}")
        right = sum(result == "holds" or (result == "refused" and kind not in DUE) for result, _ in results)
        refused, misses, wrong = (
            sum(r == name for r, _ in results) for name in ("refused", "misses", "wrong")
        )
        print(f"{kind:10}{right:8}{refused:9}{misses:8}{wrong:7}", flush=True)


if __name__ == "__main__":
    main()
