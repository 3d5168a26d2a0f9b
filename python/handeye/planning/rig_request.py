"""What is asked for with several cameras, and what is missing."""

from dataclasses import dataclass, field

from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation import RigEstimate
from handeye.estimation.confidence import Within
from handeye.estimation.work import Work, touch_map
from handeye.types.touch import TouchMap
from handeye.types.units import MM_PER_M

Pair = tuple[str, str]
FEWEST_STATIONS = 6


@dataclass(frozen=True)
class Aim:
    """One thing that is asked for: the pose of a camera, of two in each other, or what one's sight is worth.

    Parameters
    ----------
    cameras
        Name of the camera, or of two on one body.
    touch
        What is seen by the camera and touched by the arm; None for the pose.
    """

    cameras: tuple[str, ...]
    touch: Work | None = None

    def __str__(self) -> str:
        return " ".join((*self.cameras, *(() if self.touch is None else ("touch",))))


@dataclass(frozen=True)
class RigRequest:
    """How accurate all cameras must be: radii that hold their errors with 95 % probability.

    Parameters
    ----------
    translation_mm, rotation_deg
        Of the pose of each camera.
    cameras
        Those that are asked for; None for all.
    camera_to_camera
        The same two radii for cameras of one body in each other; None if that is not asked for.
    touch_mm
        In place of the first two: radius within which a touch lands by what each camera sees, wherever in the
        box of work. None if that is not asked for.
    work
        What is seen and touched.

    Raises
    ------
    InputError
        A radius that is not above zero.
    """

    translation_mm: float = 0.5
    rotation_deg: float = 0.05
    cameras: tuple[str, ...] | None = None
    camera_to_camera: tuple[float, float] | None = None
    touch_mm: float | None = None
    work: Work = field(default_factory=Work)

    def __post_init__(self) -> None:
        radii = (self.translation_mm, self.rotation_deg, *(self.camera_to_camera or ()))
        if not min(*radii, 1.0 if self.touch_mm is None else self.touch_mm) > 0:
            raise InputError("an accuracy above zero is needed", code=Code.OUT_OF_RANGE)

    def missing(self, estimate: RigEstimate) -> dict[Aim, float]:
        """Return what does not meet the request, and by which factor.

        Raises
        ------
        InputError
            Nothing in the box of work can be seen and touched.
        """
        found: dict[Aim, float] = {}
        for name in estimate.fit.measurements.cameras:
            if self.cameras is not None and name not in self.cameras:
                continue
            if self.touch_mm is not None:
                worst_mm = rig_touch_map(estimate, name, self.work).worst_m * MM_PER_M
                found[Aim((name,), self.work)] = worst_mm / self.touch_mm
            else:
                now = estimate.of_camera(name).within_95
                found[Aim((name,))] = _factor(now, self.translation_mm, self.rotation_deg)
        if self.camera_to_camera is not None:
            for a, b in rigid_pairs(estimate):
                now = estimate.camera_to_camera(a, b).within_95
                found[Aim((a, b))] = _factor(now, *self.camera_to_camera)
        return {aim: factor for aim, factor in found.items() if factor > 1}


def rig_touch_map(estimate: RigEstimate, camera: str, work: Work) -> TouchMap:
    """Return how far off the tool lands by what one of several cameras sees, over a place of work.

    Raises
    ------
    InputError
        No point of the box can be seen and reached, or the arm moves the camera against no target.
    """
    pair = seen_most(estimate, camera)
    return touch_map(estimate.of_pair(*pair), estimate.fit.measurements.pairs[pair], work)


def seen_most(estimate: RigEstimate, camera: str) -> Pair:
    """Return a camera and the target that stands for it.

    Raises
    ------
    InputError
        The arm moves the camera against no target.
    """
    target = estimate.target_of(camera)
    if target is None:
        raise InputError(f"camera {camera}: no target that the arm moves against it", code=Code.NOT_TIED)
    return camera, target


def rigid_pairs(estimate: RigEstimate) -> list[Pair]:
    """Return the pairs of cameras on one body."""
    cameras = estimate.fit.measurements.cameras
    names = list(cameras)
    return [(a, b) for i, a in enumerate(names) for b in names[i + 1 :] if cameras[a].body is cameras[b].body]


def _factor(now: Within, translation_mm: float, rotation_deg: float) -> float:
    return max(now.translation_mm / translation_mm, now.rotation_deg / rotation_deg)
