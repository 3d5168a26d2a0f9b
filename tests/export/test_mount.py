"""The transform to export, with and without a link of the camera's driver."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from answers import COVARIANCE, GENERIC, answer
from handeye.export import REP_103_OPTICAL, Frames, Mount
from handeye.export.mount import MAX_REMARK_LENGTH, one_line
from handeye.types import Pose
from strategies import poses, twists

LINKED = Frames("tool0", camera="optical", link="camera_link")


def test_optical_frame_is_exported_as_it_is() -> None:
    mount = Mount(answer(), Frames("tool0", camera="optical"))
    assert (mount.parent, mount.child) == ("tool0", "optical")
    assert mount.T_parent_child == GENERIC
    assert any("one parent" in remark for remark in mount.remarks)
    assert not mount.warnings


def test_link_is_where_its_optical_frame_is_right() -> None:
    mount = Mount(answer(), LINKED)
    assert mount.child == "camera_link"
    again = mount.T_parent_child @ REP_103_OPTICAL
    np.testing.assert_allclose(again.matrix, GENERIC.matrix, atol=1e-15)
    # The usual static transform of drivers, by its angles.
    usual = Rotation.from_euler("xyz", [-np.pi / 2, 0, -np.pi / 2]).as_matrix()
    np.testing.assert_allclose(REP_103_OPTICAL.rotation, usual, atol=1e-15)


def test_assumed_link_is_a_warning_and_a_given_one_is_not() -> None:
    (warning,) = Mount(answer(), LINKED).warnings
    assert "tf2_echo camera_link optical" in warning
    given_link = Frames("tool0", camera="optical", link="camera_link", T_link_camera=REP_103_OPTICAL)
    assert not Mount(answer(), given_link).warnings


@given(poses(), poses(metres=0.1), twists(metres=1e-6, angle_rad=1e-6))
def test_covariance_of_the_link_is_that_of_its_twist(camera: Pose, in_link: Pose, small: np.ndarray) -> None:
    frames = Frames("tool0", camera="optical", link="camera_link", T_link_camera=in_link)
    here = Mount(answer(camera), frames).T_parent_child
    moved = Mount(answer(camera @ Pose.exp(small)), frames).T_parent_child
    # A twist of the camera in its own frame is this twist of the link in its own.
    np.testing.assert_allclose((here.inverse() @ moved).log(), in_link.adjoint() @ small, atol=1e-11)
    expected = in_link.adjoint() @ COVARIANCE @ in_link.adjoint().T
    np.testing.assert_allclose(Mount(answer(camera), frames).covariance, expected)


@given(st.text())
def test_remarks_are_lines_of_printable_text(text: str) -> None:
    mount = Mount(answer(recording=text, warnings=(text,)), LINKED)
    for remark in mount.remarks:
        assert remark.isprintable()
        assert len(remark) <= MAX_REMARK_LENGTH
    assert one_line("a\n b\x00\u202e") == "a b??"
