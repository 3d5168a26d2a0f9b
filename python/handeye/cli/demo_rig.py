"""`handeye demo --rig`: four cameras and two boards, driven until all of them are as accurate as asked."""

from pathlib import Path

from handeye.cli.answer import Answer


def drive_rig(folder: Path, seed: int) -> Answer:
    """Drive a simulated rig into a folder, as `handeye run --rig` does; a run that was broken off goes on.

    Raises
    ------
    HandeyeError
        As for `handeye.cli.run_rig.run_rig`.
    """
    from handeye.cli.run_rig import resume_rig, run_rig  # noqa: PLC0415 - help need not wait for it
    from handeye.session.store import is_session  # noqa: PLC0415
    from handeye.studies.rig_cell import rig_cell  # noqa: PLC0415
    from handeye.studies.rig_loop import asked_of_rig  # noqa: PLC0415

    return resume_rig(folder) if is_session(folder) else run_rig(folder, rig_cell(asked_of_rig(seed)))
