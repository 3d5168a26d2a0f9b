"""Where the flange was at what time, and when it stood still."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.datasets.bags.contents import Poses, Stamps, matrices
from handeye.errors import InputError
from handeye.types.arrays import FloatArray

# An arm that stands still stays within these, for so long; noisier ones within a multiple.
STILL_M, STILL_RAD, STILL_S = 5e-4, np.deg2rad(0.05), 0.3
LOOSER = (1.0, 3.0, 10.0)
# Shorter than this stays a station whatever is cut off its ends, where the arm may still be coming to rest.
MARGIN_S = 0.1
# Two stations are two only if they are further apart.
APART_M, APART_RAD = 2e-3, np.deg2rad(0.2)
_BLOCK = 256


@dataclass(frozen=True, eq=False)
class Track:
    """Poses of the flange at rising times.

    Attributes
    ----------
    times_s
        (N,) seconds since the bag began.
    poses
        (N, 4, 4) `T_base_flange`.
    words
        Where they come from, for a person.
    joints
        (N, n) joint positions in the order of the arm; None if they are not known.
    """

    times_s: FloatArray
    poses: FloatArray
    words: str
    joints: FloatArray | None = None

    def at(self, times_s: FloatArray) -> FloatArray:
        """Return the poses (M, 4, 4) at times (M,), on a screw between the neighbours."""
        times = np.clip(times_s, self.times_s[0], self.times_s[-1])
        before = np.clip(np.searchsorted(self.times_s, times, side="right") - 1, 0, len(self.times_s) - 2)
        spans = self.times_s[before + 1] - self.times_s[before]
        share = (times - self.times_s[before]) / spans
        first, second = self.poses[before], self.poses[before + 1]
        return first @ _core.se3_exp(share[:, np.newaxis] * _core.se3_log(np.linalg.inv(first) @ second))

    def mean(self, start_s: float, end_s: float) -> tuple[FloatArray, FloatArray | None]:
        """Return the mean pose (4, 4) and joints (n,) of a time at which the arm stands still."""
        first, last = np.searchsorted(self.times_s, [start_s, end_s])
        if last <= first:
            nearest = int(np.argmin(np.abs(self.times_s - 0.5 * (start_s + end_s))))
            first, last = nearest, nearest + 1
        pose = np.eye(4)
        left, _, right = np.linalg.svd(self.poses[first:last, :3, :3].mean(axis=0))
        pose[:3, :3], pose[:3, 3] = left @ right, self.poses[first:last, :3, 3].mean(axis=0)
        return pose, None if self.joints is None else self.joints[first:last].mean(axis=0)

    def speeds(self, times_s: FloatArray) -> FloatArray:
        """Return how fast (M,) the flange moves at times (M,), in m/s, a radian counting as half a metre."""
        half = 0.02
        twists = _core.se3_log(np.linalg.inv(self.at(times_s - half)) @ self.at(times_s + half)) / (2 * half)
        turned = 0.5 * np.linalg.norm(twists[:, 3:], axis=1)
        return np.asarray(np.hypot(np.linalg.norm(twists[:, :3], axis=1), turned), dtype=np.float64)


@dataclass(frozen=True)
class Station:
    """A time, in seconds since the bag began, at which the arm stood still."""

    start_s: float
    end_s: float

    @property
    def middle_s(self) -> float:
        """The middle of it."""
        return 0.5 * (self.start_s + self.end_s)


def seconds(stamps: Stamps, origin_ns: int, *, received: bool) -> FloatArray:
    """Return times (N,) in seconds since an origin: those of the messages, or of when they were received."""
    values = np.array(stamps.received_ns if received else stamps.made_ns, dtype=np.int64)
    return np.asarray((values - origin_ns) * 1e-9, dtype=np.float64)


def rising(times_s: FloatArray, poses: FloatArray, words: str, joints: FloatArray | None = None) -> Track:
    """Return a track of poses in any order; those that are none, and a second one at one time, are left out.

    Raises
    ------
    InputError
        Fewer than two are left.
    """
    usable = np.isfinite(poses).all(axis=(1, 2)) & np.isfinite(times_s)
    order = np.flatnonzero(usable)[np.argsort(times_s[usable], kind="stable")]
    order = order[np.concatenate([[True], np.diff(times_s[order]) > 0])] if len(order) else order
    if len(order) < 2:
        raise InputError(f"{words}: fewer than two poses at different times", code=Code.NO_POSES)
    return Track(times_s[order], poses[order], words, None if joints is None else joints[order])


def chain(
    moving: Mapping[tuple[str, str], Poses],
    static: Mapping[tuple[str, str], tuple[float, ...]],
    base: str,
    flange: str,
    times_of: "TimesOf",
) -> Track:
    """Return the flange in the base by tf.

    Raises
    ------
    InputError
        tf does not connect the two, or nothing between them moves.
    """
    up, down = way(moving, static, base, flange)
    edges = [*((edge, True) for edge in reversed(up)), *((edge, False) for edge in down)]
    parts: list[tuple[Track | FloatArray, bool]] = []
    for edge, is_inverse in edges:
        if edge in static:
            parts.append((matrices([static[edge]])[0], is_inverse))
        else:
            poses = moving[edge]
            parts.append((rising(times_of(poses), matrices(poses.values), " -> ".join(edge)), is_inverse))
    tracks = [part for part, _ in parts if isinstance(part, Track)]
    words = f"tf, {flange} in {base}"
    if not tracks:
        raise InputError(f"{words}: nothing between them moves", code=Code.NO_POSES)
    start, end = max(t.times_s[0] for t in tracks), min(t.times_s[-1] for t in tracks)
    finest = max(tracks, key=lambda track: len(track.times_s)).times_s
    times = finest[(finest >= start) & (finest <= end)]
    total = np.broadcast_to(np.eye(4), (len(times), 4, 4))
    for part, is_inverse in parts:
        step = part.at(times) if isinstance(part, Track) else part
        total = total @ (np.linalg.inv(step) if is_inverse else step)
    return rising(times, total, words)


class TimesOf:
    """Which clock counts, and from when.

    Parameters
    ----------
    origin_ns
        Zero of the times.
    received
        Whether the times of reception count, not those in the messages.
    """

    def __init__(self, origin_ns: int, *, received: bool) -> None:
        self._origin_ns, self.received = origin_ns, received

    def __call__(self, stamps: Stamps) -> FloatArray:
        """Return the times (N,) in seconds."""
        return seconds(stamps, self._origin_ns, received=self.received)


def parents(edges: Sequence[tuple[str, str]]) -> dict[str, str]:
    """Return the parent of each frame; of two that are said, the last."""
    return {child: parent for parent, child in edges}


def way(
    moving: Mapping[tuple[str, str], object], static: Mapping[tuple[str, str], object], base: str, flange: str
) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """Return the edges from the base up to where both ways meet, and from there down to the flange.

    Raises
    ------
    InputError
        tf does not connect the two.
    """
    above = parents([*static, *moving])
    ways: list[list[str]] = []
    for frame in (base, flange):
        frames = [frame]
        while frames[-1] in above and above[frames[-1]] not in frames:
            frames.append(above[frames[-1]])
        ways.append(frames)
    met = next((frame for frame in ways[0] if frame in ways[1]), None)
    if met is None:
        known = ", ".join(sorted({name for edge in (*moving, *static) for name in edge})[:30])
        raise InputError(
            f"tf does not connect {base} with {flange}",
            code=Code.UNKNOWN_FRAME,
            hint=f"the frames are {known}; name two with --base-frame and --flange-frame",
        )
    first, second = (frames[: frames.index(met) + 1] for frames in ways)
    up = [(parent, child) for child, parent in itertools.pairwise(first)][::-1]
    down = [(parent, child) for child, parent in itertools.pairwise(second)][::-1]
    return up, down


def stations(track: Track) -> list[Station]:
    """Return when the arm stood still, in order; stations that are one and the same place count once.

    Where hardly any are found, the arm's poses are taken to be noisier.
    """
    found: list[Station] = []
    for looser in LOOSER:
        found = _distinct(track, _still(track, looser))
        if len(found) > 3:
            break
    return found


def _still(track: Track, looser: float) -> list[Station]:
    found: list[Station] = []
    at, count = 0, len(track.times_s)
    while at < count:
        end = at + 1
        while end < count:
            block = slice(end, min(end + _BLOCK, count))
            off_m, off_rad = _off(track.poses[block], track.poses[at])
            beyond = np.flatnonzero((off_m > looser * STILL_M) | (off_rad > looser * STILL_RAD))
            if len(beyond):
                end += int(beyond[0])
                break
            end = block.stop
        start_s, end_s = track.times_s[at], track.times_s[end - 1]
        if end_s - start_s >= STILL_S:
            margin = min(MARGIN_S, 0.2 * (end_s - start_s))
            found.append(Station(float(start_s + margin), float(end_s - margin)))
            at = end
        else:
            at += 1
    return found


def _distinct(track: Track, found: Sequence[Station]) -> list[Station]:
    kept: list[Station] = []
    last: FloatArray | None = None
    for station in found:
        pose, _ = track.mean(station.start_s, station.end_s)
        if last is not None:
            off_m, off_rad = _off(pose[np.newaxis], last)
            if off_m[0] < APART_M and off_rad[0] < APART_RAD:
                continue
        kept.append(station)
        last = pose
    return kept


def _off(poses: FloatArray, reference: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the distances (N,) and angles (N,) of poses (N, 4, 4) from one."""
    distances = np.linalg.norm(poses[:, :3, 3] - reference[:3, 3], axis=1)
    # Of small angles the cosine has lost its digits: the chord of the rotation is exact.
    chords = np.linalg.norm((poses[:, :3, :3] - reference[:3, :3]).reshape(-1, 9), axis=1) / np.sqrt(8)
    return np.asarray(distances, dtype=np.float64), 2 * np.arcsin(np.clip(chords, 0, 1))
