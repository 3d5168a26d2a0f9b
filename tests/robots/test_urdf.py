"""Robot descriptions: what URDF means, and what a stranger may put in one."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from handeye.errors import HandeyeError, InputError
from handeye.robots import Arm, open_arm, parse_urdf, read_urdf
from handeye.robots.xml_tree import MAX_DEPTH

LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="1"/>'


def joint(
    name: str, parent: str, child: str, kind: str = "revolute", inside: str = LIMIT, origin: str = ""
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f"{origin}{inside}</joint>"
    )


def robot(*parts: str, links: str = "abc") -> bytes:
    every = "".join(f'<link name="{link}"/>' for link in links)
    return f'<?xml version="1.0"?><robot name="r">{every}{"".join(parts)}</robot>'.encode()


def two_joints(**changes: str) -> bytes:
    return robot(joint("one", "a", "b", **changes), joint("two", "b", "c"))


class TestMeaning:
    def test_origins_and_axes_are_those_of_urdf(self) -> None:
        document = robot(
            joint(
                "one",
                "a",
                "b",
                inside=f'<axis xyz="0 2 0"/>{LIMIT}',
                origin='<origin xyz="0.1 0.2 0.3" rpy="0.4 -0.5 2.6"/>',
            ),
            joint("mount", "b", "c", "fixed", inside="", origin='<origin rpy="0 0 1" xyz="0 0 1e-1"/>'),
            joint("slide", "c", "d", "prismatic", inside=f'<axis xyz="0 0 -1"/>{LIMIT}'),
            joint("tool", "d", "e", "fixed", inside="", origin='<origin xyz="0.05 0 0"/>'),
            links="abcde",
        )
        arm = parse_urdf(document)
        assert arm.joint_names == ("one", "slide")
        assert arm.sliding == (False, True)
        assert (arm.base, arm.flange, arm.name) == ("a", "e", "r")

        def matrix(rotation: Rotation, shift: list[float]) -> np.ndarray:
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = rotation.as_matrix(), shift
            return pose

        still = Rotation.identity()
        expected = (
            matrix(Rotation.from_euler("xyz", [0.4, -0.5, 2.6]), [0.1, 0.2, 0.3])
            @ matrix(Rotation.from_rotvec([0, 0.7, 0]), [0, 0, 0])
            @ matrix(Rotation.from_euler("z", 1), [0, 0, 0.1])
            @ matrix(still, [0, 0, -0.25])
            @ matrix(still, [0.05, 0, 0])
        )
        assert np.abs(arm.forward([0.7, 0.25]) - expected).max() < 1e-12

    def test_limits_and_speeds(self) -> None:
        arm = parse_urdf(two_joints())
        assert arm.limits.tolist() == [[-1, 2], [-1, 2]]
        assert arm.velocities.tolist() == [3, 3]
        free = parse_urdf(two_joints(kind="continuous", inside='<limit effort="1" velocity="0"/>'))
        assert np.all(np.isinf(free.limits[0]))
        assert np.isinf(free.velocities[0])

    def test_the_default_axis_is_x(self) -> None:
        assert parse_urdf(two_joints()).joints[0].axis == (1.0, 0.0, 0.0)

    def test_branches_are_left_out(self) -> None:
        document = robot(
            joint("one", "a", "b"),
            joint("two", "b", "c"),
            joint("finger", "c", "d", "prismatic", inside=f'<mimic joint="x"/>{LIMIT}'),
            joint("flange_joint", "c", "tool0", "fixed", inside=""),
            links="abcd",
        ).replace(b"</robot>", b'<link name="tool0"/><gazebo><joint name="x"/></gazebo></robot>')
        with pytest.raises(InputError, match="mimics"):
            parse_urdf(document)
        assert parse_urdf(document, tip="tool0").joint_names == ("one", "two")
        assert parse_urdf(document, base="b", tip="tool0").joint_names == ("two",)

    def test_a_tip_is_found_by_its_name_or_asked_for(self) -> None:
        document = robot(
            joint("one", "a", "b"),
            joint("x", "b", "left", "fixed", inside=""),
            joint("y", "b", "right", "fixed", inside=""),
            links="ab",
        ).replace(b"</robot>", b'<link name="left"/><link name="right"/></robot>')
        with pytest.raises(InputError, match="could end in any of 'left', 'right'") as caught:
            parse_urdf(document)
        assert "flange" in str(caught.value.hint)
        assert parse_urdf(document.replace(b"right", b"arm_flange")).flange == "arm_flange"

    def test_files_and_names(self, tmp_path: Path) -> None:
        file = tmp_path / "own.urdf"
        file.write_bytes(two_joints())
        assert len(open_arm(file)) == len(open_arm(str(file))) == 2
        assert isinstance(open_arm("ur5e"), Arm)
        for bad in (tmp_path / "none.urdf", tmp_path, "a\0b.urdf"):
            with pytest.raises(InputError):
                read_urdf(bad)
        file.write_bytes(b"<robot>")
        with pytest.raises(InputError, match=r"own.urdf: line 1: no element found"):
            open_arm(file)


UNUSABLE = {
    "no xml": (b"hello", "not well-formed|syntax error"),
    "empty": (b"", "no element found"),
    "cut off": (two_joints()[:-20], "line 1"),
    "another format": (b"<mujoco/>", "expected <robot>"),
    "a template": (two_joints(origin='<origin xyz="0 0 ${h}"/>'), "xacro"),
    "a template by its tags": (
        b'<robot xmlns:xacro="x"><xacro:include filename="x"/><link name="a"/></robot>',
        "xacro",
    ),
    "no link": (b"<robot/>", "no <link>"),
    "a link without name": (b"<robot><link/></robot>", "'name' is missing"),
    "a link twice": (robot(joint("one", "a", "b"), links="abb"), "second link 'b'"),
    "a joint twice": (robot(joint("one", "a", "b"), joint("one", "b", "c")), "second joint 'one'"),
    "a missing link": (robot(joint("one", "a", "z")), "child link 'z' is not in the file"),
    "no parent": (
        robot('<joint name="one" type="fixed"><child link="b"/></joint>'),
        "no <parent link=...>",
    ),
    "two parents": (
        robot(joint("one", "a", "c"), joint("two", "b", "c")),
        "hangs on two joints, 'one' and 'two'",
    ),
    "a circle": (robot(joint("one", "a", "b"), joint("two", "b", "a")), "in a circle"),
    "a circle of one": (robot(joint("one", "a", "a")), "in a circle"),
    "two roots": (
        robot(joint("one", "a", "b"), joint("two", "c", "d"), links="abcd"),
        "several links have no parent: 'a', 'c'",
    ),
    "nothing moves": (robot(joint("one", "a", "b", "fixed")), "no joint that moves"),
    "an unknown type": (two_joints(kind="helical"), "type 'helical'"),
    "a floating joint": (two_joints(kind="floating"), "'one' is floating"),
    "not a number": (two_joints(origin='<origin xyz="0 nan 0"/>'), "'nan' is no finite number"),
    "infinite": (two_joints(origin='<origin xyz="0 1e999 0"/>'), "'1e999' is no finite number"),
    "hexadecimal": (two_joints(origin='<origin xyz="0 0x1 0"/>'), "no finite number"),
    "two numbers": (two_joints(origin='<origin xyz="0 1"/>'), "expected three numbers"),
    "very long numbers": (two_joints(origin=f'<origin xyz="{"1" * 10_000} 0 0"/>'), "expected three numbers"),
    "millimetres": (two_joints(origin='<origin xyz="0 0 162.5"/>'), "more than 50 m"),
    "degrees": (two_joints(origin='<origin rpy="0 90 0"/>'), "more than two turns"),
    "degrees as limits": (two_joints(inside='<limit lower="-170" upper="170"/>'), "limits -170 to 170"),
    "limits crossed": (two_joints(inside='<limit lower="1" upper="-1"/>'), "not in order"),
    "a negative speed": (two_joints(inside='<limit velocity="-1"/>'), "largest speed of -1"),
    "no limits": (two_joints(inside=""), "without <limit>"),
    "two limits": (two_joints(inside=LIMIT * 2), "second <limit>"),
    "an axis of no length": (two_joints(inside=f'<axis xyz="0 0 0"/>{LIMIT}'), "has no direction"),
    "an axis of no number": (two_joints(inside=f'<axis xyz="a b c"/>{LIMIT}'), "no finite number"),
    "a mimic": (two_joints(inside=f'<mimic joint="two"/>{LIMIT}'), "mimics"),
    "an unknown encoding": (b'<?xml version="1.0" encoding="klingon"?><robot/>', "line 1|encoding"),
    "zeros inside": (b"<robot>\0</robot>", "not well-formed|line 1"),
    "17 joints": (
        robot(
            *(joint(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(17)),
            *(f'<link name="l{i}"/>' for i in range(18)),
            links="",
        ),
        "17 joints that move, expected 1 to 16",
    ),
}

BOMB = b"""<?xml version="1.0"?><!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">]><robot name="&c;"><link name="&c;"/></robot>"""
UNSAFE = {
    "an entity bomb": BOMB,
    "an outside file": b'<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="r">&x;</robot>',
    "an outside type": b'<!DOCTYPE r SYSTEM "http://127.0.0.1:9/x.dtd"><robot name="r"/>',
    "parameter entities": b'<!DOCTYPE r [<!ENTITY % p SYSTEM "file:///etc/passwd"> %p;]><robot/>',
}


class TestHostile:
    @pytest.mark.parametrize(("document", "message"), UNUSABLE.values(), ids=UNUSABLE.keys())
    def test_unusable_descriptions_are_refused(self, document: bytes, message: str) -> None:
        with pytest.raises(InputError, match=message):
            parse_urdf(document)

    @pytest.mark.parametrize("document", UNSAFE.values(), ids=UNSAFE.keys())
    def test_document_types_and_entities_are_refused(self, document: bytes) -> None:
        with pytest.raises(InputError, match="document type or an entity") as caught:
            parse_urdf(document)
        assert caught.value.code == "unsafe_xml"

    def test_size_and_depth_are_bounded(self) -> None:
        deep = b"<robot>" + b"<x>" * MAX_DEPTH + b"</x>" * MAX_DEPTH + b"</robot>"
        with pytest.raises(InputError, match="nested deeper"):
            parse_urdf(deep)
        with pytest.raises(InputError, match="elements"):
            parse_urdf(b"<robot>" + b"<x/>" * 100_001 + b"</robot>")
        with pytest.raises(InputError, match="at most 16777216"):
            parse_urdf(b"<robot>" + b" " * (16 << 20) + b"</robot>")
        with pytest.raises(InputError, match="10001 links"):
            parse_urdf(robot(*(f'<link name="l{i}"/>' for i in range(10_001)), links=""))

    def test_a_chain_of_ten_thousand_links_is_walked(self) -> None:
        links = [f'<link name="l{i}"/>' for i in range(10_000)]
        joints = [joint(f"j{i}", f"l{i}", f"l{i + 1}", "fixed", inside="") for i in range(9_990)]
        with pytest.raises(InputError, match="no joint that moves"):
            parse_urdf(robot(*links, *joints, links=""), base="l0")
        backwards = robot(*links[::-1], *joints[::-1], joint("last", "l9990", "l9991"), links="")
        assert parse_urdf(backwards, base="l0").flange == "l9991"

    def test_unknown_ends_are_named(self) -> None:
        with pytest.raises(InputError, match="no link 'z'") as caught:
            parse_urdf(two_joints(), tip="z")
        assert "'a', 'b', 'c'" in str(caught.value.hint)
        with pytest.raises(InputError, match="'a' does not hang on link 'c'"):
            parse_urdf(two_joints(), base="c", tip="a")

    @settings(max_examples=200)
    @given(st.data())
    def test_mangled_descriptions_end_in_an_arm_or_an_error_of_ours(self, data: st.DataObject) -> None:
        document = bytearray(two_joints(origin='<origin xyz="0 0 1" rpy="0 1 0"/>'))
        for _ in range(data.draw(st.integers(1, 4))):
            at = data.draw(st.integers(0, len(document) - 1))
            end = data.draw(st.integers(at, min(at + 12, len(document))))
            document[at:end] = data.draw(
                st.binary(max_size=8) | st.sampled_from([b"nan", b"-1e9", b"<a>", b"&b;"])
            )
        try:
            arm = parse_urdf(bytes(document))
        except HandeyeError:
            return
        assert np.all(np.isfinite(arm.forward(np.zeros(len(arm)))))


def test_what_xacro_tells_in_comments_is_no_template() -> None:
    """It quotes the expressions that it was made from."""
    plain = two_joints()
    told = plain.replace(b"<link", b"<!-- limits: ${xacro.load_yaml('limits.yaml')} -->\n<link", 1)
    assert told != plain
    assert parse_urdf(told).joint_names == parse_urdf(plain).joint_names
