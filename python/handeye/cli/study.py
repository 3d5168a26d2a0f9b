"""`handeye study`: the tables and figures of the paper, and those that go beyond it, on public data."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Data, Trials, write_results
from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.mounting import Mounting

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console


study = App(
    name="study",
    help="Compare policies and models on public data, and claims with the truth.\n\n"
    "The data are the sets of Ali, Suominen, Gotchev and Ruiz Morales (Sensors 19(12), 2837, 2019). What is "
    "found in their images is remembered in the user's cache folder (HANDEYE_CACHE names another).",
    result_action="return_value",
)
# Imported when it runs.
study.command(
    "handeye.cli.study_touch:touch", name="touch", help="Count how often the tool lands where it is said to."
)
study.command(
    "handeye.cli.study_shift:shift", name="shift", help="Count how often a check finds and names what moved."
)
study.command(
    "handeye.cli.study_probing:probing", name="probing", help="Count what finds a board of another size."
)
study.command("handeye.cli.study_arm:arm", name="arm", help="Compare arms put right with the truth.")
study.command("handeye.cli.study_cheap_arms:cheap_arms", name="cheap-arms", help="Try arms of hobby servos.")
study.command(
    "handeye.cli.study_twin:twin", name="twin", help="Repeat the paper's study on a twin of its cell."
)
study.command(
    "handeye.cli.study_public:public", name="public", help="Compare on cells and data that others made."
)
study.command(
    "handeye.cli.study_scale:scale",
    name="scale",
    help="Measure what a million trials cost here and on a cluster.",
)
study.command(
    "handeye.cli.study_rigs:rigs", name="rigs", help="Count what several cameras at once are worth."
)
study.command(
    "handeye.cli.study_methods:methods",
    name="methods",
    help="Compare every method on the same simulated cells.",
)
study.command(
    "handeye.cli.study_policies:policies",
    name="policies",
    help="Compare policies in the same cells at equal budget.",
)
study.command(
    "handeye.cli.study_policies:gains",
    name="gains",
    help="Tell what gains are worth, apart from noise.",
)
study.command(
    "handeye.cli.study_questions:questions",
    name="questions",
    help="Tell what boards, distances, views, tilts, lenses and arms make of the accuracy.",
)


@study.command
def table1(
    *,
    data: Data = Data(),  # noqa: B008
    trials: Trials = Trials(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Reproduce the paper's table I: errors against truth on simulated sets, three policies.

    3 random views that determine the answer, the same for every policy, then 5 more by each. The camera is
    calibrated from the set; --model paper takes it and the robot as exact, as the paper does.
    """
    from handeye.studies import study_table1  # noqa: PLC0415
    from handeye.studies.data import SIMULATED_SETS  # noqa: PLC0415 - help need not wait for it

    check_folder(trials.output)
    count = trials.count(50)
    recordings = data.load(SIMULATED_SETS, trials.processes)
    with progress("Calibrating from random starts") as advance:
        result = study_table1(
            recordings,
            model=trials.model,
            trials=count,
            seed=trials.seed,
            workers=trials.crew,
            progress=advance,
        )

    def pictures() -> "Iterable[tuple[str, Figure]]":
        from handeye.studies.plots import errors_figure  # noqa: PLC0415

        panels = (("translation_mm", "translation error (mm)"), ("rotation_deg", "rotation error (deg)"))
        title = f"errors against truth after 3 + 5 views, model {result.model}, {count} random starts"
        yield "table1", errors_figure(result.sets, panels, title)

    document = result.to_dict()
    written = write_results(trials.output, "table1", document, pictures)

    def show(console: "Console") -> None:
        from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it

        tables.show_title(console, "Error against truth after 3 + 5 views", document)
        parts = {"all sets": document, **document["sets"]}
        tables.show_policies(console, parts, (("translation_mm", "mm"), ("rotation_deg", "deg")))
        tables.show_written(console, written)

    return Answer(document, show)


@study.command
def curves(
    *,
    data: Data = Data(),  # noqa: B008
    trials: Trials = Trials(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Draw the paper's curves against the number of added views, and what gains are worth.

    A third of the views is held out to measure on. Every candidate of the first step is tried, for the
    scatter of predicted gain against the reduction of the held-out error.
    """
    from handeye.studies import study_curves  # noqa: PLC0415
    from handeye.studies.data import REAL_SETS, SIMULATED_SETS  # noqa: PLC0415

    check_folder(trials.output)
    count = trials.count(50)
    recordings = data.load([*SIMULATED_SETS, *REAL_SETS], trials.processes)
    with progress("Calibrating from random starts") as advance:
        result = study_curves(
            recordings,
            model=trials.model,
            trials=count,
            seed=trials.seed,
            workers=trials.crew,
            progress=advance,
        )

    def pictures() -> "Iterable[tuple[str, Figure]]":
        from handeye.studies.plots import curves_figure, scatter_figure  # noqa: PLC0415

        for part in result.sets:
            yield f"curves_{part.name}", curves_figure(result, part)
        yield "scatter", scatter_figure(result)

    document = result.to_dict()
    written = write_results(trials.output, "curves", document, pictures)

    def show(console: "Console") -> None:
        from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it

        tables.show_title(console, "Means after 0, 1, ... views added to 3, a third held out", document)
        for name, part in document["sets"].items():
            tables.show_curves(console, name, part)
        median = document["correlation"]["median"]
        console.print(
            f"correlation of predicted gain and reduction of the held-out RMSE: median {median:.2f}"
        )
        tables.show_written(console, written)

    return Answer(document, show)


@study.command
def holdout(
    *,
    data: Data = Data(),  # noqa: B008
    trials: Trials = Trials(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Measure on real sets: errors on a third of the views held out, and how well halves agree.

    Held-out errors reward an answer that follows the robot's error; the agreement of disjoint halves does
    not.
    """
    from handeye.studies import study_holdout  # noqa: PLC0415
    from handeye.studies.data import REAL_SETS  # noqa: PLC0415

    check_folder(trials.output)
    count = trials.count(50)
    recordings = data.load(REAL_SETS, trials.processes)
    with progress("Calibrating from random starts") as advance:
        result = study_holdout(
            recordings,
            model=trials.model,
            trials=count,
            seed=trials.seed,
            workers=trials.crew,
            progress=advance,
        )

    def pictures() -> "Iterable[tuple[str, Figure]]":
        from handeye.studies.plots import errors_figure  # noqa: PLC0415

        panels = (
            ("relative_translation_mm", "relative translation error (mm)"),
            ("relative_rotation_deg", "relative rotation error (deg)"),
        )
        title = f"held-out errors after 3 + 5 views, model {result.model}, {count} random starts"
        yield "holdout", errors_figure(result.sets, panels, title)

    document = result.to_dict()
    written = write_results(trials.output, "holdout", document, pictures)

    def show(console: "Console") -> None:
        from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it

        tables.show_title(console, "Error on held-out views after 3 + 5 views", document)
        metrics = (("relative_translation_mm", "mm"), ("relative_rotation_deg", "deg"), ("rmse_px", "px"))
        tables.show_policies(console, document["sets"], metrics)
        tables.show_halves(console, document["sets"])
        tables.show_written(console, written)

    return Answer(document, show)


@study.command
def injected(
    *,
    data: Data = Data(),  # noqa: B008
    trials: Trials = Trials(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Add noise to the robot poses of a simulated set, its levels not told, and compare with the truth.

    On the base side 0.225 mm and 0.0169 deg per axis, on the flange side 0.15 mm and 0.01125 deg, drawn
    again for each random start.
    """
    from handeye.studies import study_injected  # noqa: PLC0415
    from handeye.studies.data import SIMULATED_SETS  # noqa: PLC0415

    check_folder(trials.output)
    count = trials.count(50)
    recordings = data.load(SIMULATED_SETS[-1:], trials.processes)
    with progress("Calibrating from random starts") as advance:
        result = study_injected(
            recordings,
            model=trials.model,
            trials=count,
            seed=trials.seed,
            workers=trials.crew,
            progress=advance,
        )
    document = result.to_dict()
    written = write_results(trials.output, "injected", document, lambda: ())

    def show(console: "Console") -> None:
        from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it

        tables.show_title(console, "Error against truth after 3 + 5 views, noise injected", document)
        parts = {
            f"{side}, {name}": part
            for side, found in document["sides"].items()
            for name, part in found["sets"].items()
        }
        tables.show_policies(console, parts, (("translation_mm", "mm"), ("rotation_deg", "deg")))
        tables.show_written(console, written)

    return Answer(document, show)


@study.command
def coverage(
    *,
    mounting: Mounting = Mounting.EYE_IN_HAND,
    trials: Trials = Trials(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Count how often the 95 % region of the hand-eye holds the truth, for each kind of error.

    Calibrations of a simulated arm from 8 to 12 views. A true covariance gives 0.95, and a NEES of one per
    degree of freedom.

    Parameters
    ----------
    mounting
        Where the camera sits.
    """
    from handeye.simulation.cells import CellOptions  # noqa: PLC0415
    from handeye.studies import study_coverage  # noqa: PLC0415

    check_folder(trials.output)
    with progress("Calibrating simulated cells") as advance:
        result = study_coverage(
            model=trials.model,
            cell=CellOptions(mounting=mounting),
            trials=trials.count(500),
            seed=trials.seed,
            workers=trials.crew,
            progress=advance,
        )

    def pictures() -> "Iterable[tuple[str, Figure]]":
        from handeye.studies.plots import coverage_figure  # noqa: PLC0415

        yield "coverage", coverage_figure(result)

    document = result.to_dict()
    written = write_results(trials.output, "coverage", document, pictures)

    def show(console: "Console") -> None:
        from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it

        tables.show_title(console, "Simulated calibrations", document)
        tables.show_kinds(console, document["kinds"])
        tables.show_written(console, written)

    return Answer(document, show)


@study.command
def mistakes(
    *,
    kinds: Annotated[tuple[str, ...], Parameter(consume_multiple=True, show_default=False)] = (),
    data: Data = Data(),  # noqa: B008
    trials: Trials = Trials(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Plant one mistake each in recordings, and count how many are named, and what they cost.

    A mistake is named if the first finding says so, with exactly the views that it concerns. As many
    recordings without a mistake count the false alarms. Recordings are simulated, and random views of the
    sets that are named.

    Parameters
    ----------
    kinds
        Mistakes to plant, if not all: flip, swap, shift, moving, gross_pose, wrong_unit, wrong_direction,
        wrong_rotation, mirrored, board_size, camera_size, cropped, stretched, distortion, sheared, stale,
        repeated, false_points, few_rotations.
    """
    from handeye.studies import Mistake, study_mistakes  # noqa: PLC0415

    known = [kind.value for kind in Mistake]
    unknown = [kind for kind in kinds if kind not in known]
    if unknown:
        raise InputError(
            f"no mistake {unknown[0]!r}", code=Code.UNKNOWN_KIND, hint=f"there are {', '.join(known)}"
        )
    check_folder(trials.output)
    sets = data.load((), trials.processes) if data.sets else []
    with progress("Planting mistakes") as advance:
        result = study_mistakes(
            sets,
            kinds=[Mistake(kind) for kind in kinds or known],
            model=trials.model,
            trials=trials.count(50),
            seed=trials.seed,
            workers=trials.crew,
            progress=advance,
        )
    document = result.to_dict()
    written = write_results(trials.output, "mistakes", document, lambda: ())

    def show(console: "Console") -> None:
        from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it

        tables.show_title(console, "One mistake in each recording", document)
        tables.show_mistakes(console, document)
        tables.show_written(console, written)

    return Answer(document, show)
