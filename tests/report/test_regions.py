"""The uncertainty in words is that of the covariance."""

import numpy as np
import pytest

from handeye.report.regions import at_points, position_axes, rotation_axes, within
from handeye.report.wording import direction, figures, fixed, in_camera, turning_camera
from handeye.types import Pose
from handeye.types.arrays import FloatArray

CAMERA = Pose.exp([0.1, -0.2, 0.05, 0.4, -1.1, 1.9])


def a_covariance(seed: int = 3) -> FloatArray:
    root = np.random.default_rng(seed).normal(size=(6, 6)) * [[1e-4]] * 3
    root[3:] *= 0.5
    return root @ root.T


def draws(covariance: FloatArray, count: int = 20_000) -> FloatArray:
    return np.random.default_rng(9).multivariate_normal(np.zeros(6), covariance, count)


def test_radii_hold_95_percent() -> None:
    covariance = a_covariance()
    known = within(covariance, float("inf"))
    twists = draws(covariance)
    assert np.mean(np.linalg.norm(twists[:, :3], axis=1) * 1000 < known.translation_mm) == pytest.approx(
        0.95, abs=0.01
    )
    assert np.mean(np.rad2deg(np.linalg.norm(twists[:, 3:], axis=1)) < known.rotation_deg) == pytest.approx(
        0.95, abs=0.01
    )


def test_axes_bound_the_region_in_the_frame_of_the_parent() -> None:
    covariance = a_covariance()
    axes = position_axes(covariance, float("inf"), CAMERA.rotation, "flange")
    lengths = [axis.half_length_mm for axis in axes]
    assert lengths == sorted(lengths, reverse=True)
    # The camera truly moves so in the parent when the twist acts on it in its own frame.
    moved = np.array(
        [(CAMERA @ Pose.exp(-twist)).translation - CAMERA.translation for twist in draws(covariance, 5000)]
    )
    directions = np.array([axis.direction_in_parent for axis in axes])
    inside = np.sum((1000 * moved @ directions.T / lengths) ** 2, axis=1) < 1
    assert np.mean(inside) == pytest.approx(0.95, abs=0.015)
    for axis in axes:
        np.testing.assert_allclose(
            CAMERA.rotation @ axis.direction_in_camera, axis.direction_in_parent, atol=1e-12
        )
        assert f"{figures(axis.half_length_mm, 2)} mm" in axis.words


def test_axes_of_the_rotation_are_those_of_its_block() -> None:
    covariance = np.diag([1e-8, 1e-8, 1e-8, 9e-8, 4e-8, 1e-8])
    axes = rotation_axes(covariance, float("inf"), np.eye(3), "base")
    angles = [axis.half_angle_deg for axis in axes]
    np.testing.assert_allclose(
        angles, np.rad2deg(np.sqrt(7.814728 * np.array([9e-8, 4e-8, 1e-8]))), rtol=1e-6
    )
    assert [axis.words.split(" deg ")[1] for axis in axes] == [
        "about x of the base: the camera nods",
        "about y of the base: the camera pans",
        "about z of the base: the image rolls",
    ]


def test_few_degrees_of_freedom_widen_everything() -> None:
    covariance = a_covariance()
    assert within(covariance, 6.0).translation_mm > 1.2 * within(covariance, float("inf")).translation_mm
    few = position_axes(covariance, 6.0, np.eye(3), "base")[0]
    assert (
        few.half_length_mm
        > 1.2 * position_axes(covariance, float("inf"), np.eye(3), "base")[0].half_length_mm
    )


@pytest.mark.parametrize("distance", [0.0, 0.4, 2.0])
def test_points_ahead_are_as_uncertain_as_the_camera_makes_them(distance: float) -> None:
    covariance = a_covariance()
    (point,) = at_points(covariance, float("inf"), [(distance, "here")])
    place = np.array([[0.0, 0.0, distance]])
    off = [
        np.linalg.norm((CAMERA @ Pose.exp(-twist)).act(place)[0] - CAMERA.act(place)[0])
        for twist in draws(covariance, 4000)
    ]
    assert 1000 * np.quantile(off, 0.95) == pytest.approx(point.within_95_mm, rel=0.05)
    assert point.distance_mm == pytest.approx(1000 * distance)


def test_directions_have_names() -> None:
    assert direction(np.array([0.1, -0.99, 0.05]), "flange") == "y of the flange"
    assert direction(np.array([0.7, 0.7, 0.0]), "base") == "a line between x and y of the base"
    assert (
        direction(np.array([0.0, 0.7, -0.71]), "base") == "a line between z and \N{MINUS SIGN}y of the base"
    )
    assert in_camera(np.array([0.0, 0.1, -1.0])) == "along the optical axis"
    assert in_camera(np.array([1.0, 1.0, 0.0])) == "oblique to the image"
    assert turning_camera(np.array([0.0, 0.0, 1.0])) == "the image rolls"


def test_numbers_are_written_for_people() -> None:
    assert figures(0.68565, 2) == "0.69"
    assert figures(1234.5, 2) == "1234"
    assert figures(0.0) == "0"
    assert fixed(-1.25, 1) in {"\N{MINUS SIGN}1.2", "\N{MINUS SIGN}1.3"}
    assert fixed(-0.0001, 2) == "0.00"
