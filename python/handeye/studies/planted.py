"""Mistakes planted in clean recordings, as they are made.

Every kind draws one of its ways to be made; what it is called when found is in `EXPECTED`.
"""

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum

import numpy as np

from handeye.estimation.faults.explanation import BEARABLE_SCALE
from handeye.estimation.faults.scale import scale_of
from handeye.estimation.measurements import Measurements
from handeye.simulation.cells import TARGET, CellOptions, ErrorKind, simulate
from handeye.studies import planted_throughout, planted_views
from handeye.studies.planted_views import MOVING_MM
from handeye.types import CircleGrid, Mounting, Recording, Target


class Mistake(StrEnum):
    """What is planted."""

    FLIP = "flip"
    """The board of one view labelled turned, or mirrored."""
    SWAP = "swap"
    """The images of two views swapped."""
    SHIFT = "shift"
    """The list of images shifted by one, all of it or a few in a row."""
    MOVING = "moving"
    """One view off by what the arm moves meanwhile, in any direction or towards the next view."""
    GROSS_POSE = "gross_pose"
    """One robot pose far off."""
    WRONG_UNIT = "wrong_unit"
    """Robot translations or measures of the target in another unit, or rotations in radians for degrees."""
    WRONG_DIRECTION = "wrong_direction"
    """Robot poses inverted, or the other mounting given."""
    WRONG_ROTATION = "wrong_rotation"
    """Rotations in another notation or order, transposed, with wrong signs, or in a left-handed frame."""
    MIRRORED = "mirrored"
    """Pictures flipped left to right or upside down."""
    BOARD_SIZE = "board_size"
    """The target larger or smaller than stated by 8 to 40 %."""
    CAMERA_SIZE = "camera_size"
    """A camera calibrated for pictures of another size."""
    CROPPED = "cropped"
    """Pictures cut, the camera as before."""
    STRETCHED = "stretched"
    """Pictures resized unequally, the camera as before."""
    DISTORTION = "distortion"
    """Another lens's coefficients."""
    SHEARED = "sheared"
    """Every row of the pictures shifted against the one before."""
    STALE = "stale"
    """Robot poses that were not read again."""
    REPEATED = "repeated"
    """One view there twice."""
    FALSE_POINTS = "false_points"
    """A few points of one view in the wrong place."""
    FEW_ROTATIONS = "few_rotations"
    """Views whose rotations share one axis."""


EXPECTED = {
    Mistake.FLIP: "view_flipped",
    Mistake.SWAP: "view_shuffled",
    Mistake.SHIFT: "view_shuffled",
    Mistake.MOVING: "view_moving",
    Mistake.GROSS_POSE: "gross_pose",
    Mistake.WRONG_UNIT: "wrong_unit",
    Mistake.WRONG_DIRECTION: "wrong_direction",
    Mistake.WRONG_ROTATION: "wrong_rotation",
    Mistake.MIRRORED: "mirrored_pictures",
    Mistake.BOARD_SIZE: "board_size",
    Mistake.CAMERA_SIZE: "camera_other_size",
    Mistake.CROPPED: "pictures_cropped",
    Mistake.STRETCHED: "pictures_stretched",
    Mistake.DISTORTION: "wrong_distortion",
    Mistake.SHEARED: "pictures_sheared",
    Mistake.STALE: "stale_poses",
    Mistake.REPEATED: "view_repeated",
    Mistake.FALSE_POINTS: "points_outlying",
    Mistake.FEW_ROTATIONS: "degenerate",
}
TARGETS: tuple[Target, ...] = (TARGET, CircleGrid(4, 4, 0.06, 0.03))
KINDS = tuple(kind for kind in ErrorKind if kind is not ErrorKind.WRONG_INTRINSICS)
CELL = CellOptions(
    views=(8, 20),
    pixel_sigma_px=(0.05, 0.3),
    translation_sigma_m=(0.02e-3, 1e-3),
    rotation_sigma_deg=(0.002, 0.05),
)
# A picture taken on the move is planted off by so many times what the arm errs by.
STANDS_OUT = 6.0


def made_up(number: int, seed: int) -> Recording:
    """Return a clean recording; targets, mountings and errors of the arm take turns."""
    cell = replace(
        CELL,
        target=TARGETS[number % len(TARGETS)],
        mounting=list(Mounting)[number // len(TARGETS) % 2],
    )
    return simulate(KINDS[number // (2 * len(TARGETS)) % len(KINDS)], number, cell, seed=seed)


def can_be_planted(recording: Recording, mistake: Mistake, arm_mm: float = 0.0) -> bool:
    """Tell whether a recording can have a mistake that is more than what its arm errs by, and shows.

    Parameters
    ----------
    recording
        A clean one.
    mistake
        What is to be planted.
    arm_mm
        How far the arm errs by, per axis.
    """
    if mistake is Mistake.MOVING:
        return STANDS_OUT * arm_mm < MOVING_MM[1]
    if mistake is Mistake.BOARD_SIZE:  # Turns about a point at one distance tell no size.
        scale = scale_of(Measurements.of_recording(recording))
        return scale is not None and abs(scale - 1) < BEARABLE_SCALE
    if mistake is Mistake.FEW_ROTATIONS:
        return recording.truth is not None and None not in (recording.truth.X, recording.truth.Y)
    if mistake is Mistake.DISTORTION:
        return recording.camera.lens in {"pinhole", "brown_conrady_5"}
    return True


def plant(
    recording: Recording, mistake: Mistake, random: np.random.Generator, arm_mm: float = 0.0
) -> tuple[Recording, list[str]]:
    """Plant a mistake; also the names of the views with it, empty if it is in all."""
    if mistake is Mistake.MOVING:
        return planted_views.moving(recording, random, max(MOVING_MM[0], STANDS_OUT * arm_mm))
    return _PLANTERS[mistake](recording, random)


_PLANTERS: dict[Mistake, Callable[[Recording, np.random.Generator], tuple[Recording, list[str]]]] = {
    Mistake.FLIP: planted_views.flip,
    Mistake.SWAP: planted_views.swap,
    Mistake.SHIFT: planted_views.shift,
    Mistake.GROSS_POSE: planted_views.gross_pose,
    Mistake.WRONG_UNIT: planted_throughout.wrong_unit,
    Mistake.WRONG_DIRECTION: planted_throughout.wrong_direction,
    Mistake.WRONG_ROTATION: planted_throughout.wrong_rotation,
    Mistake.MIRRORED: planted_throughout.mirrored,
    Mistake.BOARD_SIZE: planted_throughout.board_size,
    Mistake.CAMERA_SIZE: planted_throughout.camera_size,
    Mistake.CROPPED: planted_throughout.cropped,
    Mistake.STRETCHED: planted_throughout.stretched,
    Mistake.DISTORTION: planted_throughout.distortion,
    Mistake.SHEARED: planted_throughout.sheared,
    Mistake.STALE: planted_views.stale,
    Mistake.REPEATED: planted_views.repeated,
    Mistake.FALSE_POINTS: planted_views.false_points,
    Mistake.FEW_ROTATIONS: planted_views.few_rotations,
}
