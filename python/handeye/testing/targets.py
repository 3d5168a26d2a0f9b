"""What every family of targets must do."""

from dataclasses import FrozenInstanceError, fields
from typing import Any, cast

import cv2
import numpy as np
import pytest

from handeye import _core
from handeye.cameras.render import Appearance, BoardRenderer
from handeye.detection import NotFound, detect
from handeye.errors import InputError
from handeye.types import Camera, Pose, Target

_CAMERA = Camera("pinhole", (1000.0, 1000.0, 480.0, 384.0), 960, 768)


class TargetTests:
    """Subclass it and give the fixture `target`, a board of your family.

    Examples
    --------
    >>> class TestMine(TargetTests):  # with the fixture `target`
    ...     within_px = 0.1
    >>> hasattr(TestMine, "test_cannot_be_changed")
    True
    """

    within_px = 0.5
    """So near to where it truly is must each point of a rendered picture be found."""

    def test_cannot_be_changed(self, target: Target) -> None:
        """A frozen dataclass; equal measures make equal boards."""
        assert target == target.changed()
        assert hash(target) == hash(target.changed())
        with pytest.raises(FrozenInstanceError):
            setattr(target, fields(cast("Any", target))[0].name, 1)

    def test_is_written_and_read_back(self, target: Target) -> None:
        """Through plain values, by the name of its family."""
        assert Target.from_dict(target.to_dict()) == target

    def test_points_lie_flat_and_apart(self, target: Target) -> None:
        """(P, 3) in metres, z = 0, the first one the origin, no two the same, read-only."""
        points = target.points
        assert points.shape == (target.point_count, 3)
        assert np.isfinite(points).all()
        assert not points[:, 2].any(), "z is not 0"
        assert not points[0].any(), "the origin is not at the first point"
        assert len(np.unique(np.round(points, 9), axis=0)) == len(points), "two points are at one place"
        assert not points.flags.writeable

    def test_symmetries_are_turns_onto_itself(self, target: Target) -> None:
        """Permutations of all points, identity first."""
        everything = np.arange(target.point_count)
        assert np.array_equal(target.symmetries[0], everything)
        for permutation in target.symmetries:
            assert np.array_equal(np.sort(permutation), everything)

    def test_describes_itself_in_a_line(self, target: Target) -> None:
        """For a person."""
        assert target.caption.strip()
        assert "\n" not in target.caption
        assert target.spacing_m > 0

    @pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
    def test_refuses_measures_that_cannot_be(self, target: Target, value: float) -> None:
        """With `InputError`."""
        with pytest.raises(InputError):
            target.changed(**{target.scale: value})

    def test_its_points_are_found_in_its_picture(self, target: Target) -> None:
        """Rendered, a little tilted: every point, by its number, where it is."""
        pose = _in_front(target, 0.35)
        renderer = BoardRenderer(_CAMERA, target, Appearance(blur_px=0.6, noise=2.0))
        found = detect(renderer.image(pose, np.random.default_rng(0)), target)
        assert not isinstance(found, NotFound), found
        assert len(found) >= 0.9 * target.point_count
        pixels, _ = _core.project_features(
            _CAMERA.lens, _CAMERA.parameters, pose.matrix, target.points, target.radii_m
        )
        off = min(
            float(np.linalg.norm(found.pixels - pixels[turn[found.point_ids]], axis=1).max())
            for turn in target.symmetries
        )
        assert off < self.within_px, f"{off:.2f} px off"


def _in_front(target: Target, tilt_rad: float) -> Pose:
    """Return `T_camera_target` with the whole board in the middle of the picture."""
    middle = (target.points.max(axis=0) + target.points.min(axis=0)) / 2
    extent = float(np.ptp(target.points, axis=0).max()) + 2 * target.spacing_m
    matrix = np.eye(4)
    matrix[:3, :3] = cv2.Rodrigues(np.array([tilt_rad, 0.6 * tilt_rad, 0.2]))[0]
    matrix[:3, 3] = np.array([0, 0, 1.7 * extent]) - matrix[:3, :3] @ middle
    return Pose(matrix)
