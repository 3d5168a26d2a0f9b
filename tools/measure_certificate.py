"""Certify drawn pose problems, and plant local minima: how many are certified, and whether any wrongly.

.venv/bin/python tools/measure_certificate.py --problems 1000
.venv/bin/python tools/measure_certificate.py --problems 1000 --cameras 3 --targets 2

Each camera sees each target in 4 to 15 views turned by up to 0.3 to 1.5 rad, with noise of 0.1 to 10 mrad and
0.1 to 5 mm. Local minima are where a descent from a random answer ends above the best that is known; a
certificate is wrong where any descent ends below.
"""

import argparse
import time
from dataclasses import replace

import numpy as np

from handeye import _core
from handeye.estimation.certificate import PoseProblem, certify
from handeye.types.arrays import FloatArray

# A minimum this much above the best is another one.
HIGHER = 1e-6


def transforms(random: np.random.Generator, count: int, metres: float, radians: float) -> FloatArray:
    """Return transforms (count, 4, 4) with components of their twists up to these."""
    return _core.se3_exp(random.uniform(-1, 1, (count, 6)) * np.repeat([metres, radians], 3))


def start(problem: PoseProblem, cameras: int, targets: int) -> tuple[FloatArray, FloatArray]:
    """Return closed forms of each camera with the first target, and of each target with the first camera."""
    of_camera, of_target = np.array(problem.cameras), np.array(problem.targets)

    def alone(camera: int, target: int) -> tuple[FloatArray, FloatArray]:
        chosen = (of_camera == camera) & (of_target == target)
        return _core.closed_form("shah", problem.A[chosen], problem.C[chosen])

    X = np.array([alone(camera, 0)[0] for camera in range(cameras)])
    return X, np.array([alone(0, target)[1] for target in range(targets)])


def main() -> None:
    """Run the problems, sum up."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--problems", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="seed of the first problem")
    parser.add_argument("--cameras", type=int, default=1)
    parser.add_argument("--targets", type=int, default=1)
    parser.add_argument("--starts", type=int, default=3, help="random answers to descend from in each")
    options = parser.parse_args()
    seconds: list[float] = []
    busy: list[float] = []
    gaps: list[float] = []
    certified = planted = wrongly = 0
    for number in range(options.first, options.first + options.problems):
        random = np.random.default_rng(number)
        turn = random.uniform(0.3, 1.5)
        X, Y = (transforms(random, count, 0.5, 2.0) for count in (options.cameras, options.targets))
        views = int(random.integers(4, 16))
        pairs = [(i, j) for i in range(options.cameras) for j in range(options.targets) for _ in range(views)]
        of_camera, of_target = zip(*pairs, strict=True)
        A = transforms(random, len(pairs), 0.5, turn)
        noise_rad, noise_m = 10 ** random.uniform(-4, -2), 10 ** random.uniform(-4, -2.3)
        off = random.normal(size=(len(pairs), 6)) * np.repeat([noise_m, noise_rad], 3)
        C = _core.se3_exp(off) @ X[list(of_camera)] @ A @ Y[list(of_target)]
        problem = PoseProblem(A, C, of_camera, of_target)
        began = time.process_time()
        found = certify(problem, *start(problem, options.cameras, options.targets))
        busy.append(time.process_time() - began)
        seconds.append(found.seconds)
        certified += found.certified
        weighted = replace(problem, sigmas=found.sigmas)
        for _ in range(options.starts):
            drawn = [transforms(random, count, 0.5, 3.0) for count in (options.cameras, options.targets)]
            elsewhere = certify(weighted, *drawn)
            margin = HIGHER * (found.cost + 1)
            if elsewhere.cost > found.cost + margin:
                planted += 1
                wrongly += elsewhere.certified
                gaps.append(elsewhere.gap)
            elif elsewhere.cost < found.cost - margin:
                wrongly += found.certified
    print(f"{certified} of {options.problems} certified")
    smallest = min(gaps, default=0.0)
    print(f"{planted} local minima, {wrongly} certified wrongly, smallest gap {smallest:.0%}")
    # On a machine that does other things too, what the processor took says more than the clock.
    for name, taken in (("by the clock", seconds), ("of the processor", busy)):
        middle, late = 1e3 * np.percentile(taken, [50, 95])
        print(f"{name}: {middle:.1f} ms in the median, 95 % within {late:.1f} ms")


if __name__ == "__main__":
    main()
