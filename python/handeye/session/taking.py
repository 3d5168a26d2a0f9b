"""Doing one step: attempt it, judge what it brought, write it down."""

import time
from dataclasses import replace
from functools import partial

from handeye.datasets.png_writing import png_bytes
from handeye.detection import Detection
from handeye.errors import HandeyeError, OutputError, printable
from handeye.estimation import Estimate, view_pose
from handeye.session.attempt import Cell, Missed, Seen, attempt
from handeye.session.deciding import Step
from handeye.session.entry import Entry, Failure
from handeye.session.judging import foreseen, labeled, objection, unchanged
from handeye.session.store import SessionStore
from handeye.types import Camera, View

_WRITE_PAUSE_S = 0.2


class Taker:
    """Takes steps in a cell, and writes each into a store."""

    def __init__(self, cell: Cell, store: SessionStore) -> None:
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
        digests = frozenset(e.image_digest for e in self._store.entries if e.image_digest is not None)
        foresee = partial(foreseen, self._camera(step.estimate), self._cell.target, step.estimate)
        outcome = attempt(self._cell, step.goal, digests, timings, foresee, step.estimate)
        if isinstance(outcome, Seen):
            outcome = self._judged(step, outcome)
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
        image = None
        if isinstance(outcome, Missed):
            entry = replace(
                entry,
                moved=outcome.moved,
                failure=outcome.failure,
                detail=printable(outcome.detail, 500),
                image_digest=outcome.digest,
                standing_rad=None if outcome.standing is None else outcome.standing.joints_rad,
            )
        else:
            view, seen = outcome
            standing = seen.reading.joints_rad
            entry = replace(
                entry, view=view, detail=seen.note, image_digest=seen.digest, standing_rad=standing
            )
            image = None if seen.image is None else png_bytes(seen.image)
        self._write(entry, image)
        return entry

    def _judged(self, step: Step, seen: Seen) -> tuple[View, Seen] | Missed:
        cell, estimate = self._cell, step.estimate
        name = step.goal.label.rpartition(".")[0]
        detection = seen.detection if seen.labels_known else self._labels(seen, estimate)
        image = None if seen.image is None else f"images/{name}.png"
        try:
            view = View(
                name,
                seen.reading.T_base_flange,
                detection.point_ids,
                detection.pixels,
                image,
                seen.timestamp_s,
                seen.reading.joints_rad,
                detection.sigmas_px,
            )
            self._store.recording.with_views((*self._store.recording.views, view))
        except HandeyeError as error:
            return Missed(
                Failure.BAD_IMAGE, error.message, moved=True, digest=seen.digest, standing=seen.reading
            )
        if unchanged(view, self._store.recording.views):
            why = "the target did not move in the picture, though the arm did"
            return Missed(Failure.STALE_IMAGE, why, moved=True, digest=seen.digest, standing=seen.reading)
        taken, learning = self._store.recording.views, self._store.self_calibration
        # A view that a young lens does not fit may be right, and the lens wrong: it is asked with the view.
        camera = cell.camera if learning is None else learning.camera((*taken, view))
        why = objection(camera, cell.target, view, estimate, len(taken))
        if why is not None:
            return Missed(Failure.INCONSISTENT, why, moved=True, digest=seen.digest, standing=seen.reading)
        return view, seen

    def _camera(self, estimate: Estimate | None) -> Camera:
        """Return the camera as it was given, or as the views teach it where none was."""
        if self._store.self_calibration is None or estimate is None:
            return self._cell.camera
        return estimate.camera

    def _labels(self, seen: Seen, estimate: Estimate | None) -> Detection:
        cell, camera = self._cell, self._camera(estimate)
        views = self._store.recording.views
        if estimate is not None:
            A = estimate.mounting.chain(seen.reading.T_base_flange)
            expected = estimate.X @ A @ estimate.Y
        elif views:
            # The first moves turn little: the board looks as it did at first.
            expected = view_pose(camera, cell.target, views[0]).T_camera_target
        else:
            return seen.detection
        return labeled(camera, cell.target, seen.detection, seen.reading.T_base_flange, expected)

    def _write(self, entry: Entry, image: bytes | None) -> None:
        """Write an attempt down; where the disk refuses, wait and ask again before giving up."""
        for pauses in (1, 2, 0):
            try:
                if len(self._store.entries) >= entry.number:  # written, but the recording lagged behind
                    return
                if image is not None and entry.view is not None:
                    self._store.keep_image(entry.view.name, image)
                self._store.append(entry)
                return
            except OutputError:
                if pauses == 0:
                    raise
                time.sleep(pauses * _WRITE_PAUSE_S)
