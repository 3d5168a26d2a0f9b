"""Arms that touch themselves, the floor, or leave their box."""

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.planning.collisions import Body, Workspace
from handeye.robots import open_arm

SPACE = Workspace(np.array([-2.0, -2.0, -1.0]), np.array([2.0, 2.0, 2.0]))


@pytest.mark.parametrize("name", ["epson_c4l", "ur5e", "lbr_iiwa_14"])
def test_frames_end_at_the_flange(name: str) -> None:
    arm = open_arm(name)
    joints = np.random.default_rng(0).uniform(-1, 1, (5, len(arm)))
    assert np.allclose(arm.frames(joints)[:, -1], arm.forward(joints), atol=1e-12)


def test_what_is_in_the_way_is_named() -> None:
    arm = open_arm("ur5e")
    upright = np.deg2rad([0, -90, 0, -90, 0, 0])
    folded = np.deg2rad([0, -90, 178, -90, 0, 0])
    lying = np.deg2rad([0, 30, 0, -90, 0, 0])
    beyond = np.deg2rad([0, -90, 500, -90, 0, 0])
    said = Body(arm, SPACE).obstacles(np.array([upright, folded, lying, beyond]))
    assert said[0] is None
    assert said[1] == "the arm would touch itself"
    assert said[2] == "the arm would touch the floor"
    assert said[3] == "a joint would be beyond its limits"
    low = Workspace(SPACE.lower_m, np.array([2.0, 2.0, 0.5]))
    assert Body(arm, low).obstacles(np.array([upright])) == ["flange or tool would leave the workspace"]
    # A long tool finds the floor before the links do.
    reaching = np.deg2rad([0, -60, 90, -120, -90, 0])
    assert Body(arm, SPACE).obstacles(np.array([reaching])) == [None]
    tool = Body(arm, SPACE, np.array([[0.0, 0.0, 0.9]]))
    assert tool.obstacles(np.array([reaching])) != [None]


def test_the_way_counts_as_well_as_its_ends() -> None:
    arm = open_arm("ur5e")
    body = Body(arm, SPACE)
    left, right = np.deg2rad([[0, -30, 0, -90, 0, 0], [0, -150, 0, -90, 0, 0]])
    assert body.obstacle_on_path(left, right) is None
    down = np.deg2rad([0, 210, 0, -90, 0, 0])  # the same posture as `right`, the other way round
    assert body.obstacles(down[np.newaxis]) == [None]
    assert body.obstacle_on_path(left, down) == "the arm would touch the floor"


def test_a_floor_is_a_number() -> None:
    for values in ({"floor_m": np.nan}, {"link_radius_m": np.inf}, {"tool_radius_m": np.nan}):
        with pytest.raises(InputError, match="floor at") as caught:
            Workspace(np.zeros(3), np.ones(3), **values)
        assert "floor as a number" in (caught.value.hint or "")


def test_a_workspace_has_an_inside() -> None:
    with pytest.raises(InputError):
        Workspace(np.zeros(3), np.array([1.0, 1.0, 0.0]))
    assert SPACE.contains([[0, 0, 0], [1, 1, 1]])
    assert not SPACE.contains([0, 0, 3])
