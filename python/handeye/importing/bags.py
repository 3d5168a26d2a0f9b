"""From a bag to a recording: pictures of where the arm stood still, and their lag behind the poses."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from handeye.codes import Code
from handeye.datasets import ImageSet, Shot
from handeye.datasets.bags import Contents, Station, Track, fetch_pictures, grey_of, stations
from handeye.datasets.bags.messages import Compressed, Raw
from handeye.detection import Detection, Image, detect_all
from handeye.errors import HandeyeError, InputError
from handeye.estimation import solve
from handeye.importing.bag_choice import BagOptions, Chosen, choose
from handeye.importing.lag import Lag, estimate_lag
from handeye.robots import Arm
from handeye.types import Mounting, Pose, Recording, Target
from handeye.types.arrays import FloatArray

LAYOUT = "bag"
MOST_STATIONS, MOST_MOVING = 120, 40
# On the move are pictures at which the arm is at least this share of its usual speed fast.
MOVING_SHARE = 0.4
LEAST_SPEED_M_S = 5e-3
# Where poses are further apart in time, each stands for a station of its own.
SPARSE_S = 0.5


@dataclass(frozen=True)
class Timing:
    """When the pictures of a bag were taken, and how their clock runs beside that of the robot.

    Attributes
    ----------
    stations
        How many times the arm stood still before a picture.
    lag
        How much later the pictures are stamped than the robot's poses; None where nothing tells.
    """

    stations: int
    lag: Lag | None

    def to_dict(self) -> dict[str, float | int | None]:
        """Return plain values for JSON."""
        lag = self.lag
        return {
            "stations": self.stations,
            "lag_ms": None if lag is None else 1e3 * lag.seconds,
            "sigma_ms": None if lag is None else 1e3 * lag.sigma_s,
            "moving_pictures": 0 if lag is None else lag.pictures,
        }

    def __str__(self) -> str:
        stood = f"the arm stood still {self.stations} times"
        if self.lag is None:
            return f"{stood}; too few pictures on the move to tell the lag between pictures and poses"
        lag = 1e3 * self.lag.seconds
        order = "later" if lag >= 0 else "earlier"
        return (
            f"{stood}; pictures are stamped {abs(lag):.1f} ms {order} than poses, standard deviation "
            f"{1e3 * self.lag.sigma_s:.1f} ms ({self.lag.pictures} pictures on the move)"
        )


@dataclass(eq=False)
class BagPictures:
    """The pictures of a bag that count; `images` are those of where the arm stood still.

    Parameters
    ----------
    contents
        What is in the bag.
    chosen
        What of it counts.
    target
        The target.
    mounting
        Where the camera sits.
    """

    contents: Contents
    chosen: Chosen
    target: Target
    mounting: Mounting
    lag_s: float = 0.0
    _stood: list[Station] = field(default_factory=list[Station], init=False)
    _pictures: dict[int, Raw | Compressed] = field(default_factory=dict[int, Raw | Compressed], init=False)

    def images(self) -> ImageSet:
        """Return the pictures of where the arm stood still.

        Raises
        ------
        InputError
            The arm never stood still, or without a picture.
        """
        track, times = self.chosen.track, self.chosen.times_s - self.lag_s
        self._stood = stations(track) or _sparse(track)
        picked: dict[int, Station] = {}
        for station in self._stood:
            near = int(np.argmin(np.abs(times - station.middle_s)))
            if station.start_s <= times[near] <= station.end_s:
                picked.setdefault(near, station)
        if not picked:
            raise InputError(
                f"{self.contents.path}: the arm stood still {len(self._stood)} times, never while a picture "
                "was taken",
                code=Code.NO_STATIONS,
                hint="let the arm stand for half a second before it moves on; docs/commands/import.md",
            )
        places = _some(sorted(picked), MOST_STATIONS)
        # A bag is long: what is looked at later comes with it, in one reading.
        self._fetch([*places, *self._moving()])
        shots: list[Shot] = []
        width = max(2, len(str(len(places))))
        for number, place in enumerate(places, start=1):
            pose, joints = track.mean(picked[place].start_s, picked[place].end_s)
            # Without times: the arm stood still, and how fast it moved between two stations says nothing.
            known = None if joints is None else tuple(joints.tolist())
            shots.append(Shot(f"station_{number:0{width}d}", None, Pose(pose), known))
        path = self.contents.path
        return ImageSet(
            name=path.stem,
            layout=LAYOUT,
            folder=path.parent,
            mounting=self.mounting,
            target=self.target,
            shots=tuple(shots),
            camera=self.chosen.camera,
            source=f"bag {path.name}, pictures on {self.chosen.image_topic}",
            warnings=self.chosen.warnings,
            pictures={shot.name: self._read(place) for shot, place in zip(shots, places, strict=True)},
        )

    def timing(self, recording: Recording) -> Timing:
        """Return how the clock of the pictures runs, by the calibration that the recording gives."""
        lag = None
        moving = self._moving()
        if moving and len(recording) >= 3:
            try:
                calibration = solve(recording, reduced=True)
            except HandeyeError:
                return Timing(len(self._stood), None)
            found = self._found(moving)
            times = {str(place): float(self.chosen.times_s[place]) for place in moving}
            lag = estimate_lag(calibration, self.target, self.chosen.track, times, found)
        return Timing(len(self._stood), lag)

    def shift(self, lag: Lag) -> None:
        """Let a lag count when the pictures are chosen at which the arm stood still."""
        self.lag_s = lag.seconds

    def misses_stations(self, lag: Lag | None) -> bool:
        """Tell whether a lag puts pictures beside the time at which the arm stood still."""
        shortest = min((s.end_s - s.start_s for s in self._stood), default=np.inf)
        return lag is not None and self.lag_s == 0 and abs(lag.seconds) > 0.25 * shortest

    def _moving(self) -> list[int]:
        """Return places of pictures taken on the move, spread over the bag."""
        times, track = self.chosen.times_s, self.chosen.track
        inside = np.flatnonzero((times > track.times_s[0]) & (times < track.times_s[-1]))
        if not len(inside):
            return []
        speeds = track.speeds(times[inside])
        fast = speeds[speeds > LEAST_SPEED_M_S]
        if not len(fast):
            return []
        usual = float(np.median(fast))
        return _some(
            [int(k) for k in inside[speeds > max(MOVING_SHARE * usual, LEAST_SPEED_M_S)]], MOST_MOVING
        )

    def _found(self, places: Sequence[int]) -> Mapping[str, Detection]:
        return detect_all([(str(place), self._read(place)) for place in places], self.target).found

    def _fetch(self, places: Sequence[int]) -> None:
        missing = set(places) - self._pictures.keys()
        if missing:
            self._pictures |= fetch_pictures(self.contents.path, self.chosen.image_topic, missing)

    def _read(self, place: int) -> Callable[[], Image]:
        where = f"{self.contents.path}: picture {place} on {self.chosen.image_topic}"
        return partial(grey_of, self._pictures[place], where)


def pictures_of(
    contents: Contents, options: BagOptions, arm: Arm | None, target: Target, mounting: Mounting
) -> BagPictures:
    """Return the pictures of a bag that count.

    Raises
    ------
    InputError
        As `choose`.
    """
    chosen = choose(contents, options, arm)
    if np.any(np.diff(chosen.track.times_s) < 0):
        raise InputError(f"{contents.path}: times that run backwards", code=Code.DAMAGED_BAG)
    return BagPictures(contents, chosen, target, mounting)


def _sparse(track: Track) -> list[Station]:
    """Return a station around each pose where poses were only taken at stations."""
    gaps = np.diff(track.times_s)
    if float(np.median(gaps)) < SPARSE_S:
        return []
    around = (
        np.concatenate([gaps[:1], np.minimum(gaps[:-1], gaps[1:]), gaps[-1:]])
        if len(gaps) > 1
        else gaps.repeat(2)
    )
    reach: FloatArray = np.minimum(0.45 * around, SPARSE_S)
    return [Station(float(t - r), float(t + r)) for t, r in zip(track.times_s, reach, strict=True)]


def _some(places: Sequence[int], most: int) -> list[int]:
    """Return at most so many, spread evenly."""
    if len(places) <= most:
        return list(places)
    return [places[k] for k in np.linspace(0, len(places) - 1, most).round().astype(int)]
