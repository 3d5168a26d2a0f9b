"""Arms from MJCF: the same arm written as URDF moves alike, and what is not supported is said."""

from pathlib import Path

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.robots import open_arm, parse_urdf
from handeye.robots.mjcf import parse_mjcf

LIMIT = '<limit lower="-1" upper="2" velocity="1" effort="1"/>'
URDF = f"""<robot name="three">
<link name="world"/><link name="one"/><link name="two"/><link name="three"/><link name="flange"/>
<joint name="a" type="revolute"><origin xyz="0.1 0.2 0.3" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 1"/>{LIMIT}
  <parent link="world"/><child link="one"/></joint>
<joint name="b" type="revolute"><origin xyz="0 0.1 0.5" rpy="0.3 0 0"/><axis xyz="0 1 0"/>{LIMIT}
  <parent link="one"/><child link="two"/></joint>
<joint name="c" type="prismatic"><origin xyz="0.4 0 0" rpy="0 -0.7 0"/><axis xyz="1 0 0"/>
  <limit lower="0" upper="0.2" velocity="1"/><parent link="two"/><child link="three"/></joint>
<joint name="f" type="fixed"><origin xyz="0 0 0.1" rpy="0.1 0.2 0.3"/><parent link="three"/><child link="flange"/></joint>
</robot>"""
DEG = 180 / np.pi
MJCF = f"""<mujoco model="three"><compiler eulerseq="XYZ"/>
<default><joint axis="0 1 0"/><default class="turning"><joint range="{-DEG} {2 * DEG}"/>
  <default class="first"><joint axis="0 0 2"/></default></default></default>
<worldbody><light/><body name="one" pos="0.1 0.2 0.3" quat="2 0 0 2" childclass="turning">
  <joint name="a" class="first"/><geom type="box" size="1 1 1"/>
  <body name="two" pos="0 0.1 0.5" axisangle="2 0 0 {0.3 * DEG}"><joint name="b"/>
    <body name="three" pos="0.4 0 0" euler="0 {-0.7 * DEG} 0">
      <joint name="c" type="slide" axis="1 0 0" range="0 0.2"/>
      <site name="flange" pos="0 0 0.1" euler="{0.1 * DEG} {0.2 * DEG} {0.3 * DEG}"/>
</body></body></body></worldbody></mujoco>"""


def postures(count: int) -> np.ndarray:
    return np.random.default_rng(2).uniform([-1, -1, 0], [2, 2, 0.2], (count, 3))


def test_it_moves_like_the_same_arm_in_urdf() -> None:
    described, arm = parse_urdf(URDF.encode()), parse_mjcf(MJCF.encode(), tip="flange")
    q = postures(50)
    assert np.allclose(arm.forward(q), described.forward(q), atol=1e-12)
    assert np.allclose(arm.limits, described.limits, atol=1e-12)
    assert (arm.joint_names, arm.sliding) == (("a", "b", "c"), (False, False, True))
    assert (arm.name, arm.base, arm.flange) == ("three", "world", "flange")
    # Without a tip it ends with the last body.
    assert parse_mjcf(MJCF.encode()).flange == "three"


def test_an_axis_beside_the_origin_and_several_joints_of_one_body() -> None:
    mjcf = """<mujoco><compiler angle="radian"/><worldbody><body name="arm" pos="0 0 1">
        <joint name="x" pos="0.5 0 0" axis="0 0 1"/><joint name="y" axis="0 1 0"/>
        <site name="tip" pos="1 0 0"/></body></worldbody></mujoco>"""
    arm = parse_mjcf(mjcf.encode(), tip="tip")
    assert np.isinf(arm.limits).all()
    # A quarter turn about the axis at x = 0.5 takes the tip from x = 1 to y = 0.5.
    assert np.allclose(arm.forward([np.pi / 2, 0])[:3, 3], [0.5, 0.5, 1.0])
    assert np.allclose(arm.forward([0, np.pi / 2])[:3, 3], [0.0, 0.0, 0.0])
    assert np.allclose(arm.forward([0, 0])[:3, 3], [1.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("sequence", "euler", "rpy"),
    [("xyz", (0.1, 0.2, 0.3), None), ("XYZ", (0.1, 0.2, 0.3), (0.1, 0.2, 0.3)), ("zyx", (0.3, 0.2, 0.1), (0.1, 0.2, 0.3))],
)  # fmt: skip
def test_angles_about_moving_and_fixed_axes(sequence: str, euler: tuple[float, ...], rpy: object) -> None:
    words = " ".join(map(str, euler))
    mjcf = f"""<mujoco><compiler angle="radian" eulerseq="{sequence}"/><worldbody><body name="b">
        <joint name="j"/><site name="s" euler="{words}"/></body></worldbody></mujoco>"""
    turned = parse_mjcf(mjcf.encode(), tip="s").forward([0.0])[:3, :3]
    c, s = np.cos([0.1, 0.2, 0.3]), np.sin([0.1, 0.2, 0.3])
    x = np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]])
    y = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    z = np.array([[c[2], -s[2], 0], [s[2], c[2], 0], [0, 0, 1]])
    assert np.allclose(turned, x @ y @ z if rpy is None else z @ y @ x, atol=1e-12)


def test_directions_of_axes() -> None:
    mjcf = """<mujoco><worldbody><body name="b"><joint name="j"/>
        <site name="z" zaxis="1 0 1"/><site name="xy" xyaxes="0 2 0 -1 1 0"/></body></worldbody></mujoco>"""
    z = parse_mjcf(mjcf.encode(), tip="z").forward([0.0])[:3, :3]
    assert np.allclose(z[:, 2], np.array([1, 0, 1]) / np.sqrt(2))
    assert np.allclose(z[:, 1], [0, 1, 0])
    xy = parse_mjcf(mjcf.encode(), tip="xy").forward([0.0])[:3, :3]
    assert np.allclose(xy, [[0, -1, 0], [1, 0, 0], [0, 0, 1]])


def test_a_file_is_read_by_what_it_holds(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(MJCF)
    (tmp_path / "urdf.xml").write_text(URDF)
    assert open_arm(tmp_path / "arm.xml", tip="flange").base == "world"
    assert open_arm(tmp_path / "urdf.xml").flange == "flange"
    with pytest.raises(InputError, match="base"):
        open_arm(tmp_path / "arm.xml", base="one")
    (tmp_path / "bad.xml").write_text(MJCF.replace('quat="2 0 0 2"', 'quat="0 0 0 0"'))
    with pytest.raises(InputError, match=r"bad\.xml: line 4: body 'one'"):
        open_arm(tmp_path / "bad.xml")


BODY = '<mujoco>{0}<worldbody><body name="b" {1}>{2}</body></worldbody></mujoco>'


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ("<robot/>", "expected <mujoco>"),
        ("<mujoco/>", "no <worldbody>"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', "document type"),
        (BODY.format('<include file="/etc/passwd"/>', "", "<joint/>"), "<include>"),
        (BODY.format('<compiler angle="grad"/>', "", "<joint/>"), "expected degree or radian"),
        (BODY.format('<compiler eulerseq="xyw"/>', "", "<joint/>"), "three of xyzXYZ"),
        (BODY.format('<compiler coordinate="global"/>', "", "<joint/>"), "global coordinates"),
        (BODY.format("", "", "<freejoint/>"), "free joint"),
        (BODY.format("", "", '<joint type="ball"/>'), "expected hinge or slide"),
        (BODY.format("", "", '<joint axis="0 0 0"/>'), "no direction"),
        (BODY.format("", "", '<joint axis="0 nan 0"/>'), "no finite number"),
        (BODY.format("", "", '<joint ref="1"/>'), "reference position"),
        (BODY.format("", "", '<joint range="2 1"/>'), "not in order"),
        (BODY.format("", "", '<joint range="-9999 9999"/>'), "other units"),
        (BODY.format("", "", '<joint class="none"/>'), "no default class"),
        (BODY.format("", "", '<replicate count="3"/>'), "not supported"),
        (BODY.format("", 'pos="1 2"', "<joint/>"), "three numbers"),
        (BODY.format("", 'pos="999 0 0"', "<joint/>"), "more than 50 m"),
        (BODY.format("", 'quat="1 0 0 0" euler="1 0 0"', "<joint/>"), "at once"),
        (BODY.format("", "", ""), "no joint"),
        (BODY.format("", "", '<body name="b"/>'), "a second body"),
        (BODY.format("", "", '<body name="c"><joint/></body><body name="d"><joint/></body>'), "could end in"),
    ],
)
def test_what_cannot_be_used_is_said(document: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse_mjcf(document.encode())


def test_mangled_models_end_in_an_arm_or_an_error_of_ours() -> None:
    random = np.random.default_rng(4)
    content = MJCF.encode()
    arms = 0
    for _ in range(1500):
        broken = bytearray(content)
        for place in random.integers(len(broken), size=random.integers(1, 4)):
            broken[place : place + random.integers(0, 3)] = bytes(
                random.integers(32, 127, random.integers(0, 3))
            )
        try:
            parse_mjcf(bytes(broken))
            arms += 1
        except InputError:
            continue
    assert 0 < arms < 1500
