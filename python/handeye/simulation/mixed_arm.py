"""Arms in which everything is wrong a little: offsets, links, noise and play of the joints, white errors."""

from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.robots import Arm
from handeye.robots.displaced import displaced, random_displacements
from handeye.types.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class MixedArm:
    """An arm in which everything is wrong a little, and which its controller knows nothing of.

    Parameters
    ----------
    arm
        As its controller has it.
    built
        As it is built.
    offsets_rad
        (n,) by how much the joints stand beyond where they are read.
    levels
        Of its errors; what is new at every stop: play and noise of the joints, white errors of the poses.
    """

    arm: Arm
    built: Arm
    offsets_rad: FloatArray
    levels: dict[str, float]

    @classmethod
    def draw(cls, random: np.random.Generator, arm: Arm, drawn: bool, factor: float) -> "MixedArm":
        """Draw an arm with the levels of one in good order times a factor, or with levels that are drawn.

        These are log-uniform over a decade about those of one in good order.
        """
        levels = {
            "encoder_deg": 0.005,
            "offset_deg": 0.01,
            "length_m": 1e-4,
            "twist_deg": 0.0,
            "play_deg": 0.005,
            "pose_m": 0.0,
            "pose_deg": 0.0,
        }
        if drawn:
            bounds = {
                "encoder_deg": (0.002, 0.02),
                "offset_deg": (0.005, 0.05),
                "length_m": (0.05e-3, 0.5e-3),
                "twist_deg": (0.003, 0.03),
                "play_deg": (0.002, 0.02),
                "pose_m": (0.005e-3, 0.1e-3),
                "pose_deg": (0.0005, 0.01),
            }
            levels = {name: log_uniform(random, range_) for name, range_ in bounds.items()}
        return cls.of_levels(random, arm, {name: factor * value for name, value in levels.items()})

    @classmethod
    def of_levels(cls, random: np.random.Generator, arm: Arm, levels: dict[str, float]) -> "MixedArm":
        """Draw an arm of these levels."""
        offsets = float(np.deg2rad(levels["offset_deg"])) * random.standard_normal(len(arm))
        offsets[[0, -1]] = 0.0
        twist_rad = float(np.deg2rad(levels["twist_deg"]))
        built = displaced(arm, random_displacements(random, arm, levels["length_m"], twist_rad))
        return cls(arm, built, offsets, levels)

    def stand(self, random: np.random.Generator, joints: FloatArray) -> FloatArray:
        """(K, 4, 4) where the flange truly is when the joints are read as (K, n)."""
        levels = self.levels
        noise = float(np.deg2rad(levels["encoder_deg"])) * random.standard_normal(joints.shape)
        play = 0.5 * float(np.deg2rad(levels["play_deg"])) * np.sign(random.standard_normal(joints.shape))
        both = [
            _core.se3_exp(
                np.array([random_twist(random, levels["pose_m"], levels["pose_deg"]) for _ in joints])
            )
            for _ in range(2)
        ]
        return both[0] @ self.built.forward(joints + self.offsets_rad + noise - play) @ both[1]


def log_uniform(random: np.random.Generator, bounds: tuple[float, float]) -> float:
    """Draw a level between two bounds, evenly in its logarithm."""
    low, high = bounds
    return low * (high / low) ** random.uniform()


def random_twist(random: np.random.Generator, metres: float, degrees: float) -> FloatArray:
    """Draw a twist (6,) with these deviations per axis."""
    return np.concatenate([random.normal(0, metres, 3), random.normal(0, np.deg2rad(degrees), 3)])
