"""All kinds of data faults: one file each, listed here."""

from handeye.estimation.faults.kinds import (
    board_size,
    gross_pose,
    inconsistent,
    mirrored_pictures,
    missing_distortion,
    points,
    repeated_view,
    sheared_pictures,
    stale_poses,
    too_little_rotation,
    view_flipped,
    view_moving,
    view_shuffled,
    wrong_camera,
    wrong_direction,
    wrong_rotation,
    wrong_unit,
)
from handeye.estimation.faults.kinds.base import Handling, Hypothesis, Kind, SharedFaultError

# In the order of the docs: what all views share, then single views.
KINDS: tuple[Kind, ...] = (
    wrong_direction.KIND,
    wrong_unit.KIND,
    wrong_rotation.KIND,
    mirrored_pictures.KIND,
    board_size.KIND,
    *wrong_camera.ALL,
    missing_distortion.KIND,
    sheared_pictures.KIND,
    stale_poses.KIND,
    too_little_rotation.KIND,
    inconsistent.KIND,
    view_shuffled.KIND,
    view_flipped.KIND,
    view_moving.KIND,
    gross_pose.KIND,
    points.OUTLYING,
    points.MISDETECTED,
    repeated_view.KIND,
)
# What may be wrong with all views at once and is told by trying it.
HYPOTHESES = (
    wrong_direction.hypotheses,
    wrong_unit.hypotheses,
    wrong_rotation.hypotheses,
    mirrored_pictures.hypotheses,
    board_size.hypotheses,
)
# Of these, what numbers of a pose may be misread as.
OF_NUMBERS = (wrong_unit.hypotheses, wrong_rotation.hypotheses)
CODES = frozenset(kind.code for kind in KINDS)


def kind_of(code: str) -> Kind | None:
    """Return the kind of a code, None for codes of other rooms."""
    return next((kind for kind in KINDS if kind.code == code), None)


__all__ = [
    "CODES",
    "HYPOTHESES",
    "KINDS",
    "OF_NUMBERS",
    "Handling",
    "Hypothesis",
    "Kind",
    "SharedFaultError",
    "kind_of",
]
