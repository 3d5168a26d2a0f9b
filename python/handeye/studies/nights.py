"""Does the log of checks name the night? Made-up cells, checked every night until after something shifted."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers, run_all
from handeye.estimation.change import change_of
from handeye.estimation.shift import Moved, check_views
from handeye.studies.shift import CheckedCell, ShiftStudy, shifts_of


@dataclass(frozen=True)
class _Job:
    options: ShiftStudy
    nights: int
    moved: Moved
    number: int


@dataclass(frozen=True)
class Log:
    """One log: the night of the shift from 0 on, the one that is named, and earlier alarms."""

    night: int
    named: int | None
    early_alarms: int


def study_nights(
    options: ShiftStudy, nights: int, *, workers: Workers = 1, progress: Progress | None = None
) -> dict[str, Any]:
    """Count how often the log of checks names the night in which something shifted.

    Parameters
    ----------
    options
        As for single checks; `trials` are logs of each kind of shift.
    nights
        Checks of each log; every night from the second on is as likely to be that of the shift.

    Returns
    -------
    dict
        For each kind of shift: the share of logs that name its night, that miss it by one at most, and that
        name none; of logs without a shift, only the last can be right.

    Raises
    ------
    SolveError
        An estimate failed.

    Examples
    --------
    >>> study_nights(ShiftStudy(trials=30), 100)["moved"]["camera"]["named"]
    0.97
    """
    kinds = shifts_of(options)
    jobs = [_Job(options, nights, moved, number) for moved in kinds for number in range(options.trials)]
    done = run_all(_one, jobs, workers=workers, progress=progress)
    result: dict[str, Any] = {}
    for moved in kinds:
        logs = [log for job, log in zip(jobs, done, strict=True) if job.moved is moved]
        off = [np.inf if log.named is None else abs(log.named - log.night) for log in logs]
        result[moved.value] = {
            "logs": len(logs),
            "named": float(np.mean([miss == 0 for miss in off])),
            "named_within_one": float(np.mean([miss <= 1 for miss in off])),
            "none_named": float(np.mean([log.named is None for log in logs])),
            "early_alarms_per_night": float(
                np.sum([log.early_alarms for log in logs]) / max(sum(log.night for log in logs), 1)
            ),
        }
    return {
        "study": "nights",
        "seed": options.seed,
        "nights": nights,
        "sigmas": options.sigmas,
        "views": options.views,
        "arm_known": options.arm_known,
        "moved": result,
    }


def _one(job: _Job) -> Log:
    checked = CheckedCell.draw(job.options, job.number)
    random = np.random.default_rng([job.options.seed, 4, job.number, list(Moved).index(job.moved)])
    shifted = checked.shifted(random, job.moved)
    night = job.nights if job.moved is Moved.NOTHING else int(random.integers(1, job.nights))
    misfits: list[tuple[float, ...]] = []
    early = 0
    for number in range(job.nights):
        look = shifted if number >= night else checked.still
        check = check_views(checked.estimate, look.views(random, checked.chosen))
        misfits.append(check.misfit)
        early += check.alarm and number < night
    return Log(night, change_of(misfits).first, early)
