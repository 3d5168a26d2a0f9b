"""Shapes of links: where they are, what they are, and what cannot be used."""

from pathlib import Path

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.robots import read_urdf
from handeye.robots.shapes import read_shapes

LIMIT = '<limit lower="-3" upper="3" velocity="1" effort="1"/>'


def arm_file(folder: Path, shape: str = '<sphere radius="0.1"/>', **links: str) -> Path:
    """Two joints about z and y, the second half a metre above the first, with a fixed stand and a finger."""
    held = {"one": f'<collision><origin xyz="0 0 0.25"/><geometry>{shape}</geometry></collision>'} | links
    body = "".join(f'<link name="{name}">{held.get(name, "")}</link>' for name in (
        "base", "stand", "one", "two", "finger", "tool0"
    ))  # fmt: skip
    file = folder / "arm.urdf"
    file.write_text(
        f"""<robot name="small">{body}
        <joint name="s" type="fixed"><origin xyz="0 0 -0.2" rpy="0 0 1.5707963267948966"/>
          <parent link="base"/><child link="stand"/></joint>
        <joint name="a" type="revolute"><origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>{LIMIT}
          <parent link="base"/><child link="one"/></joint>
        <joint name="b" type="revolute"><origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>{LIMIT}
          <parent link="one"/><child link="two"/></joint>
        <joint name="f" type="prismatic"><axis xyz="1 0 0"/><limit lower="0" upper="0.1" velocity="1"/>
          <parent link="two"/><child link="finger"/></joint>
        <joint name="t" type="fixed"><origin xyz="0 0 0.3"/><parent link="two"/><child link="tool0"/></joint>
        </robot>"""
    )
    return file


def test_shapes_are_where_the_links_are(tmp_path: Path) -> None:
    def held(geometry: str) -> str:
        return f"<collision><geometry>{geometry}</geometry></collision>"

    file = arm_file(
        tmp_path,
        '<cylinder radius="0.05" length="0.5"/>',
        stand=held('<box size="1 2 3"/>'),
        tool0=held('<sphere radius="0.02"/>'),
        finger=held('<sphere radius="0.01"/>'),
    )
    arm = read_urdf(file, tip="tool0")
    shapes = {shape.link: shape for shape in read_shapes(file, arm)}
    assert set(shapes) == {"stand", "one", "tool0"}  # a finger moves by itself
    assert {(link, s.frame, s.kind, s.size) for link, s in shapes.items()} == {
        ("stand", 0, "box", (1.0, 2.0, 3.0)),
        ("one", 1, "cylinder", (0.05, 0.5)),
        ("tool0", 2, "sphere", (0.02,)),
    }
    assert np.allclose(shapes["one"].placement.translation, [0, 0, 0.25])
    assert np.allclose(shapes["stand"].placement.translation, [0, 0, -0.2])
    assert np.allclose(shapes["stand"].placement.rotation[:, 0], [0, 1, 0])
    assert np.allclose(shapes["tool0"].placement.translation, [0, 0, 0.3])


def test_meshes_are_found_beside_the_file_and_in_packages(tmp_path: Path) -> None:
    folder = tmp_path / "my_robot" / "urdf"
    folder.mkdir(parents=True)
    mesh = tmp_path / "my_robot" / "meshes" / "link.STL"
    mesh.parent.mkdir()
    mesh.write_bytes(b"solid")
    (folder / "near.obj").write_bytes(b"")
    for name, found in (("near.obj", folder / "near.obj"), ("package://my_robot/meshes/link.STL", mesh)):
        file = arm_file(folder, f'<mesh filename="{name}" scale="0.001 0.001 0.001"/>')
        shape = read_shapes(file, read_urdf(file, tip="tool0"))[0]
        assert (shape.kind, shape.file, shape.size) == ("mesh", found, (0.001, 0.001, 0.001))


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        ('<mesh filename="none.stl"/>', "is not there"),
        ('<mesh filename="/etc/passwd"/>', "expected one of"),
        ('<mesh filename="package://x/../../../secret.stl"/>', "leaves its package"),
        ("<mesh/>", "missing"),
        ('<sphere radius="-1"/>', "above zero"),
        ('<sphere radius="1e9"/>', "above zero"),
        ('<sphere radius="nan"/>', "no finite number"),
        ('<box size="1 2"/>', "three numbers"),
        ("<capsule/>", "expected box"),
        ("", "not exactly one shape"),
        ('<sphere radius="1"/><sphere radius="1"/>', "not exactly one shape"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_said(shape: str, words: str, tmp_path: Path) -> None:
    file = arm_file(tmp_path, shape)
    with pytest.raises(InputError, match=words) as error:
        read_shapes(file, read_urdf(file, tip="tool0"))
    assert str(file) in error.value.message
