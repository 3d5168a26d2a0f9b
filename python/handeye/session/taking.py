"""Doing one step: attempt it, judge what it brought, write it down."""

import time
from dataclasses import dataclass, replace

from handeye.datasets.png_writing import png_bytes
from handeye.detection import Detection
from handeye.errors import HandeyeError, OutputError, printable
from handeye.estimation import Estimate, view_pose
from handeye.session.attempt import Arrived, Cell, Eye, Missed, Seen, arrive, look
from handeye.session.deciding import Step
from handeye.session.entry import Entry, Failure
from handeye.session.judging import foreseen, labeled, objection, unchanged
from handeye.session.store import Store
from handeye.types import Camera, CameraView, Pose, Station, View

_WRITE_PAUSE_S = 0.2


@dataclass(frozen=True, eq=False)
class Taken:
    """A view that counts: through which eye, and what it was made of."""

    eye: Eye
    view: View
    seen: Seen


class Taker:
    """Takes steps in a cell, and writes each into a store."""

    def __init__(self, cell: Cell, store: Store) -> None:
        self._cell = cell
        self._store = store

    def take(self, step: Step) -> Entry:
        """Attempt a step; on return what came of it is on the disk.

        Raises
        ------
        OutputError
            The disk does not take it, also not when asked again.
        """
        timings = {"decide": step.seconds}
        arrived = arrive(self._cell, step.goal, step.believed or step.estimate, timings)
        taken: list[Taken] = []
        missed: list[tuple[Eye, Missed]] = []
        if isinstance(arrived, Arrived):
            for eye in self._cell.eyes:
                one = self._looked(step, eye, arrived, timings)
                if isinstance(one, Taken):
                    taken.append(one)
                else:
                    missed.append((eye, one))
        entry = Entry(
            len(self._store.entries) + 1,
            step.goal.label,
            step.phase,
            step.goal.T_base_flange,
            step.goal.joints_rad or (),
            moved=True,
            decision=step.decision,
            timings_s=timings,
        )
        if isinstance(arrived, Missed):
            entry = _failed(entry, arrived, arrived.detail)
        elif not taken:
            # What may be different the next time tells more than that a target is not there.
            worst = next((one for _, one in missed if one.failure is not Failure.NOT_FOUND), missed[0][1])
            entry = _failed(replace(entry, standing_rad=arrived.reading.joints_rad), worst, self._why(missed))
        else:
            spoilt = [(eye, one) for eye, one in missed if one.failure is not Failure.NOT_FOUND]
            notes = [note for note in (arrived.note, self._why(spoilt)) if note]
            entry = replace(
                entry,
                detail=printable("; ".join(notes), 500),
                standing_rad=arrived.reading.joints_rad,
                **self._brought(taken),
            )
        digests = [one.seen.digest for one in taken] + [m.digest for _, m in missed if m.digest is not None]
        images = {
            image_name(one.eye, one.view, several=bool(self._cell.several)): png_bytes(one.seen.image)
            for one in taken
            if one.seen.image is not None
        }
        self._write(replace(entry, digests=tuple(digests)), images)
        return entry

    def _brought(self, taken: list[Taken]) -> dict[str, View | Station]:
        if not self._cell.several:
            return {"view": taken[0].view}
        return {"station": Station(tuple(CameraView(*one.eye.name, one.view) for one in taken))}

    def _why(self, missed: list[tuple[Eye, Missed]]) -> str:
        if not self._cell.several:
            return missed[0][1].detail if missed else ""
        return "; ".join(f"{' '.join(eye.name)}: {one.detail}" for eye, one in missed)

    def _looked(self, step: Step, eye: Eye, arrived: Arrived, timings: dict[str, float]) -> Taken | Missed:
        """See and judge what one eye sees."""
        estimate = step.estimate if step.believed is None else step.believed.of_pair(*eye.name)
        # Where the arm does not move the two against each other, its pose says nothing of them.
        T_base = arrived.reading.T_base_flange if eye.moves else Pose.identity()
        digests = frozenset(digest for entry in self._store.entries for digest in entry.digests)
        predicted = foreseen(self._camera(eye, estimate), eye.target, estimate, T_base)
        seen = look(self._cell, eye, step.goal.label, digests, timings, predicted)
        return seen if isinstance(seen, Missed) else self._judged(step, eye, arrived, seen, estimate)

    def _judged(
        self, step: Step, eye: Eye, arrived: Arrived, seen: Seen, estimate: Estimate | None
    ) -> Taken | Missed:
        reading, taken = arrived.reading, self._store.views_through(*eye.name)
        name = step.goal.label.rpartition(".")[0]
        T_base = reading.T_base_flange if eye.moves else Pose.identity()
        known = seen.labels_known
        detection = seen.detection if known else self._labels(eye, seen, T_base, taken, estimate)
        try:
            view = View(
                name,
                reading.T_base_flange,
                detection.point_ids,
                detection.pixels,
                None,
                # The views of a station are of one time, which cameras without a common clock do not tell.
                None if self._cell.several else seen.timestamp_s,
                reading.joints_rad,
                detection.sigmas_px,
            )
            if seen.image is not None:
                several = bool(self._cell.several)
                view = replace(view, image=f"images/{image_name(eye, view, several=several)}.png")
            self._store.check(eye.name, view)
        except HandeyeError as error:
            return Missed(Failure.BAD_IMAGE, error.message, moved=True, digest=seen.digest)
        if eye.moves and unchanged(view, taken):
            why = "the target did not move in the picture, though the arm did"
            return Missed(Failure.STALE_IMAGE, why, moved=True, digest=seen.digest)
        learning = self._store.self_calibration
        # A view that a young lens does not fit may be right, and the lens wrong: it is asked with the view.
        camera = eye.camera if learning is None else learning.camera((*taken, view))
        judged = view if eye.moves else replace(view, T_base_flange=T_base)
        why = objection(camera, eye.target, judged, estimate, len(taken))
        if why is not None:
            return Missed(Failure.INCONSISTENT, why, moved=True, digest=seen.digest)
        return Taken(eye, view, seen)

    def _camera(self, eye: Eye, estimate: Estimate | None) -> Camera:
        """Return the camera as it was given, or as the views teach it where none was."""
        if self._store.self_calibration is None or estimate is None:
            return eye.camera
        return estimate.camera

    def _labels(
        self, eye: Eye, seen: Seen, T_base: Pose, taken: list[View], estimate: Estimate | None
    ) -> Detection:
        camera = self._camera(eye, estimate)
        if estimate is not None:
            expected = estimate.X @ estimate.mounting.chain(T_base) @ estimate.Y
        elif taken:
            # The first moves turn little: the board looks as it did at first.
            expected = view_pose(camera, eye.target, taken[0]).T_camera_target
        else:
            return seen.detection
        return labeled(camera, eye.target, seen.detection, T_base, expected)

    def _write(self, entry: Entry, images: dict[str, bytes]) -> None:
        """Write an attempt down; where the disk refuses, wait and ask again before giving up."""
        for pauses in (1, 2, 0):
            try:
                if len(self._store.entries) >= entry.number:  # written, but the recording lagged behind
                    return
                for name, image in images.items():
                    self._store.keep_image(name, image)
                self._store.append(entry)
                return
            except OutputError:
                if pauses == 0:
                    raise
                time.sleep(pauses * _WRITE_PAUSE_S)


def image_name(eye: Eye, view: View, *, several: bool) -> str:
    """Return the name of the picture of a view, without its ending."""
    return ".".join((view.name, *eye.name)) if several else view.name


def _failed(entry: Entry, missed: Missed, detail: str) -> Entry:
    standing = entry.standing_rad if missed.standing is None else missed.standing.joints_rad
    return replace(
        entry,
        moved=missed.moved,
        failure=missed.failure,
        detail=printable(detail, 500),
        standing_rad=standing,
    )
