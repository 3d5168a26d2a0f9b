"""KinHEC's tracks through its own benchmark: its reference solvers, and ours as one more row.

KinHEC (Aiersilan; PyPI `kinhec`, MIT) holds tracks of poses with truth. Its benchmark pairs the streams,
picks key frames and measures; here `benchmark.SOLVERS` is given ours, which sees the same poses and nothing
else, and states a region beside its answer.
"""

import importlib
import importlib.metadata
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.compute.parallel import Progress
from handeye.datasets import PosePair, PosePairs
from handeye.datasets.bags.tracks import Track
from handeye.datasets.pose_pairs import PoseStreams
from handeye.errors import InputError
from handeye.importing.poses_alone import PosesSolved, solve_poses
from handeye.importing.streams import clock_lag
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray
from handeye.types.pose import inverses
from handeye.validation import metrics

OURS = "handeye"
TRACKS = ("pnp", "robot_error", "temporal")


@dataclass(frozen=True)
class Clock:
    """Errors of the offset between the clocks of a sequence: ours, and that of KinHEC's own estimate."""

    ours_ms: float
    theirs_ms: float


@dataclass(frozen=True)
class Kinhec:
    """Errors of every solver on every sequence of the tracks, and how often our region held the truth."""

    version: str
    rows: tuple[dict[str, Any], ...]
    regions: dict[str, tuple[bool, ...]]
    clocks: dict[str, tuple["Clock", ...]]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        tracks = dict.fromkeys(row["track"] for row in self.rows)
        return {"version": self.version, "tracks": {track: self._track(track) for track in tracks}}

    def _track(self, track: str) -> dict[str, Any]:
        rows = [row for row in self.rows if row["track"] == track]
        solvers = dict.fromkeys(row["solver"] for row in rows)
        held, clocks = self.regions.get(track, ()), self.clocks.get(track, ())
        return {
            "sequences": len({row["sequence_id"] for row in rows}),
            "region_holds": float(np.mean(held)) if held else None,
            "clock_error_ms": None if not clocks else float(np.median([one.ours_ms for one in clocks])),
            "their_clock_error_ms": None
            if not clocks
            else float(np.median([one.theirs_ms for one in clocks])),
            "solvers": {name: _summary([row for row in rows if row["solver"] == name]) for name in solvers},
        }


def _summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    answered = [row for row in rows if row["ok"]]
    mm = [row["X_trans_err_mm"] for row in answered]
    deg = [row["X_rot_err_deg"] for row in answered]
    return {
        "translation_mm": float(np.median(mm)) if answered else None,
        "rotation_deg": float(np.median(deg)) if answered else None,
        "answered": len(answered),
    }


@dataclass
class _Ours:
    """Our solver in the shape of KinHEC's; keeps whether the stated region held the truth."""

    mounting: Mounting = Mounting.EYE_IN_HAND
    X_true: Pose | None = None
    held: list[bool] = field(default_factory=list[bool])

    def __call__(self, data: tuple[FloatArray, ...], random: np.random.Generator) -> dict[str, FloatArray]:
        del random
        flange, other = data[:2]
        seen = inverses(other) if self.mounting is Mounting.EYE_IN_HAND else other
        found = solve_poses(pose_pairs(self.mounting, flange, seen))
        camera, target = found.X.inverse(), found.Y
        if self.X_true is not None:
            self.held.append(holds(found, self.X_true))
        in_hand = self.mounting is Mounting.EYE_IN_HAND
        # A X = Y B: X is what the flange carries, Y what stands in the base.
        return {"X": (camera if in_hand else target).matrix, "Y": (target if in_hand else camera).matrix}


def pose_pairs(mounting: Mounting, flange: FloatArray, seen: FloatArray) -> PosePairs:
    """Return stations from `T_base_flange` and `T_camera_target` (K, 4, 4)."""
    pairs = tuple(
        PosePair(f"frame_{k:03d}", Pose(hand), Pose(eye))
        for k, (hand, eye) in enumerate(zip(flange, seen, strict=True))
    )
    return PosePairs("kinhec", "kinhec", mounting, pairs, "KinHEC")


def streams_of(sequence: Any) -> PoseStreams:  # noqa: ANN401 - a class of KinHEC's
    """Return the two streams of a sequence, each with its own clock; frames without the target left out."""
    camera, robot = sequence.camera, sequence.robot
    seen = np.isfinite(camera.T_cam_target_meas).all(axis=(1, 2))
    mounting = Mounting.EYE_IN_HAND if sequence.eye_in_hand else Mounting.EYE_TO_HAND
    return PoseStreams(
        "kinhec",
        "kinhec",
        "KinHEC",
        mounting,
        Track(robot.t, robot.T_base_ee_meas, "robot"),
        Track(camera.t[seen], camera.T_cam_target_meas[seen], "camera"),
    )


def holds(found: PosesSolved, X_true: Pose) -> bool:
    """Tell whether the 95 % region of X holds the truth."""
    squared = metrics.nees(found.X, found.covariance, X_true)
    return metrics.region_holds(squared, found.degrees_of_freedom)


def study_kinhec(
    root: Path,
    *,
    tracks: Sequence[str] = TRACKS,
    most: int | None = None,
    progress: Progress | None = None,
) -> Kinhec:
    """Run KinHEC's benchmark with all its solvers and ours.

    Parameters
    ----------
    root
        A data set as `kinhec generate` writes it or as it is published.
    tracks
        Its tracks.
    most
        Most sequences of each track; None for all.

    Raises
    ------
    InputError
        The package `kinhec` is not installed, or the folder is none of its.
    """
    try:
        io = importlib.import_module("kinhec.io")
        benchmark = importlib.import_module("kinhec.benchmark")
    except ImportError as error:
        raise InputError(
            "the package kinhec is not installed",
            code=Code.MISSING_PACKAGE,
            hint="pip install 'handeye[public]', then: kinhec generate --tier small --out FOLDER",
        ) from error
    if not (root / "sequences.parquet").is_file():
        raise InputError(
            f"{root}: no sequences.parquet",
            code=Code.NOT_FOUND,
            hint="kinhec generate --tier small --out FOLDER writes a data set",
        )
    manifest = io.load_manifest(root, list(tracks))
    listed = [row.to_dict() for _, row in manifest.iterrows()]
    chosen = [row for track in tracks for row in [row for row in listed if row["track"] == track][:most]]
    ours = _Ours()
    solvers = [name for name in benchmark.SOLVERS if name != OURS]
    benchmark.SOLVERS[OURS] = ours
    rows: list[dict[str, Any]] = []
    regions: dict[str, tuple[bool, ...]] = {}
    clocks: dict[str, tuple[Clock, ...]] = {}
    try:
        for number, row in enumerate(chosen):
            sequence = io._load_from_row(root, row)  # noqa: SLF001 - its benchmark has no other way in
            ours.mounting = Mounting.EYE_IN_HAND if sequence.eye_in_hand else Mounting.EYE_TO_HAND
            carried, standing = Pose(sequence.X), Pose(sequence.Y)
            ours.X_true = (carried if sequence.eye_in_hand else standing).inverse()
            ours.held = []
            random = np.random.default_rng(number)
            rows += benchmark.evaluate_sequence(sequence, [*solvers, OURS], rng=random)
            track = str(row["track"])
            if not sequence.synchronous:
                (own,) = benchmark.evaluate_sequence(sequence, solvers[:1], sync="estimated", rng=random)
                ours_ms = 1e3 * abs(clock_lag(streams_of(sequence)) - sequence.time_offset)
                clocks[track] = (*clocks.get(track, ()), Clock(ours_ms, own["time_offset_err_ms"]))
            regions[track] = (*regions.get(track, ()), *ours.held)
            if progress is not None:
                progress(number + 1, len(chosen))
    finally:
        del benchmark.SOLVERS[OURS]
    return Kinhec(importlib.metadata.version("kinhec"), tuple(rows), regions, clocks)
