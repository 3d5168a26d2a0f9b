"""The chain and its names."""

import pytest

from handeye.types import Mounting, Pose

T_BASE_FLANGE = Pose.exp([0.3, -0.2, 0.9, 0.4, -1.1, 0.6])
X = Pose.exp([0.01, 0.02, 0.1, 0.3, 0.1, -2.0])
Y = Pose.exp([0.5, -0.4, 0.0, 0.0, 0.7, 0.2])


def frames(name: str) -> tuple[str, str]:
    """Outer and inner frame of a transform's name."""
    _, outer, inner = name.split("_")
    return outer, inner


@pytest.mark.parametrize(
    ("mounting", "a_name", "A"),
    [
        (Mounting.EYE_IN_HAND, "T_flange_base", T_BASE_FLANGE.inverse()),
        (Mounting.EYE_TO_HAND, "T_base_flange", T_BASE_FLANGE),
    ],
)
def test_the_inner_frames_of_the_chain_cancel(mounting: Mounting, a_name: str, A: Pose) -> None:
    assert mounting.chain(T_BASE_FLANGE) == A
    (camera, x), (a_outer, a_inner), (y, target) = map(frames, (mounting.x_name, a_name, mounting.y_name))
    assert (camera, target) == ("camera", "target")
    assert (x, a_inner) == (a_outer, y)


@pytest.mark.parametrize("mounting", Mounting)
def test_results_are_the_pose_of_the_camera_and_of_the_target(mounting: Mounting) -> None:
    results = mounting.results(X, Y)
    assert tuple(results) == mounting.result_names
    camera_name, target_name = mounting.result_names
    assert frames(camera_name) == frames(mounting.x_name)[::-1]
    assert results[camera_name] == X.inverse()
    assert target_name == mounting.y_name
    assert results[target_name] == Y


def test_values_are_those_of_files() -> None:
    assert [mounting.value for mounting in Mounting] == ["eye_in_hand", "eye_to_hand"]
