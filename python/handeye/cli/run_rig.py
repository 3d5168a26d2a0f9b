"""`handeye run --rig`: several cameras at once, until all of them are as accurate as asked."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.page import Live
from handeye.cli.run_answer import found
from handeye.estimation.confidence import Within
from handeye.robots.protocol import Goal
from handeye.session.deciding import EndReason
from handeye.session.observer import Observer
from handeye.session.rig import RigEnd, RigSession
from handeye.session.rig_prepared import RigPrepared, begin_rig, go_on_rig
from handeye.session.rig_store import RigStore
from handeye.session.settings import Configuration
from handeye.studies.rig_cell import rig_cell
from handeye.studies.rig_loop import judged

if TYPE_CHECKING:
    from rich.console import Console


def check_rig(configuration: Configuration, *, given: bool, dry_run: bool) -> None:
    """Refuse what does not go with several cameras.

    Parameters
    ----------
    configuration
        What is asked for.
    given
        Whether a camera, a target or a mounting is stated.
    dry_run
        Whether nothing shall be done.

    Raises
    ------
    UsageError
        It does not.
    """
    if not configuration.is_simulated or given or configuration.touch_mm or not configuration.camera_known:
        raise UsageError(
            "--rig drives a simulated rig: it has arm, cameras and targets of its own, and an accuracy is "
            "asked for of every camera",
            hint="leave the other options out; stations of a real rig are taken by its own program, then "
            "handeye import, solve and plan take them all together",
        )
    if dry_run or configuration.policy != Configuration.policy:
        raise UsageError("--rig goes without --dry-run and --policy")


def run_rig(folder: Path, prepared: RigPrepared, live: Live | None = None) -> Answer:
    """Begin a session and run it to its end, from the page if there is one.

    Raises
    ------
    HandeyeError
        It has no answer, or the folder cannot be written.
    """
    return _answer(folder, *_run(*begin_rig(prepared, folder), prepared, live))


def resume_rig(
    folder: Path,
    confirm: Callable[[Goal], bool] | None = None,
    observer: Observer | None = None,
    tell: Callable[[str], None] | None = None,
    live: Live | None = None,
) -> Answer:
    """Go on with a session.

    Raises
    ------
    HandeyeError
        As for `run_rig`; or the session was damaged.
    """
    session, store, prepared = go_on_rig(
        folder, lambda asked: rig_cell(asked, confirm=confirm, observer=observer)
    )
    if store.notice is not None and tell is not None:
        tell(f"warning: {store.notice}")
    return _answer(folder, *_run(session, store, prepared, live))


def _run(
    session: RigSession, store: RigStore, prepared: RigPrepared, live: Live | None
) -> tuple[RigPrepared, RigEnd]:
    try:
        end = session.run() if live is None else live.run(session, store, prepared)
        if prepared.truth is not None:
            store.reveal(prepared.truth)
    finally:
        store.close()
    return prepared, end


def _answer(folder: Path, prepared: RigPrepared, end: RigEnd) -> Answer:
    calibration = found(end.calibration, (end.reason, end.sentence), folder, "stations")
    run = judged(prepared, end)

    def told(name: str, within: Within) -> dict[str, Any]:
        error = {"translation_mm": run.error_mm[name], "rotation_deg": run.error_deg[name]}
        return {"within_95": within.to_dict(), "true_error": error}

    cameras = {name: told(name, calibration.estimate.of_camera(name).within_95) for name in run.cameras}
    between = {
        f"T_{a}_{b}": told(f"{a}_{b}", one.within_95) for (a, b), one in calibration.camera_to_camera.items()
    }
    data: dict[str, Any] = {
        "session": str(folder),
        "end": end.reason.value,
        "sentence": end.sentence,
        "request_met": end.reason is EndReason.ACCURACY_REACHED,
        "stations": end.stations,
        "attempts": end.attempts,
        "cameras": cameras,
        "camera_to_camera": between,
        "seed": prepared.configuration.seed,
        "calibration": calibration.to_dict(),
    }

    def show(console: "Console") -> None:
        from handeye.cli.wording import figures, heading, notices, pairs  # noqa: PLC0415

        heading(console, "accuracy reached" if data["request_met"] else "accuracy NOT reached", end.sentence)
        rows: list[tuple[str, str]] = []
        for name, stated in run.stated_mm.items():
            off = f"{figures(run.error_mm[name], 2)} mm and {figures(run.error_deg[name], 2)} deg"
            rows.append((name, f"within {figures(stated, 2)} mm (95 %), off the truth by {off}"))
        pairs(console, rows, indent=2)
        pairs(
            console,
            [("stations", f"{end.stations} of {end.attempts} attempts"), ("written", str(folder))],
        )
        notices(console, "Warnings", calibration.warnings)

    return Answer(data, show)
