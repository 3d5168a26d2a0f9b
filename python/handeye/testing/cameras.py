"""What every camera's driver must do."""

from collections.abc import Callable

import numpy as np
import pytest

from handeye.cameras.protocol import ImageSource, checked_frame
from handeye.errors import DeviceError
from handeye.session.calls import Calls
from handeye.session.contract import SECONDS, check_camera, closed_twice

Cable = tuple[Callable[[], None], Callable[[], None]]


class CameraTests:
    """Subclass it and give the fixture `camera`; the other three where you can.

    camera
        The driver, connected.
    size_px
        Width and height of its pictures; None to leave that out.
    change
        A function that changes what the camera sees; None where that cannot be done.
    cable
        Two functions: one that cuts the connection at once, one that mends it; None where there is none.

    Examples
    --------
    >>> class TestMine(CameraTests):  # in a file of tests; pytest runs what it inherits
    ...     size_px = (1280, 1024)
    >>> hasattr(TestMine, "test_keeps_the_contract")
    True
    """

    @pytest.fixture
    def size_px(self) -> tuple[int, int] | None:
        """Not known."""
        return None

    @pytest.fixture
    def change(self) -> Callable[[], None] | None:
        """It sees what it sees."""
        return None

    @pytest.fixture
    def cable(self) -> Cable | None:
        """None."""
        return None

    def test_keeps_the_contract(self, camera: ImageSource, size_px: tuple[int, int] | None) -> None:
        """Grey pictures of its size, that stay as they were, from any thread."""
        assert check_camera(camera, size_px) == []

    def test_a_picture_is_of_now(self, camera: ImageSource, change: Callable[[], None] | None) -> None:
        """What waited in a queue since before the question is not given."""
        if change is None:
            pytest.skip("what it sees cannot be changed")
        for attempt in range(1, 4):
            before = checked_frame(camera.grab(f"view_01.{attempt}")).image
            change()
            after = checked_frame(camera.grab(f"view_02.{attempt}")).image
            assert before is not None
            assert after is not None
            assert not np.array_equal(before, after), "the picture is of before"

    def test_says_that_the_connection_is_lost(self, camera: ImageSource, cable: Cable | None) -> None:
        """An error in time, no old picture; once mended it works again."""
        if cable is None:
            pytest.skip("there is no cable to pull")
        cut, mend = cable
        calls = Calls("camera")
        checked_frame(calls.run(SECONDS, camera.grab, "view_01.1"))
        cut()
        with pytest.raises(DeviceError):
            calls.run(SECONDS, camera.grab, "view_02.1")
        mend()
        checked_frame(calls.run(SECONDS, camera.grab, "view_02.2"))

    def test_can_be_closed(self, camera: ImageSource) -> None:
        """Twice, where it has `close`."""
        assert closed_twice(camera) == []

    def test_can_be_closed_without_a_connection(self, camera: ImageSource, cable: Cable | None) -> None:
        """A session that ends by a lost connection closes its driver too."""
        if cable is None:
            pytest.skip("there is no cable to pull")
        cut, mend = cable
        cut()
        try:
            assert closed_twice(camera) == []
        finally:
            mend()
