"""How well views observe the constants of an arm: the five indices of the field.

Of the singular values s_1 >= ... >= s_L of the derivative of the measurements, in units of their noise, in
the constants, what X and Y could explain taken out (Sun and Hollerbach, "Observability index selection for
robot calibration", ICRA 2008):

    O1 = (s_1 ... s_L)^(1/L) / sqrt(m)    Borm and Menq 1989
    O2 = s_L / s_1                        Driels and Pathre 1990
    O3 = s_L                              Nahvi, Hollerbach and Hayward 1994
    O4 = s_L^2 / s_1                      Nahvi and Hollerbach 1996
    O5 = 1 / (1 / s_1 + ... + 1 / s_L)    Sun and Hollerbach 2008

Lengths count in metres and angles in radians, as if a lever were a metre. Constants that no view could tell,
those of the gauge, are none.
"""

from dataclasses import asdict, dataclass

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.estimate import Estimate
from handeye.types.arrays import FloatArray

_POSES = 12


@dataclass(frozen=True)
class Indices:
    """The five indices, larger is better."""

    o1: float
    o2: float
    o3: float
    o4: float
    o5: float

    def to_dict(self) -> dict[str, float]:
        """Return plain values for JSON."""
        return asdict(self)


def observability_indices(estimate: Estimate, informations: FloatArray) -> Indices:
    """Return the indices of the constants of an arm.

    Parameters
    ----------
    estimate
        That knows the arm.
    informations
        (K, n, n) what each view tells of the estimate's parameters: `handeye.planning.prediction`.

    Raises
    ------
    InputError
        The estimate knows no arm, or there is no view.
    """
    if estimate.arm is None or not len(informations):
        raise InputError("observability is that of a known arm in views", code=Code.NO_ARM)
    total = informations.sum(axis=0)
    first = len(total) - estimate.arm.constants
    poses, constants = slice(0, _POSES), slice(first, len(total))
    across = total[constants, poses]
    of_poses = np.asarray(np.linalg.pinv(total[poses, poses], hermitian=True), np.float64)
    left: FloatArray = total[constants, constants] - across @ of_poses @ across.T
    values = np.sqrt(np.maximum(np.linalg.eigvalsh(left)[::-1], 0.0))
    largest, least = float(values[0]), float(values[-1])
    with np.errstate(divide="ignore"):
        mean = float(np.exp(np.mean(np.log(values))))
        harmonic = float(1 / np.sum(1 / values))
    return Indices(
        o1=mean / float(np.sqrt(len(informations))),
        o2=least / largest if largest > 0 else 0.0,
        o3=least,
        o4=least**2 / largest if largest > 0 else 0.0,
        o5=harmonic,
    )
