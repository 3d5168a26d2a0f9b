"""Sets of poses without pictures, as the tools of others write them."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from handeye.datasets import PosePairs, load
from handeye.errors import InputError
from handeye.types import Mounting, Pose
from poses_written import some_poses

X = Pose.exp([0.03, -0.06, 0.09, 0.1, 0.2, 1.5])
Y = Pose.exp([0.6, -0.2, 0.03, 3.0, 0.1, 0.2])


def stations(mounting: Mounting, count: int = 8) -> list[tuple[Pose, Pose]]:
    """`T_base_flange` and `T_camera_target`, exact."""
    return [(pose, X @ mounting.chain(pose) @ Y) for pose in some_poses(count, 5)]


def transform(pose: Pose, indent: str) -> str:
    (x, y, z), (qx, qy, qz, qw) = pose.translation.tolist(), pose.quaternion_xyzw.tolist()
    return (
        f"{indent}translation:\n{indent}  x: {x}\n{indent}  y: {y}\n{indent}  z: {z}\n"
        f"{indent}rotation:\n{indent}  x: {qx}\n{indent}  y: {qy}\n{indent}  z: {qz}\n{indent}  w: {qw}\n"
    )


def easy_samples(
    mounting: Mounting, kind: str = "", wrong: int = 0, listed: Sequence[tuple[Pose, Pose]] = ()
) -> str:
    """As easy_handeye2 writes them: its parameters empty, `robot` the other way round beside the robot.

    The target of the first `wrong` samples is that of the last.
    """
    parts = [
        f"parameters:\n  name: ''\n  calibration_type: '{kind}'\n  freehand_robot_movement: false\nsamples:\n"
    ]
    listed = listed or stations(mounting)
    for index, (pose, right) in enumerate(listed):
        seen = listed[-1][1] if index < wrong else right
        robot = pose if mounting is Mounting.EYE_IN_HAND else pose.inverse()
        parts.append(f"- robot:\n{transform(robot, '    ')}  tracking:\n{transform(seen, '    ')}")
    return "".join(parts)


def moveit_samples(stations: Sequence[tuple[Pose, Pose]]) -> str:
    lines = []
    for pose, seen in stations:
        lines.append(f"- effector_wrt_world: {[round(v, 12) for v in pose.matrix.ravel().tolist()]}")
        lines.append(f"  object_wrt_sensor: {[round(v, 12) for v in seen.matrix.ravel().tolist()]}")
    return "\n".join(lines)


def visp_pose(pose: Pose) -> str:
    vector = np.concatenate([pose.translation, Pose.exp([0, 0, 0, *rotation_of(pose)]).log()[3:]])
    rows = "\n".join(f"  - [{value!r}]" for value in vector.tolist())
    return f"# vpPoseVector\nrows: 6\ncols: 1\ndata:\n{rows}\n"


def rotation_of(pose: Pose) -> list[float]:
    matrix = np.eye(4)
    matrix[:3, :3] = pose.rotation
    return Pose(matrix).log()[3:].tolist()


def check(found: object, mounting: Mounting) -> None:
    assert isinstance(found, PosePairs)
    assert found.mounting is mounting
    for pair, (pose, seen) in zip(found.pairs, stations(mounting), strict=True):
        assert np.abs(pair.T_base_flange.matrix - pose.matrix).max() < 1e-9
        assert np.abs(pair.T_camera_target.matrix - seen.matrix).max() < 1e-9


@pytest.mark.parametrize("mounting", Mounting)
def test_easy_handeye2(mounting: Mounting, tmp_path: Path) -> None:
    path = tmp_path / "demo.samples"
    path.write_text(easy_samples(mounting))
    check(load(path, mounting=mounting), mounting)
    with pytest.raises(InputError, match="do not say where the camera sits"):
        load(path)
    kind = "eye_in_hand" if mounting is Mounting.EYE_IN_HAND else "eye_on_base"
    path.write_text(easy_samples(mounting, kind))
    check(load(path), mounting)


@pytest.mark.parametrize("mounting", Mounting)
def test_moveit(mounting: Mounting, tmp_path: Path) -> None:
    (tmp_path / "samples.yaml").write_text(moveit_samples(stations(mounting)))
    check(load(tmp_path / "samples.yaml", mounting=mounting), mounting)
    pairs = [[pose.to_list(), seen.to_list()] for pose, seen in stations(mounting)]
    (tmp_path / "pose_samples.json").write_text(json.dumps(pairs))
    check(load(tmp_path / "pose_samples.json", mounting=mounting), mounting)


def test_moveit_says_what_it_assumes(tmp_path: Path) -> None:
    (tmp_path / "samples.yaml").write_text(moveit_samples(stations(Mounting.EYE_IN_HAND)))
    found = load(tmp_path / "samples.yaml")
    assert isinstance(found, PosePairs)
    assert [warning.code for warning in found.warnings] == ["mounting_assumed"]


def test_visp(tmp_path: Path) -> None:
    for k, (pose, seen) in enumerate(stations(Mounting.EYE_IN_HAND), start=1):
        (tmp_path / f"pose_rPe_{k}.yaml").write_text(visp_pose(pose))
        (tmp_path / f"pose_cPo_{k}.yaml").write_text(visp_pose(seen))
    check(load(tmp_path), Mounting.EYE_IN_HAND)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.samples", "samples: []", "no samples"),
        ("a.samples", "samples: [{robot: 1}]", "robot"),
        ("a.samples", "[" * 5000, "not YAML"),
        ("a.samples", easy_samples(Mounting.EYE_IN_HAND).replace("w: ", "w: 7", 1), "sample 1"),
        ("a.yaml", moveit_samples(stations(Mounting.EYE_IN_HAND)).replace("object_wrt", "thing_wrt") + "\n- 1", "nothing that can be read"),
        ("a.yaml", moveit_samples(stations(Mounting.EYE_IN_HAND)) + "\n- effector_wrt_world: [1]", "sample 9"),
        ("a.yaml", "- effector_wrt_world: [1, 2]\n  object_wrt_sensor: [x]", "2 numbers, expected 16"),
        ("a.json", "[[[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]],[[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]]]", "sample 1"),
    ],
)  # fmt: skip
def test_faults_are_named(name: str, text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=words):
        load(tmp_path / name, mounting=Mounting.EYE_IN_HAND)
