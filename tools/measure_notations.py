"""Measure whether poses are read right in every way of writing them, stated and told by the pictures.

    python tools/measure_notations.py stated
    python tools/measure_notations.py unstated --count 300

Recordings are simulated: a UR5e with the usual errors of arms (none, encoders, joints beside where they
should be, mixtures twice as large as usual), boards of three sizes, 8 to 16 views, the camera in the hand and
beside the robot. Each is written to a file in one of the ways of tests/poses_written.py, and read as
`handeye solve FOLDER` does, from the file to the message. Half of the unstated ones say where the camera
sits.

Right is an answer that names one reading, with the poses that were written; where the mounting is not said,
also the other mounting with the other direction, which no picture can tell. Wrong is an answer that names
one reading with other poses. An answer that names several is neither.
"""

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from handeye.datasets import ImageSet, Reading, Shot, UnreadPoses, read_pose_rows
from handeye.errors import InputError
from handeye.importing.opening import told_by_pictures
from handeye.notations import Direction, Unit, direction_of, notation_of
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Chessboard, Mounting, Pose, Recording
from poses_written import WAYS, Way

KINDS = (
    ErrorKind.PIXEL_ONLY,
    ErrorKind.ENCODER,
    ErrorKind.SMOOTH_KINEMATIC,
    ErrorKind.WHITE_FLANGE,
    ErrorKind.MIXTURE_CELL_2,
)
BOARDS = (Chessboard(8, 11, 0.025), Chessboard(6, 9, 0.03), Chessboard(5, 7, 0.02))
# What rounding in the file may leave: blocks of three to five decimals are made rigid.
LARGEST_OFF_M, LARGEST_OFF_RAD = 2e-3, np.deg2rad(0.05)


def recording_of(number: int, seed: int) -> Recording:
    """The recording of a number; each way of writing meets every kind, board and mounting."""
    turn = number + number // len(WAYS)
    options = CellOptions(
        mounting=(Mounting.EYE_IN_HAND, Mounting.EYE_TO_HAND)[turn % 2],
        target=BOARDS[turn % len(BOARDS)],
        views=(8, 16),
    )
    return simulate(KINDS[turn % len(KINDS)], number, options, seed=seed)


def unread(recording: Recording, way: Way, folder: Path) -> UnreadPoses:
    """What a folder of these pictures and this file gives before it is said how the poses are written."""
    names = [f"{view.name}.png" for view in recording.views]
    path = folder / f"poses{way.suffix}"
    path.write_text(way.text(names, [view.T_base_flange for view in recording.views]))
    rows = read_pose_rows(path)
    if len(rows) != len(names):
        raise InputError(f"{len(rows)} rows of {len(names)}")
    shots = tuple(Shot(view.name, None, Pose.identity()) for view in recording.views)
    images = ImageSet("set", "pose-list", folder, recording.mounting, recording.target, shots)
    return UnreadPoses(images, rows, rows.readings(), path.name)


def agrees(read: Sequence[Pose], written: Sequence[Pose]) -> bool:
    """Whether poses are those that were written."""
    off = [a.inverse() @ b for a, b in zip(read, written, strict=True)]
    return all(
        np.linalg.norm(o.translation) < LARGEST_OFF_M and o.rotation_angle_rad < LARGEST_OFF_RAD for o in off
    )


def named(options: Sequence[str]) -> tuple[Reading, Mounting | None]:
    """The reading and the mounting that a message names."""
    said = dict(zip(options[::2], options[1::2], strict=True))
    direction = direction_of(said.get("--poses-are", Direction.FLANGE_IN_BASE.value))
    mounting = said.get("--mounting")
    reading = Reading(notation_of(said["--notation"]), Unit(said["--unit"]), direction)
    return reading, None if mounting is None else Mounting(mounting)


def outcome(number: int, seed: int, folder: Path) -> tuple[str, str]:
    """What comes of one recording whose poses are not stated, and what the message says."""
    recording, way = recording_of(number, seed), WAYS[number % len(WAYS)]
    poses = [view.T_base_flange for view in recording.views]
    found = unread(recording, way, folder)
    if len(found.readings) == 1:
        right = agrees(found.rows.poses(found.readings[0]), poses)
        return ("right" if right else "wrong"), f"{way.name}: said by the file"
    mounting = recording.mounting if number // 2 % 2 else None
    error = told_by_pictures(found, recording, mounting)
    where = f"{way.name} ({recording.mounting.value}): {error.message}"
    if not error.options:
        return "several", where
    reading, at = named(error.options)
    at = at or mounting or Mounting.EYE_IN_HAND
    read = found.rows.poses(reading)
    if mounting is None and at is not recording.mounting:
        # The other mounting with the other direction is the same chain, and the hint says so.
        read = tuple(pose.inverse() for pose in read)
    return ("right" if agrees(read, poses) else "wrong"), where


def stated(seed: int) -> None:
    """Read every way of writing where it is said."""
    failures = 0
    for number, way in enumerate(WAYS):
        recording = recording_of(number, seed)
        with tempfile.TemporaryDirectory() as folder:
            found = unread(recording, way, Path(folder))
            read = found.rows.poses(found.rows.readings(way.stated)[0])
        if not agrees(read, [view.T_base_flange for view in recording.views]):
            failures += 1
            print(f"wrong: {way.name}")
    print(f"{len(WAYS) - failures} of {len(WAYS)} ways of writing are read right where they are stated")


def unstated(first: int, count: int, seed: int) -> None:
    """Let the pictures tell."""
    counts: Counter[str] = Counter()
    for number in range(first, first + count):
        with tempfile.TemporaryDirectory() as folder:
            result, message = outcome(number, seed, Path(folder))
        counts[result] += 1
        if result != "right":
            print(f"{number} {result}: {message[:400]}")
    total = sum(counts.values())
    print(
        f"{counts['right']} of {total} named right ({counts['right'] / total:.1%}), {counts['several']} with "
        f"several or no names, {counts['wrong']} wrong"
    )


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("what", choices=["stated", "unstated"])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    if arguments.what == "stated":
        stated(arguments.seed)
    else:
        unstated(arguments.first, arguments.count, arguments.seed)


if __name__ == "__main__":
    main()
