"""Names of frames: what no format could misread, and nothing else."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handeye.errors import InputError
from handeye.export import REP_103_OPTICAL, Frames
from handeye.export.frames import check_frame
from handeye.types import Mounting

HOSTILE = [
    "",
    " ",
    "tool0 ",
    "a b",
    "a\nb",
    "tool0\n",
    "a\rb",
    "a\tb",
    "a\x00b",
    'a"b',
    "a'b",
    "a`id`",
    "$(id)",
    "a;id",
    "a|b",
    "a&amp;b",
    "<b/>",
    "a-->",
    "a: b",
    "- a",
    "&anchor",
    "*alias",
    "!!python/object",
    "#a",
    "a\\",
    "-x",
    "--frame-id",
    "/tool0",
    "a//b",
    "a/",
    "a/../b",
    "0",
    "1e3",
    "ﬂange",
    "tool\u202e0",
    "ö",
    "x" * 101,
    "a,b",
    "[a]",
    "{a}",
    "%s",
    "{0}",
]


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_are_refused(name: str) -> None:
    with pytest.raises(InputError, match="parent frame"):
        check_frame(name, "parent frame")


@pytest.mark.parametrize(
    "name", ["tool0", "camera_link", "_x", "panda/link8", "oak-d-base-frame", "a.b", "no"]
)
def test_names_of_ros_are_accepted(name: str) -> None:
    assert check_frame(name, "frame") == name


@given(st.text(max_size=20))
def test_whatever_is_accepted_is_plain(name: str) -> None:
    try:
        check_frame(name, "frame")
    except InputError:
        return
    assert name.isascii()
    assert all(character.isalnum() or character in "_-./" for character in name)
    assert name[0].isalpha() or name[0] == "_"


def test_usual_names_are_those_that_controllers_report() -> None:
    in_hand, beside = Frames.usual(Mounting.EYE_IN_HAND), Frames.usual(Mounting.EYE_TO_HAND)
    assert (in_hand.parent, in_hand.robot) == ("tool0", "base")
    assert (beside.parent, beside.robot) == ("base", "tool0")


def test_every_name_is_checked() -> None:
    for field in ("parent", "camera", "robot", "target", "link"):
        with pytest.raises(InputError):
            Frames(**({"parent": "tool0"} | {field: 'a"b'}))


def test_two_frames_of_one_name_are_refused() -> None:
    with pytest.raises(InputError, match="already"):
        Frames(parent="base")
    with pytest.raises(InputError, match="already"):
        Frames(parent="tool0", camera="camera", link="camera")


def test_optical_frame_of_rep_103() -> None:
    # The optical axis looks along x of the link, its x to the right (-y), its y down (-z).
    right, down, forward = REP_103_OPTICAL.rotation.T
    assert right.tolist() == [0, -1, 0]
    assert down.tolist() == [0, 0, -1]
    assert forward.tolist() == [1, 0, 0]
    assert REP_103_OPTICAL.quaternion_xyzw.tolist() == [-0.5, 0.5, -0.5, 0.5]
