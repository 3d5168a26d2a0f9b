"""Frames of tf at one moment: between the two neighbours of each edge, never the latest."""

import threading
import time
from collections.abc import Callable

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import DeviceError
from handeye.ros.stamps import Stream
from handeye.types import Pose

# A tree that is deeper, or that has more frames, is no robot's.
MOST_FRAMES = 2000


class Transforms:
    """What tf has said, moving and static.

    Parameters
    ----------
    now_s
        The clock that stamps are compared with, in seconds.
    """

    def __init__(self, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self._above: dict[str, str] = {}
        self._static: dict[str, Pose] = {}
        self._moving: dict[str, Stream[Pose]] = {}
        self._news = threading.Condition()

    def put(self, parent: str, child: str, stamp_s: float, pose: Pose, *, static: bool) -> None:
        """Take a transform `T_parent_child` that has just come."""
        with self._news:
            if child not in self._above and len(self._above) >= MOST_FRAMES:
                return
            self._above[child] = parent
            if static:
                self._static[child] = pose
            elif child not in self._moving:
                self._moving[child] = Stream(f"tf {parent} -> {child}", self._now_s)
            self._news.notify_all()
        if not static:
            self._moving[child].put(stamp_s, pose)

    def at(self, base: str, tip: str, stamp_s: float, timeout_s: float) -> Pose:
        """Return `T_base_tip` at a time.

        Raises
        ------
        DeviceError
            tf does not connect the two, or does not say where one of them was then.
        """
        up, down = self._way(base, tip, timeout_s)
        T_base_tip = Pose.identity()
        for child in up:
            T_base_tip = T_base_tip @ self._edge(child, stamp_s, timeout_s).inverse()
        for child in down:
            T_base_tip = T_base_tip @ self._edge(child, stamp_s, timeout_s)
        return T_base_tip

    def _edge(self, child: str, stamp_s: float, timeout_s: float) -> Pose:
        if child in self._static:
            return self._static[child]
        first, second = self._moving[child].around(stamp_s, timeout_s)
        span_s = second.stamp_s - first.stamp_s
        if span_s <= 0:
            return second.value
        share = (stamp_s - first.stamp_s) / span_s
        step = (first.value.inverse() @ second.value).log()
        return first.value @ Pose(_core.se3_exp((share * step)[np.newaxis])[0])

    def _way(self, base: str, tip: str, timeout_s: float) -> tuple[list[str], list[str]]:
        """Return the frames from the base up to where both ways meet, and from there down to the tip."""
        end = time.monotonic() + timeout_s
        with self._news:
            while True:
                ways = [self._to_root(frame) for frame in (base, tip)]
                met = next((frame for frame in ways[0] if frame in ways[1]), None)
                if met is not None:
                    break
                left_s = end - time.monotonic()
                if left_s <= 0:
                    known = ", ".join(sorted({*self._above, *self._above.values()})[:30]) or "none"
                    raise DeviceError(
                        f"tf does not connect {base} with {tip}; the frames are {known}",
                        code=Code.UNKNOWN_FRAME,
                        hint="name two of them: ros2:ACTION,base=FRAME,flange=FRAME",
                    )
                self._news.wait(left_s)
            up, down = (way[: way.index(met)] for way in ways)
        return up, down[::-1]

    def _to_root(self, frame: str) -> list[str]:
        way = [frame]
        while way[-1] in self._above and self._above[way[-1]] not in way:
            way.append(self._above[way[-1]])
        return way
