"""`handeye run --rig`: several cameras at once, until all of them are as accurate as asked."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.page import Live
from handeye.cli.run_answer import found
from handeye.estimation.confidence import Within
from handeye.planning.rig_request import rig_touch_map
from handeye.robots.protocol import Goal
from handeye.session.closing import closing
from handeye.session.deciding import EndReason
from handeye.session.drivers import Person
from handeye.session.observer import Observer
from handeye.session.rig import RigEnd, RigSession
from handeye.session.rig_devices import prepare_rig
from handeye.session.rig_prepared import RigPrepared, begin_rig, go_on_rig
from handeye.session.rig_store import RigStore
from handeye.session.settings import Configuration
from handeye.studies.rig_cell import rig_cell
from handeye.studies.rig_loop import judged
from handeye.types import RigRecording
from handeye.types.calibration import ModelName

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
    real = configuration.rig is not None and configuration.rig.images is not None
    if real == configuration.is_simulated or configuration.is_replay:
        raise UsageError(
            "--rig drives a simulated rig, and --rig-file a real one with --robot and --driver",
            hint="describe the cameras and targets of a real rig in a file, see handeye run --help",
        )
    if given or not configuration.camera_known:
        raise UsageError(
            "a rig has cameras and targets of its own, which are calibrated",
            hint="leave --camera, --target, --mounting, --images and --uncalibrated out",
        )
    if dry_run or configuration.policy != Configuration.policy or configuration.model is not ModelName.AUTO:
        raise UsageError("several cameras go without --dry-run, --policy and --model")


def cell_of(configuration: Configuration, recording: RigRecording | None, **world: Any) -> RigPrepared:  # noqa: ANN401
    """Return the rig that is asked for: a simulated one, or that of a recording by its drivers.

    Raises
    ------
    InputError, DeviceError
        As for `prepare_rig` and `rig_cell`.
    """
    if recording is None or configuration.is_simulated:
        return rig_cell(configuration, confirm=world.get("confirm"), observer=world.get("observer"))
    return prepare_rig(configuration, recording, **world)


def run_rig(folder: Path, prepared: RigPrepared, live: Live | None = None) -> Answer:
    """Begin a session and run it to its end, from the page if there is one.

    Raises
    ------
    HandeyeError
        It has no answer, or the folder cannot be written.
    """
    with closing(prepared.cell):
        done = _run(*begin_rig(prepared, folder), prepared, live)
    return _answer(folder, *done)


def resume_rig(
    folder: Path,
    confirm: Callable[[Goal], bool] | None = None,
    observer: Observer | None = None,
    person: Person | None = None,
    live: Live | None = None,
) -> Answer:
    """Go on with a session.

    Raises
    ------
    HandeyeError
        As for `run_rig`; or the session was damaged.
    """
    session, store, prepared = go_on_rig(
        folder,
        lambda asked, recording, start: cell_of(
            asked, recording, person=person, confirm=confirm, start=start, observer=observer
        ),
    )
    with closing(prepared.cell):
        if store.notice is not None and person is not None:
            person.tell(f"warning: {store.notice}")
        done = _run(session, store, prepared, live)
    return _answer(folder, *done)


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
    calibration = found(end.calibration, (end.reason, end.sentence), folder, "stations", end.error)
    run, asked = judged(prepared, end), prepared.configuration

    def told(name: str, within: Within) -> dict[str, Any]:
        if prepared.truth is None:
            return {"within_95": within.to_dict(), "true_error": None}
        error = {"translation_mm": run.error_mm[name], "rotation_deg": run.error_deg[name]}
        return {"within_95": within.to_dict(), "true_error": error}

    cameras = {name: told(name, calibration.estimate.of_camera(name).within_95) for name in run.cameras}
    for name, one in cameras.items():
        asked_for = asked.touch_mm is not None
        touch = rig_touch_map(calibration.estimate, name, asked.work).to_dict() if asked_for else None
        one["touch"] = touch
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
        "seed": asked.seed,
        "calibration": calibration.to_dict(),
    }

    def show(console: "Console") -> None:
        from handeye.cli.wording import figures, heading, notices, pairs  # noqa: PLC0415

        heading(console, "accuracy reached" if data["request_met"] else "accuracy NOT reached", end.sentence)
        rows: list[tuple[str, str]] = []
        for name, one in {**cameras, **between}.items():
            within = one["within_95"]
            mm, deg = within["translation_mm"], within["rotation_deg"]
            text = f"within {figures(mm, 2)} mm and {figures(deg, 2)} deg (95 %)"
            if one.get("touch") is not None:
                text += f", a touch within {figures(one['touch']['worst_mm'], 2)} mm"
            if one["true_error"] is not None:
                off = one["true_error"]
                text += f", off the truth by {figures(off['translation_mm'], 2)} mm and "
                text += f"{figures(off['rotation_deg'], 2)} deg"
            rows.append((name, text))
        pairs(console, rows, indent=2)
        pairs(
            console,
            [("stations", f"{end.stations} of {end.attempts} attempts"), ("written", str(folder))],
        )
        notices(console, "Warnings", calibration.warnings)

    return Answer(data, show)
