"""What studies share at the command line: who does how much work, where the data are, what is written."""

import importlib.metadata
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from handeye.cli.options import Seed
from handeye.cli.output import write_figure, write_json
from handeye.cli.progress import progress
from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.calibration import ModelName

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from handeye.compute.parallel import Workers
    from handeye.types import Recording


@Parameter(name="*", group="Study")
@dataclass(frozen=True)
class Work:
    """Who does the work of a study, and what is kept of it."""

    workers: Annotated[int | None, Parameter(show_default=False)] = None
    """Processes; all processors by default. The results do not depend on it."""
    scheduler: Annotated[str | None, Parameter(show_default=False)] = None
    """Address of a Dask scheduler whose workers do the work, such as tcp://127.0.0.1:8786."""
    checkpoint: Path | None = None
    """Folder that keeps finished pieces: the same command goes on where it was broken off."""
    output: Path | None = None
    """Folder for the pictures and the JSON object; made if it does not exist."""

    @property
    def processes(self) -> int:
        """Number of processes."""
        if self.workers is not None:
            return self.workers
        from joblib import cpu_count  # noqa: PLC0415  # pyright: ignore[reportUnknownVariableType]

        count: int = cpu_count()
        return count

    @property
    def crew(self) -> "Workers":
        """Who does the work, and what keeps it."""
        workers: Workers = self.processes
        if self.scheduler is not None:
            from handeye.compute.cluster import Cluster  # noqa: PLC0415 - rarely wanted

            workers = Cluster(self.scheduler)
        if self.checkpoint is not None:
            from handeye.compute.checkpoint import Checkpoint  # noqa: PLC0415 - rarely wanted

            workers = Checkpoint(self.checkpoint, workers)
        return workers


@Parameter(name="*", group="Study")
@dataclass(frozen=True)
class Effort(Work):
    """The work of a study whose draws have a seed."""

    seed: Seed = 0
    """Seed of everything random."""


@Parameter(name="*", group="Study")
@dataclass(frozen=True)
class Trials(Effort):
    """What studies of random starts and simulated calibrations ask for besides."""

    model: ModelName = ModelName.AUTO
    """auto: the data say how noisy robot and camera are. paper: robot and camera are taken as exact."""
    trials: Annotated[int | None, Parameter(show_default=False)] = None
    """Random starts of each set, or simulated calibrations of each kind; 50, or 500."""

    def count(self, usual: int) -> int:
        """Return the number of trials, `usual` unless given.

        Raises
        ------
        InputError
            Fewer than one.
        """
        trials = usual if self.trials is None else self.trials
        if trials < 1:
            raise InputError(f"{trials} trials, expected at least 1", code=Code.OUT_OF_RANGE)
        return trials


@Parameter(name="*", group="Data")
@dataclass(frozen=True)
class Data:
    """Where the sets are."""

    data: Path | None = None
    """Folder that holds the sets, or holds rwhe-calib; by default what HANDEYE_DATA names."""
    sets: Annotated[tuple[str, ...], Parameter(consume_multiple=True, show_default=False)] = ()
    """Names of the sets, if not the usual ones of the study: any folders that `handeye solve` reads."""
    no_cache: bool = False
    """Look for the target again, and remember nothing."""

    def load(self, usual: Sequence[str], workers: int) -> "list[Recording]":
        """Return the recordings, `usual` ones unless named.

        Raises
        ------
        InputError, DetectionError, DegenerateError, SolveError
            As `handeye.studies.data.load_sets`.
        """
        from handeye.studies.data import cache_folder, data_folder, load_sets  # noqa: PLC0415

        names = self.sets or tuple(usual)
        folder = data_folder(self.data)
        with progress("Reading the sets") as advance:
            return load_sets(
                folder,
                names,
                workers=workers,
                cache=None if self.no_cache else cache_folder(),
                progress=advance,
            )


def versions() -> dict[str, str]:
    """Return the versions that the numbers of a study come from."""
    names = ("handeye", "numpy", "opencv-contrib-python-headless")
    return {name: importlib.metadata.version(name) for name in names}


def write_results(
    folder: Path | None,
    name: str,
    document: Mapping[str, Any],
    pictures: "Callable[[], Iterable[tuple[str, Figure]]]",
) -> list[Path]:
    """Write the numbers of a study, with versions, and its pictures into a folder, if one is asked for.

    Returns the files.
    """
    if folder is None:
        return []
    written = [folder / f"{name}.json"]
    write_json(written[0], {**document, "versions": versions()})
    for picture, figure in pictures():
        written.append(folder / f"{picture}.png")
        write_figure(written[-1], figure)
    return written
