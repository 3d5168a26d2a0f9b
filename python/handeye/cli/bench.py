"""`handeye bench`: how fast solver and scorer are on this machine, beside other ways to the same answers."""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.options import Common, Seed
from handeye.cli.output import check_folder, write_json
from handeye.cli.progress import progress

if TYPE_CHECKING:
    from rich.console import Console

Name = Literal["solve", "default", "score", "step", "loop", "memory", "scaling"]


def bench(
    *names: Name,
    budget_s: float = 0.4,
    no_peers: Annotated[bool, Parameter(show_default=False)] = False,
    quick: Annotated[bool, Parameter(show_default=False)] = False,
    seed: Seed = 0,
    output: Path | None = None,
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Measure solver, default model, scorer, planning and a step of the loop, side by side with peers.

    All methods get the same problems and take turns in one run. Peers that are not installed are left out,
    and it is said why; requirements/bench.txt brings SciPy, JAX, Ceres and GTSAM for Python and the headers
    of Eigen, and those in C++ are compiled from benchmarks/peers where a compiler and the libraries are
    found.

    Parameters
    ----------
    names
        What to measure: solve, default, score, step, loop, memory, scaling; all of them by default.
    budget_s
        Seconds for each method at each size.
    no_peers
        Measure this package alone.
    quick
        Smallest sizes only, to see that all of it runs.
    seed
        Seed of the made-up problems.
    output
        Folder for the table (results.md) and the JSON object (results.json); made if it does not exist.
    """
    if find_spec("handeye.benchmarks") is None:
        raise UsageError(
            "the benchmarks come with the source of handeye, not with the wheel; run it from a clone"
        )
    # Libraries count the cores when they are loaded: they must find one.
    from handeye.benchmarks.machine import one_core  # noqa: PLC0415

    if not 0 <= budget_s <= 60 or seed < 0:
        raise UsageError("--budget-s lies between 0 and 60 and --seed is not below 0")
    check_folder(output)
    with one_core():
        from handeye.benchmarks.markdown import markdown  # noqa: PLC0415
        from handeye.benchmarks.options import Options  # noqa: PLC0415
        from handeye.benchmarks.runner import BENCHMARKS, run_benchmarks  # noqa: PLC0415

        options = Options(budget_s=budget_s, peers=not no_peers, quick=quick, seed=seed)
        wanted = tuple(dict.fromkeys(names)) or tuple(BENCHMARKS)
        parts = len(wanted)
        with progress("Measuring") as advance:
            document = run_benchmarks(
                wanted,
                options,
                lambda name, done, total: advance(
                    round(100 * (wanted.index(name) + done / total)), 100 * parts
                ),
            )
    page = markdown(document)
    written: list[Path] = []
    if output is not None:
        from handeye.datasets.writing import replace_file  # noqa: PLC0415

        written = [output / "results.json", output / "results.md"]
        write_json(written[0], document)
        replace_file(written[1], page.encode())

    def show(console: "Console") -> None:
        from rich.markdown import Markdown  # noqa: PLC0415 - JSON need not wait for it

        console.print(Markdown(page))
        for path in written:
            console.print(f"written: {path}")

    return Answer(document, show)
