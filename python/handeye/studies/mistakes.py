"""Are mistakes found and named, and does a repair bring back the answer? One planted mistake each, and none.

A mistake is named right if the first finding has its code and, where it concerns single views, exactly these
views; a mirror image in pictures or poses also where it names both, as no view tells them apart. An answer
is wrong if the region stated at 95 % misses the truth, though that of the same recording without the mistake
holds it. A repair brings the answer back if it moves the camera's centre by less than the stated radius of
the clean answer; where the views that are left determine none, mistake or not, it is not counted. The truth
of a set without any is the answer of all its views, as certain as that is. Sets are taken both ways round:
with every pose inverted the other mounting has made the same views.
"""

import zlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import DegenerateError, HandeyeError, InputError
from handeye.estimation import calibrate_examined, solve
from handeye.estimation.confidence import within
from handeye.estimation.faults import CODES, Diagnosis, diagnose
from handeye.studies.planted import EXPECTED, Mistake, can_be_planted, made_up, plant
from handeye.types import Mounting, Pose, Recording, Truth
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Calibration, ModelName
from handeye.types.units import MM_PER_M
from handeye.validation import metrics

RUNS_PER_PIECE = 4
# Views of a set that a run draws, again where they leave a direction open.
FEWEST, MOST = 8, 20
MOST_DRAWS = 20
# Metres, pixels and elements of rotations that differ by less are rounded.
SAME = 1e-9


@dataclass(frozen=True)
class Run:
    """One recording with a mistake, or none.

    `said` is the code of the first finding, empty where there is none. `restored` is None where the mistake
    is of a kind that nobody can put right. Errors are NaN where the recording was refused.
    """

    number: int
    recording: str
    said: str
    named: bool
    answered: bool
    wrong: bool
    restored: bool | None
    translation_mm: float
    clean_translation_mm: float


@dataclass(frozen=True)
class Mistakes:
    """All recordings per planted mistake, and those with none."""

    model: ModelName
    seed: int
    recordings: tuple[str, ...]
    kinds: dict[Mistake, tuple[Run, ...]]
    clean: tuple[Run, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        planted = [run for runs in self.kinds.values() for run in runs]
        return {
            "study": "mistakes",
            "model": self.model.value,
            "seed": self.seed,
            "recordings": list(self.recordings),
            "kinds": {kind.value: _kind(runs) for kind, runs in self.kinds.items() if runs},
            "planted": _kind(planted),
            "missed": [
                {"kind": kind.value, "trial": run.number, "recording": run.recording, "said": run.said}
                for kind, runs in self.kinds.items()
                for run in runs
                if not run.named or run.wrong or run.restored is False
            ],
            "clean": {
                "trials": len(self.clean),
                "false_alarms": float(np.mean([not run.named for run in self.clean])),
                "said": sorted({run.said for run in self.clean if not run.named}),
            },
        }


def _kind(runs: Sequence[Run]) -> dict[str, Any]:
    answered = [run for run in runs if run.answered]
    repaired = [run.restored for run in runs if run.restored is not None]
    error = float(np.mean([run.translation_mm for run in answered])) if answered else None
    clean = float(np.mean([run.clean_translation_mm for run in answered])) if answered else None
    return {
        "trials": len(runs),
        "named": float(np.mean([run.named for run in runs])),
        "answered": len(answered) / len(runs),
        "wrong_answers": sum(run.wrong for run in runs),
        "repaired": float(np.mean(repaired)) if repaired else None,
        "translation_mm": error,
        "clean_translation_mm": clean,
    }


def study_mistakes(
    sets: Sequence[Recording] = (),
    *,
    kinds: Sequence[Mistake] = tuple(Mistake),
    model: ModelName = ModelName.AUTO,
    trials: int = 50,
    seed: int = 0,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> Mistakes:
    """Plant each mistake in `trials` recordings, and none in `trials` for each kind of mistake.

    Recordings take turns: simulated ones of both mountings, two targets and all errors of the arm, and random
    views of the sets.

    Raises
    ------
    SolveError
        A cell could not be drawn, or an estimate of a clean recording failed.
    """
    kinds = tuple(map(Mistake, kinds))
    bases = tuple(_base(recording) for recording in sets)
    jobs = [
        _Job(kind, ModelName(model), seed, bases, tuple(range(i, min(i + RUNS_PER_PIECE, count))))
        for kind, count in [*((kind, trials) for kind in kinds), (None, trials * len(kinds))]
        for i in range(0, count, RUNS_PER_PIECE)
    ]
    done = run_all(_run, jobs, workers=workers, progress=progress)
    results = {
        kind: tuple(
            run for job, runs in zip(jobs, done, strict=True) if job.mistake is kind for run in runs if run
        )
        for kind in (*kinds, None)
    }
    named = {kind: runs for kind, runs in results.items() if kind is not None}
    names = ("simulated", *(recording.name for recording in sets))
    return Mistakes(ModelName(model), seed, names, named, results[None])


@dataclass(frozen=True)
class _Base:
    """A set with its truth, how certain that is, and how far the arm errs by."""

    recording: Recording
    X: Pose
    covariance: FloatArray
    arm_mm: float


def _base(recording: Recording) -> _Base:
    """Return a set with what all its views say where it has no truth."""
    answer, given = solve(recording), recording.truth
    known = given.X if given is not None else None
    truth = Truth(known or answer.X, (given.Y if given is not None else None) or answer.Y)
    return _Base(
        replace(recording, truth=truth),
        known or answer.X,
        answer.covariance if known is None else np.zeros((6, 6)),
        answer.noise.robot_translation_m * MM_PER_M,
    )


@dataclass(frozen=True)
class _Job:
    mistake: Mistake | None
    model: ModelName
    seed: int
    bases: tuple[_Base, ...]
    numbers: tuple[int, ...]


def _run(job: _Job) -> list[Run | None]:
    return [_one(job, number) for number in job.numbers]


def _one(job: _Job, number: int) -> Run | None:
    mistake = "" if job.mistake is None else job.mistake.value
    random = np.random.default_rng([job.seed, number, zlib.crc32(mistake.encode())])
    if job.mistake is None:
        clean = _clean(job, number, random).recording
        findings = diagnose(clean).findings
        said = next((finding.code for finding in findings if finding.code in CODES), "")
        nothing = {"translation_mm": float("nan"), "clean_translation_mm": float("nan")}
        return Run(number, clean.name, said, not said, not said, wrong=False, restored=None, **nothing)
    for _ in range(MOST_DRAWS):
        base = _clean(job, number, random)
        if not can_be_planted(base.recording, job.mistake, base.arm_mm):
            return None
        # What is refused without a mistake is counted among the clean ones.
        with suppress(DegenerateError, InputError):
            return _planted(_Clean(base, job.model), job.mistake, number, random)
    raise DegenerateError(f"recording {number}: its views never determine an answer")


class _Clean:
    """A clean recording, and the answer to it once that is asked for."""

    def __init__(self, base: _Base, model: ModelName) -> None:
        self.base, self.recording, self.model = base, base.recording, model

    @cached_property
    def answer(self) -> Calibration:
        return solve(self.recording, self.model)


def _planted(clean: _Clean, mistake: Mistake, number: int, random: np.random.Generator) -> Run:
    recording, views = plant(clean.recording, mistake, random, clean.base.arm_mm)
    diagnosis = diagnose(recording)
    first = diagnosis.findings[0] if diagnosis.findings else None
    after = _answer(diagnosis, clean.model)
    if first is None and isinstance(after, HandeyeError):
        said, concerned = after.code, []
    else:
        said = "" if first is None else first.code
        concerned = [] if first is None else sorted(first.evidence["views"])
    as_well: list[str] = [] if first is None else first.evidence.get("as_well", [])
    named = EXPECTED[mistake] in {said, *as_well} and (not views or concerned == sorted(views))
    if not named:
        _ = clean.answer  # what determines nothing without a mistake counts for nothing
    restored = None
    if diagnosis.repaired is not None and diagnosis.findings:
        restored = _is_restored(diagnosis.repaired, clean)
    run = Run(number, clean.recording.name, said, named, False, False, restored, np.nan, np.nan)
    if not isinstance(after, Calibration):
        return run
    before, X_true = clean.answer, clean.base.X
    return replace(
        run,
        answered=True,
        wrong=_holds(before, clean.base) and not _holds(after, clean.base),
        translation_mm=metrics.absolute_error(after.X, X_true).translation_mm,
        clean_translation_mm=metrics.absolute_error(before.X, X_true).translation_mm,
    )


def _clean(job: _Job, number: int, random: np.random.Generator) -> _Base:
    """Return a clean recording with its truth: simulated ones and sets take turns."""
    turn, round_ = number % (len(job.bases) + 2), number // (len(job.bases) + 2)
    if turn < 2:
        # Both mountings in turn, then targets and errors of the arm.
        recording = made_up(4 * round_ + 2 * turn + round_ % 2, job.seed)
        truth = recording.truth
        if truth is None or truth.X is None:
            raise AssertionError  # simulated
        return _Base(recording, truth.X, np.zeros((6, 6)), arm_mm=0.0)
    base = job.bases[turn - 2]
    recording = _part(base.recording, random)
    return replace(base, recording=_other_way_round(recording) if round_ % 2 else recording)


def _part(recording: Recording, random: np.random.Generator) -> Recording:
    """Return some of the views, in their order."""
    most = min(MOST, len(recording))
    count = int(random.integers(min(FEWEST, most), most + 1))
    chosen = np.sort(random.permutation(len(recording))[:count])
    return recording.with_views([recording.views[int(k)] for k in chosen])


def _other_way_round(recording: Recording) -> Recording:
    """Return the same views as the other mounting has them, base and flange exchanged: X and Y stay."""
    other = next(mounting for mounting in Mounting if mounting is not recording.mounting)
    views = [
        replace(view, T_base_flange=view.T_base_flange.inverse(), joints_rad=None) for view in recording.views
    ]
    return replace(recording, mounting=other, views=tuple(views))


def _answer(diagnosis: Diagnosis, model: ModelName) -> Calibration | HandeyeError:
    """Return what `solve` says of the recording."""
    if diagnosis.refused is not None:
        return diagnosis.refused
    if diagnosis.examination is None:
        raise AssertionError  # refused then
    try:
        return calibrate_examined(diagnosis.examination, model)
    except HandeyeError as error:
        return error


def _holds(calibration: Calibration, base: _Base) -> bool:
    squared = metrics.nees(calibration.X, calibration.covariance + base.covariance, base.X)
    return metrics.region_holds(squared, calibration.degrees_of_freedom)


def _is_restored(repaired: Recording, clean: _Clean) -> bool | None:
    """Tell whether a repair brings back the answer; None where the views left have none anyway."""
    if _same(repaired, clean.recording):
        return True
    try:
        calibration = solve(repaired, clean.model)
    except HandeyeError:
        left = {view.name for view in repaired.views}
        kept = clean.recording.with_views(view for view in clean.recording.views if view.name in left)
        try:
            solve(kept, clean.model)
        except DegenerateError:
            return None
        return False
    expected = clean.answer
    radius = within(expected.covariance, expected.degrees_of_freedom).translation_mm
    return metrics.absolute_error(calibration.X, expected.X).translation_mm < radius


def _same(one: Recording, other: Recording) -> bool:
    """Tell whether two recordings are the same but for rounding."""
    alike = one.mounting is other.mounting and one.target == other.target and len(one) == len(other)
    return (
        alike
        and np.array_equal(one.camera.parameters, other.camera.parameters)
        and all(
            np.allclose(a.T_base_flange.matrix, b.T_base_flange.matrix, rtol=0, atol=SAME)
            and np.array_equal(a.point_ids, b.point_ids)
            and np.allclose(a.pixels, b.pixels, rtol=0, atol=SAME)
            for a, b in zip(one.views, other.views, strict=True)
        )
    )
