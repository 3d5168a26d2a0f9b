"""What is taken was made after it was asked for; what cannot be true is refused, and said."""

import threading
import time

import pytest

from handeye.errors import DeviceError
from handeye.ros import Stream
from handeye.ros.stamps import LATE_S

NOW_S = 1000.0


@pytest.fixture
def stream() -> Stream[str]:
    return Stream("/camera/image_raw", lambda: NOW_S, code="no_image")


def test_the_first_after_the_question_is_taken_not_the_latest(stream: Stream[str]) -> None:
    for stamp, value in ((999.8, "before"), (999.9, "first"), (1000.0, "latest")):
        stream.put(stamp, value)
    assert stream.after(999.85, 0.0).value == "first"
    assert stream.after(999.9, 0.0).value == "first"
    assert stream.at(999.8, 0.0).value == "before"
    first, second = stream.around(999.85, 0.0)
    assert (first.value, second.value) == ("before", "first")


def test_one_that_comes_later_is_waited_for(stream: Stream[str]) -> None:
    threading.Timer(0.1, stream.put, (999.99, "later")).start()
    assert stream.after(999.9, 5.0).value == "later"


def test_only_old_ones_are_not_enough(stream: Stream[str]) -> None:
    stream.put(999.5, "before")
    with pytest.raises(DeviceError, match=r"no message made after.*the newest is stamped 999\.500") as caught:
        stream.after(999.9, 0.05)
    assert caught.value.code == "no_image"
    with pytest.raises(DeviceError, match="none has come yet"):
        Stream[str]("/other", lambda: NOW_S).after(0.0, 0.01)


@pytest.mark.parametrize(
    ("stamp_s", "words"),
    [
        (0.0, "without a stamp"),
        (-1.0, "without a stamp"),
        (NOW_S + 0.2, "ahead of the clock"),
        (NOW_S - LATE_S - 0.5, "before it came"),
        (NOW_S - 0.4, "before the one that came before it"),
    ],
)
def test_stamps_that_cannot_be_true_are_refused(
    stream: Stream[str], stamp_s: float, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    stream.put(NOW_S - 0.3, "well")
    # It comes while somebody waits.
    monkeypatch.setattr(stream._news, "wait", lambda _: stream.put(stamp_s, "wrong"))
    with pytest.raises(DeviceError, match=words) as caught:
        stream.after(NOW_S - 0.2, 0.05)
    assert caught.value.code == "bad_stamp"
    assert "chrony" in str(caught.value.hint)
    stream.put(NOW_S - 0.1, "well again")
    assert stream.after(NOW_S - 0.2, 0.0).value == "well again"


def test_a_wrong_one_is_forgotten_once_it_is_well_again(stream: Stream[str]) -> None:
    stream.put(0.0, "wrong")
    with pytest.raises(DeviceError) as caught:
        stream.after(NOW_S, 0.0)
    assert caught.value.code == "no_image"


def test_it_keeps_few() -> None:
    stream: Stream[int] = Stream("/tf", lambda: 1000.0, keep=3)
    for number in range(10):
        stream.put(999.0 + number / 10, number)
    began = time.monotonic()
    with pytest.raises(DeviceError, match="nothing from before"):
        stream.around(999.2, 0.0)
    assert time.monotonic() - began < 5
