"""Measure the lag found in bags, and the calibration beside that of the same views as a folder.

    python tools/measure_bags.py --count 20

Made-up cells that go from station to station (tests/bags_written.py): the camera in the hand and beside the
robot, 5 to 8 stations, lags of -100 to 100 ms, pictures at 6 to 12 Hz with noise, poses at 50 to 125 Hz with
noise of 0.02 mm, in all kinds of bags and three encodings in turns. Printed for each: the lag planted and
found, and how far the calibration is from that of the folder in its own standard deviations (six degrees of
freedom; 95 % of chance is below 12.6).
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from bags_written import KINDS, Journey, write
from handeye.estimation import solve
from handeye.importing import SourceOptions, open_folder
from handeye.types import Mounting

PICTURES = ("mono8", "jpeg", "bgr8")


def journey_of(number: int, seed: int) -> Journey:
    """The journey of a number."""
    random = np.random.default_rng([seed, number])
    return Journey(
        seed=int(random.integers(1 << 30)),
        stations=int(random.integers(5, 9)),
        lag_s=float(random.uniform(-0.1, 0.1)),
        mounting=(Mounting.EYE_IN_HAND, Mounting.EYE_TO_HAND)[number % 2],
        picture_hz=float(random.uniform(6, 12)),
        pose_hz=float(random.uniform(50, 125)),
    )


def as_folder(journey: Journey, folder: Path) -> Path:
    """The pictures in the middle of each station, and the poses of these times."""
    (folder / "camera.json").write_text(json.dumps(journey.camera.to_dict()))
    rows = ["# notation: quaternion_xyzw", "# unit: m", "image,x,y,z,qx,qy,qz,qw"]
    for k in range(journey.stations):
        middle = k * (journey.stand_s + journey.move_s) + journey.stand_s / 2
        _, grey = min(journey.pictures, key=lambda p: abs(p[0] - journey.lag_s - middle))
        cv2.imwrite(str(folder / f"{k}.png"), grey)
        pose = journey.pose(middle)
        rows.append(",".join(map(str, [f"{k}.png", *pose.translation, *pose.quaternion_xyzw])))
    (folder / "poses.csv").write_text("\n".join(rows))
    return folder


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    lags, distances = [], []
    for number in range(arguments.count):
        journey, kind = journey_of(number, arguments.seed), KINDS[number % len(KINDS)]
        options = SourceOptions(target=journey.target, mounting=journey.mounting)
        with tempfile.TemporaryDirectory() as parent:
            (Path(parent) / "folder").mkdir()
            picture = PICTURES[number % len(PICTURES)]
            bag = open_folder(write(Path(parent) / "bag", kind, journey, picture=picture), options)
            folder = open_folder(as_folder(journey, Path(parent) / "folder"), options)
        mine, theirs = solve(bag.recording), solve(folder.recording)
        between = (mine.X @ theirs.X.inverse()).log()
        distances.append(float(between @ np.linalg.solve(mine.covariance + theirs.covariance, between)))
        lag = None if bag.timing is None or bag.timing.lag is None else bag.timing.lag.seconds
        lags.append(float("inf") if lag is None else abs(lag - journey.lag_s))
        found = "none" if lag is None else f"{1e3 * lag:.2f}"
        print(
            f"{number} {kind} {picture} {journey.mounting.value}: lag {1e3 * journey.lag_s:.2f} ms, found "
            f"{found}; "
            f"{len(bag.recording)} of {journey.stations} stations, {distances[-1]:.2f} from the folder",
            flush=True,
        )
    print(
        f"{sum(lag < 3e-3 for lag in lags)} of {len(lags)} lags within 3 ms, the largest off by "
        f"{1e3 * max(lags):.2f} ms; {sum(d < 12.6 for d in distances)} calibrations equal that of the folder"
    )


if __name__ == "__main__":
    main()
