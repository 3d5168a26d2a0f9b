"""How findings name views and sizes."""

from collections.abc import Sequence

import numpy as np

from handeye.types.arrays import FloatArray
from handeye.types.units import MM_PER_M

MOST_LISTED = 6


def listed(names: Sequence[str]) -> str:
    """Join names for a sentence, the first few of them."""
    if len(names) > MOST_LISTED:
        return f"{', '.join(names[:MOST_LISTED])} and {len(names) - MOST_LISTED} more"
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def size_of(deviation: FloatArray) -> dict[str, float]:
    """Millimetres and degrees of a twist."""
    return {
        "translation_mm": float(np.linalg.norm(deviation[:3])) * MM_PER_M,
        "rotation_deg": float(np.rad2deg(np.linalg.norm(deviation[3:]))),
    }
