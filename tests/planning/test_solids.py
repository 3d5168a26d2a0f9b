"""Links that touch by their shapes: against distances worked out by hand, and in the choice of views."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.planning.collisions import TOUCHES_ITSELF, Body, Workspace
from handeye.planning.solids import PADDING_M, SolidLinks
from handeye.robots.model import Arm, Joint
from handeye.robots.shapes import Shape
from handeye.session.configuration import begin, prepare
from handeye.session.settings import Collisions, Configuration
from handeye.types import Pose
from sessions import configured

SPACE = Workspace(np.full(3, -5.0), np.full(3, 5.0), floor_m=-5.0)


def at(x: float, y: float, z: float) -> Pose:
    return Pose.exp([x, y, z, 0, 0, 0])


def turning(count: int = 3) -> Arm:
    """Joints about z, a metre from each other along x."""
    joints = [Joint(f"j{i}", at(1.0 if i else 0.0, 0, 0), lower=-3.1, upper=3.1) for i in range(count)]
    return Arm("flat", tuple(joints), at(1.0, 0, 0))


def test_balls_touch_where_their_distance_says() -> None:
    pytest.importorskip("fcl", reason="the extra meshes is not installed")
    arm = turning()
    # One in the base at the origin, one at the end: the arm folds back on itself.
    shapes = [
        Shape("base", 0, Pose.identity(), "sphere", (0.2,)),
        Shape("end", 3, at(1.0, 0, 0), "sphere", (0.3,)),
    ]
    solids = SolidLinks(arm, shapes)
    random = np.random.default_rng(1)
    postures = random.uniform(-3, 3, (300, 3))
    gaps = np.linalg.norm(arm.forward(postures)[:, :3, 3], axis=1) - 0.5 - 2 * PADDING_M
    assert 10 < np.count_nonzero(gaps < 0) < 150
    said = np.array([solids.touch(q[np.newaxis]) for q in postures])
    clear = np.abs(gaps) > 1e-6
    assert np.array_equal(said[clear], (gaps < 0)[clear])
    assert solids.touch(postures)


def test_boxes_cylinders_and_meshes(tmp_path: Path) -> None:
    pytest.importorskip("fcl", reason="the extra meshes is not installed")
    pytest.importorskip("trimesh", reason="the extra meshes is not installed")
    arm = turning()
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    faces = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    (tmp_path / "cube.obj").write_text(
        "".join("v {} {} {}\n".format(*corner) for corner in corners)
        + "".join("f {} {} {} {}\n".format(*face) for face in faces)
    )
    ball = Shape("end", 3, at(1.0, 0, 0), "sphere", (0.1,))
    cube = tmp_path / "cube.obj"
    for block in (
        Shape("base", 0, at(0, -1.0, 0), "box", (0.4, 0.4, 0.4)),
        Shape("base", 0, at(0, -1.0, 0), "cylinder", (0.2, 0.4)),
        Shape("base", 0, at(0, -1.0, 0), "mesh", (0.2, 0.2, 0.2), cube),
    ):
        solids = SolidLinks(arm, [block, ball])
        # The end stands straight beyond the block, and is let down towards it.
        for gap, touches in ((-0.05, True), (0.005, True), (0.05, False)):
            target = np.array([0.0, -1.0 + 0.2 + 0.1 + gap, 0.0])
            joints = _reach(arm, target)
            assert solids.touch(joints[np.newaxis]) is touches, (block.kind, gap)
    broken = tmp_path / "broken.stl"
    broken.write_bytes(b"solid nothing")
    with pytest.raises(InputError, match=r"broken\.stl"):
        SolidLinks(arm, [Shape("base", 0, Pose.identity(), "mesh", (1.0, 1.0, 1.0), broken), ball])


def _reach(arm: Arm, place: np.ndarray) -> np.ndarray:
    """Joints at which the end is at a place of the plane, by a coarse search and Newton's method."""
    q = np.array([0.7, -2.6, 2.2])
    for _ in range(200):
        end = arm.forward(q)[:3, 3]
        jacobian = (np.array([arm.forward(q + 1e-6 * e)[:3, 3] for e in np.eye(3)]) - end).T / 1e-6
        q = q + 0.5 * np.linalg.pinv(jacobian) @ (place - end)
    assert np.allclose(arm.forward(q)[:3, 3], place, atol=1e-9)
    return q


def test_a_path_is_judged_by_shapes_where_there_are_any() -> None:
    pytest.importorskip("fcl", reason="the extra meshes is not installed")
    arm = turning()
    shapes = [
        Shape("base", 0, Pose.identity(), "sphere", (0.2,)),
        Shape("end", 3, at(1.0, 0, 0), "sphere", (0.3,)),
    ]
    body = Body(arm, SPACE, solids=SolidLinks(arm, shapes))
    folded = np.array([0.0, 2.2, 1.9])
    assert np.linalg.norm(arm.forward(folded)[:3, 3]) < 0.5
    assert body.obstacle_on_path(np.zeros(3), folded) == TOUCHES_ITSELF
    assert body.obstacle_on_path(np.zeros(3), np.array([1.0, 0.5, 0.0])) is None
    # Beside capsules: the thin arm passes where thick links would not.
    thick = Body(arm, replace(SPACE, link_radius_m=0.4))
    crossed = np.array([0.0, 1.8, 1.8])
    assert thick.obstacle_on_path(np.zeros(3), crossed) == TOUCHES_ITSELF
    assert replace(thick, solids=body.solids).obstacles(crossed[np.newaxis]) == [None]


def test_links_that_always_touch_are_left_out_and_none_is_an_error() -> None:
    pytest.importorskip("fcl", reason="the extra meshes is not installed")
    arm = turning()
    huge = [
        Shape("base", 0, Pose.identity(), "sphere", (10.0,)),
        Shape("end", 3, Pose.identity(), "sphere", (0.1,)),
    ]
    with pytest.raises(InputError, match="no shapes of links that could touch"):
        SolidLinks(arm, huge)


def test_without_shapes_capsules_are_said_to_be_used() -> None:
    prepared = prepare(configured(0))
    assert (prepared.cell.solids, prepared.configuration.collisions) == (None, Collisions.CAPSULES)
    with pytest.raises(InputError):
        prepare(replace(configured(0), collisions=Collisions.MESHES))
    again = Configuration.from_dict(prepared.configuration.to_dict())
    assert again.collisions is Collisions.CAPSULES


def test_a_loop_with_the_meshes_of_a_ur5e(tmp_path: Path) -> None:
    pytest.importorskip("fcl", reason="the extra meshes is not installed")
    models = pytest.importorskip("airo_models", reason="the extra ur5e is not installed")
    file = models.get_urdf_path("ur5e")
    prepared = prepare(configured(5, robot=file, most_views=5))
    assert prepared.configuration.collisions is Collisions.MESHES
    assert prepared.cell.solids is not None
    session, store = begin(prepared, tmp_path / "s")
    end = session.run()
    store.close()
    assert end.views == 5
    for entry in store.entries:
        assert not prepared.cell.solids.touch(np.array([entry.goal_joints]))
