"""Work on an existing Dask cluster: the same results to the bit; a worker that dies costs only its piece."""

import uuid
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, TypeVar

from handeye.codes import Code
from handeye.compute.digest import program_digest
from handeye.errors import HandeyeError, InputError

T = TypeVar("T")
R = TypeVar("R")

CONNECT_S = 20.0
# Pieces that a worker has at hand beyond the one it does: none waits for the network.
AHEAD = 3
# A piece whose worker died this often probably kills its workers.
MOST_DEATHS = 5


@dataclass(frozen=True)
class Cluster:
    """The workers of a Dask scheduler.

    Parameters
    ----------
    address
        Of the scheduler, such as ``tcp://127.0.0.1:8786``.
    """

    address: str

    def run(self, work: Callable[[T], R], pieces: Sequence[T]) -> Generator[tuple[int, R]]:
        """Yield the index and the result of each piece, in the order in which they finish.

        A piece is sent again where its worker dies. Pieces are sent a few at a time: their number does not
        matter.

        Raises
        ------
        InputError
            Dask is not installed, no scheduler answers, or a worker runs another program.
        HandeyeError
            What a piece raised; or workers that die again and again.
        """
        distributed = _distributed()
        if not pieces:
            return
        try:
            client: Any = distributed.Client(self.address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError(
                f"no Dask scheduler answers at {self.address}",
                code=Code.NO_SCHEDULER,
                hint="start one with: dask scheduler, and workers with: dask worker ADDRESS --nthreads 1",
            ) from error
        try:
            yield from _run(distributed, client, work, pieces)
        finally:
            client.close(timeout=CONNECT_S)


def _distributed() -> Any:  # noqa: ANN401 - of a package that may be missing
    try:
        return import_module("distributed")
    except ModuleNotFoundError as error:
        raise InputError(
            "Dask is not installed", code=Code.NO_DASK, hint="install it with: pip install 'handeye[cluster]'"
        ) from error


def _run(
    distributed: Any,  # noqa: ANN401
    client: Any,  # noqa: ANN401
    work: Callable[[T], R],
    pieces: Sequence[T],
) -> Generator[tuple[int, R]]:
    run = uuid.uuid4().hex
    program = program_digest()
    deaths: dict[int, int] = {}
    waiting: dict[Any, int] = {}
    completed: Any = distributed.as_completed(loop=client.loop, raise_errors=False)
    left = iter(range(len(pieces)))

    def send(index: int) -> None:
        # A key of its own: nothing is taken from, or kept for, another run.
        key = f"handeye-{run}-{index}-{deaths.get(index, 0)}"
        future = client.submit(at_worker, work, pieces[index], program, key=key, pure=False)
        waiting[future] = index
        completed.add(future)

    def fill() -> None:
        while len(waiting) < (1 + AHEAD) * max(1, sum(client.ncores().values())):
            index = next(left, None)
            if index is None:
                return
            send(index)

    fill()
    while waiting:
        future = next(completed)
        index = waiting.pop(future)
        error: Any = future.exception() if future.status != "finished" else None
        if error is None and future.status == "finished":
            result: R = future.result()
            future.release()
            fill()
            yield index, result
            continue
        if isinstance(error, distributed.KilledWorker) or future.status in {"cancelled", "lost"}:
            deaths[index] = deaths.get(index, 0) + 1
            if deaths[index] < MOST_DEATHS:
                send(index)
                continue
            raise HandeyeError(
                f"piece {index}: its worker died {deaths[index]} times", code=Code.WORKERS_DIE
            ) from error
        if not isinstance(error, BaseException):
            raise HandeyeError(f"piece {index}: {future.status}", code=Code.CLUSTER_FAILED)
        raise error


def at_worker(work: Callable[[T], R], piece: T, program: str) -> R:
    """Do a piece at a worker, if it runs the same program as the caller.

    Raises
    ------
    InputError
        It runs another.
    """
    if program_digest() != program:
        raise InputError(
            "a worker of the cluster runs another version of handeye or of its libraries",
            code=Code.OTHER_PROGRAM,
            hint="install the same package everywhere: results would not be the same",
        )
    return work(piece)
