"""Measure whether the accuracy stated for poses alone holds.

    python tools/measure_poses_alone.py --count 200

Simulated: 8 to 20 stations of a hand above a table, a detector that errs across and along its line of sight
and in rotation (0.05 to 0.5 mm, 1 to 5 times that, 0.02 to 0.3 deg, drawn for each set), a robot that errs at
the flange (0.02 to 0.3 mm, 0.005 to 0.05 deg), the camera in the hand and beside it. Printed: share of the
stated 95 % radii that hold the error of the camera's centre and rotation, mean NEES / 6, and the mean errors
beside those of the closed form and plain fit it starts from.
"""

import argparse

import numpy as np

from handeye.datasets import PosePairs
from handeye.datasets.pose_pairs import numbered
from handeye.importing import solve_poses
from handeye.importing.poses_alone import first_fit
from handeye.types import Mounting, Pose

X = Pose.exp([0.03, -0.06, 0.09, 0.1, 0.2, 1.5])
Y = Pose.exp([0.6, -0.2, 0.03, 3.0, 0.1, 0.2])


def log_uniform(random: np.random.Generator, low: float, high: float) -> float:
    """A level."""
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def pairs_of(number: int, seed: int) -> PosePairs:
    """The set of a number."""
    random = np.random.default_rng([seed, number])
    mounting = (Mounting.EYE_IN_HAND, Mounting.EYE_TO_HAND)[number % 2]
    across = log_uniform(random, 5e-5, 5e-4)
    along, turn = across * random.uniform(1, 5), np.deg2rad(log_uniform(random, 0.02, 0.3))
    robot = [log_uniform(random, 2e-5, 3e-4)] * 3 + [np.deg2rad(log_uniform(random, 0.005, 0.05))] * 3
    down = Pose.exp([0, 0, 0, np.pi, 0, 0])
    stations = []
    for _ in range(int(random.integers(8, 21))):
        there = Pose.exp([*random.uniform([0.3, -0.3, 0.3], [0.7, 0.3, 0.7]), 0, 0, 0])
        tilt = Pose.exp([0, 0, 0, *random.uniform(-0.5, 0.5, 2), random.uniform(-1.5, 1.5)])
        reported = there @ down @ tilt
        true = reported @ Pose.exp(random.normal(size=6) * robot)
        seen = (X @ mounting.chain(true) @ Y).matrix.copy()
        sight = seen[:3, 3] / np.linalg.norm(seen[:3, 3])
        off = across * random.normal(size=3)
        off += sight * (along * random.normal() - sight @ off)
        seen[:3, 3] += off
        seen[:3, :3] = Pose.exp([0, 0, 0, *(turn * random.normal(size=3))]).rotation @ seen[:3, :3]
        stations.append((reported, Pose(seen)))
    return PosePairs(f"set {number}", "test", mounting, numbered(stations))


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    held = np.zeros((arguments.count, 2))
    nees, errors, plain = (np.zeros(arguments.count) for _ in range(3))
    for number in range(arguments.count):
        pairs = pairs_of(number, arguments.seed)
        solved = solve_poses(pairs)
        twist = (X @ solved.X.inverse()).log()
        nees[number] = twist @ np.linalg.solve(solved.covariance, twist) / 6
        centre, angle = 1e3 * float(np.linalg.norm(twist[:3])), np.rad2deg(float(np.linalg.norm(twist[3:])))
        held[number] = centre <= solved.within_95.translation_mm, angle <= solved.within_95.rotation_deg
        errors[number] = centre
        first, _ = first_fit(pairs.motions, pairs.camera_poses)
        plain[number] = 1e3 * float(np.linalg.norm((X @ Pose(first).inverse()).log()[:3]))
    print(
        f"{arguments.count} sets: the stated radii hold {held[:, 0].mean():.1%} of the centres and "
        f"{held[:, 1].mean():.1%} of the rotations, NEES / 6 {nees.mean():.2f}; mean error of the centre "
        f"{errors.mean():.3f} mm, of the plain fit {plain.mean():.3f} mm"
    )


if __name__ == "__main__":
    main()
