"""`handeye study rigs`: several cameras in one estimate, and in one run."""

from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Trials, write_results
from handeye.simulation.cells import ErrorKind

if TYPE_CHECKING:
    from rich.console import Console


def rigs(
    *,
    errors: ErrorKind = ErrorKind.MIXTURE_RANDOM,
    loop: bool = False,
    trials: Trials = Trials(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Count how often the stated regions of a rig hold the truth, cameras in each other too.

    Two cameras on the flange and two beside, two boards, 12 stations; all in one estimate, compared with each
    camera on its own. With --loop simulated rigs are driven until 0.5 mm and 0.05 deg are reached, with all
    cameras at once and with one after another.

    Parameters
    ----------
    errors
        What is wrong with the arm.
    loop
        Drive rigs instead.
    """
    from handeye.studies.rig_loop import study_rig_loop  # noqa: PLC0415 - help need not wait for it
    from handeye.studies.rigs import study_rigs  # noqa: PLC0415

    check_folder(trials.output)
    document: dict[str, Any]
    if loop:
        with progress("Driving simulated rigs") as advance:
            document = study_rig_loop(
                cells=trials.count(30), seed=trials.seed, workers=trials.crew, progress=advance
            ).to_dict()
    else:
        with progress("Calibrating simulated rigs") as advance:
            document = study_rigs(
                kind=errors,
                trials=trials.count(100),
                seed=trials.seed,
                workers=trials.crew,
                progress=advance,
            ).to_dict()
    written = write_results(trials.output, "rig_loop" if loop else "rigs", document, lambda: ())

    def show(console: "Console") -> None:
        from handeye.cli import study_tables as tables  # noqa: PLC0415
        from handeye.cli.wording import heading, pairs  # noqa: PLC0415

        heading(console, "Several cameras at once", f"seed {trials.seed}")
        if loop:
            pairs(console, [(name, str(value)) for name, value in document.items() if name != "study"])
        for known in ("arm_described", "arm_not_described"):
            for kind, found in document.get(known, {}).items():
                line = (
                    f"95 % region holds {found['coverage_95']:.1%} of {found['transforms']}, NEES/6 "
                    f"{found['nees_per_dof']:.2f}, off by {found['translation_mm']:.2f} mm"
                )
                if "translation_mm_one_at_a_time" in found:
                    line += f" ({found['translation_mm_one_at_a_time']:.2f} one at a time)"
                pairs(console, [(f"{known}, {kind}".replace("_", " "), line)])
        tables.show_written(console, written)

    return Answer(document, show)
