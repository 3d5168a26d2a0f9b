"""Are mistakes found and named, and does a repair bring back the answer? One planted mistake each, and none.

A mistake is named right if the first finding has its code and, where it concerns single views, exactly these
views. An answer is wrong if the region stated at 95 % misses the truth, though that of the same recording
without the mistake holds it. A repair brings the answer back if it moves the camera's centre by less than the
stated radius of the clean answer. The truth of a set without any is the answer of all its views.
"""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, run_all
from handeye.errors import HandeyeError
from handeye.estimation import solve
from handeye.estimation.confidence import within
from handeye.estimation.faults import CODES, diagnose
from handeye.studies.planted import EXPECTED, Mistake, can_be_planted, made_up, plant
from handeye.types import Pose, Recording
from handeye.types.calibration import Calibration, ModelName
from handeye.validation import metrics

RUNS_PER_PIECE = 4
# Views of a set that a run draws.
FEWEST, MOST = 8, 20


@dataclass(frozen=True)
class Run:
    """One recording with a mistake, or none.

    `said` is the code of the first finding, empty where there is none. `restored` is None where the mistake
    is of a kind that nobody can put right. Errors are NaN where the recording was refused.
    """

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
    bases = tuple(_Base(recording, _reference(recording)) for recording in sets)
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
    """A set, and where its camera truly is as far as that is known."""

    recording: Recording
    X: Pose


def _reference(recording: Recording) -> Pose:
    if recording.truth is not None and recording.truth.X is not None:
        return recording.truth.X
    return solve(recording).X


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
    clean, X_true = _clean(job, number, random)
    if job.mistake is None:
        findings = diagnose(clean).findings
        said = next((finding.code for finding in findings if finding.code in CODES), "")
        return Run(clean.name, said, not said, answered=not said, wrong=False, restored=None, **_NO_ERRORS)
    if not can_be_planted(clean, job.mistake):
        return None
    recording, views = plant(clean, job.mistake, random)
    before = solve(clean, job.model)
    diagnosis = diagnose(recording)
    first = diagnosis.findings[0] if diagnosis.findings else None
    after = _answer(recording, job.model)
    if first is None and isinstance(after, HandeyeError):
        said, concerned = after.code, []
    else:
        said = "" if first is None else first.code
        concerned = [] if first is None else sorted(first.evidence["views"])
    named = said == EXPECTED[job.mistake] and (not views or concerned == sorted(views))
    restored = None
    if diagnosis.repaired is not None and diagnosis.findings:
        restored = _is_restored(diagnosis.repaired, before, job.model)
    answered = isinstance(after, Calibration)
    wrong = isinstance(after, Calibration) and _holds(before, X_true) and not _holds(after, X_true)
    return Run(
        clean.name,
        said,
        named,
        answered,
        wrong,
        restored,
        metrics.absolute_error(after.X, X_true).translation_mm if isinstance(after, Calibration) else np.nan,
        metrics.absolute_error(before.X, X_true).translation_mm,
    )


_NO_ERRORS = {"translation_mm": float("nan"), "clean_translation_mm": float("nan")}


def _clean(job: _Job, number: int, random: np.random.Generator) -> tuple[Recording, Pose]:
    """Return a clean recording and its true X: simulated ones and sets take turns."""
    turn, round_ = number % (len(job.bases) + 2), number // (len(job.bases) + 2)
    if turn < 2:
        # Both mountings in turn, then targets and errors of the arm.
        recording = made_up(4 * round_ + 2 * turn + round_ % 2, job.seed)
        return recording, _reference(recording)
    base = job.bases[turn - 2]
    most = min(MOST, len(base.recording))
    count = int(random.integers(min(FEWEST, most), most + 1))
    chosen = np.sort(random.permutation(len(base.recording))[:count])
    views = [base.recording.views[int(k)] for k in chosen]
    return replace(base.recording, views=tuple(views)), base.X


def _answer(recording: Recording, model: ModelName) -> Calibration | HandeyeError:
    try:
        return solve(recording, model)
    except HandeyeError as error:
        return error


def _holds(calibration: Calibration, X_true: Pose) -> bool:
    squared = metrics.nees(calibration.X, calibration.covariance, X_true)
    return metrics.region_holds(squared, calibration.degrees_of_freedom)


def _is_restored(repaired: Recording, clean: Calibration, model: ModelName) -> bool:
    calibration = _answer(repaired, model)
    if not isinstance(calibration, Calibration):
        return False
    radius = within(clean.covariance, clean.degrees_of_freedom).translation_mm
    return metrics.absolute_error(calibration.X, clean.X).translation_mm < radius
