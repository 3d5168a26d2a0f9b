"""Certify drawn pose problems, and plant local minima: how many are certified, and whether any wrongly.

.venv/bin/python tools/measure_certificate.py --problems 1000

Each problem has 4 to 15 views turned by up to 0.3 to 1.5 rad, and noise of 0.1 to 10 mrad and 0.1 to 5 mm.
Local minima are where a descent from a random answer ends above the best that is known.
"""

import argparse
import time

import numpy as np

from handeye import _core
from handeye.estimation.certificate import PoseProblem, certify
from handeye.types.arrays import FloatArray

# A minimum this much above the best is another one.
HIGHER = 1e-6


def transforms(random: np.random.Generator, count: int, metres: float, radians: float) -> FloatArray:
    """Return transforms (count, 4, 4) with components of their twists up to these."""
    return _core.se3_exp(random.uniform(-1, 1, (count, 6)) * np.repeat([metres, radians], 3))


def main() -> None:
    """Run the problems, sum up."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--problems", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="seed of the first problem")
    parser.add_argument("--starts", type=int, default=3, help="random answers to descend from in each")
    options = parser.parse_args()
    seconds: list[float] = []
    busy: list[float] = []
    gaps: list[float] = []
    certified = planted = wrongly = 0
    for number in range(options.first, options.first + options.problems):
        random = np.random.default_rng(number)
        views, turn = int(random.integers(4, 16)), random.uniform(0.3, 1.5)
        X, Y = transforms(random, 2, 0.5, 2.0)
        A = transforms(random, views, 0.5, turn)
        noise_rad, noise_m = 10 ** random.uniform(-4, -2), 10 ** random.uniform(-4, -2.3)
        off = random.normal(size=(views, 6)) * np.repeat([noise_m, noise_rad], 3)
        C = _core.se3_exp(off) @ X @ A @ Y
        answer = _core.closed_form("shah", A, C)
        began = time.process_time()
        found = certify(PoseProblem(A, C), *answer)
        busy.append(time.process_time() - began)
        seconds.append(found.seconds)
        certified += found.certified
        weighted = PoseProblem(A, C, sigmas=found.sigmas)
        for _ in range(options.starts):
            elsewhere = certify(weighted, *transforms(random, 2, 0.5, 3.0))
            if elsewhere.cost > found.cost * (1 + HIGHER) + HIGHER:
                planted += 1
                wrongly += elsewhere.certified
                gaps.append(elsewhere.gap)
    print(f"{certified} of {options.problems} certified")
    print(f"{planted} local minima, {wrongly} certified wrongly, smallest gap {min(gaps, default=0.0):.0%}")
    # On a machine that does other things too, what the processor took says more than the clock.
    for name, taken in (("by the clock", seconds), ("of the processor", busy)):
        middle, late = 1e3 * np.percentile(taken, [50, 95])
        print(f"{name}: {middle:.1f} ms in the median, 95 % within {late:.1f} ms")


if __name__ == "__main__":
    main()
