"""Many independent pieces of work on several processes, with the same results however many there are."""

import warnings
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol, TypeVar

from joblib import Parallel, delayed, parallel_config  # pyright: ignore[reportUnknownVariableType]

from handeye.codes import Code
from handeye.errors import InputError

T = TypeVar("T")
R = TypeVar("R")

Progress = Callable[[int, int], None]
"""Is told how many pieces are done, of how many."""


class Executor(Protocol):
    """Something that works pieces off, here or elsewhere."""

    def run(self, work: Callable[[T], R], pieces: Sequence[T]) -> Generator[tuple[int, R]]:
        """Yield the index and the result of each piece, in the order in which they finish."""
        ...


Workers = int | Executor
"""A number of processes of this machine (1: this one), or another executor, such as a cluster."""


def run_all(
    work: Callable[[T], R],
    pieces: Sequence[T],
    *,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> list[R]:
    """Return the results of all pieces, in their order.

    Each piece must carry its own seed: then the results are the same to the last bit whatever the number of
    processes and wherever they are. Ctrl-C ends the processes too.

    Parameters
    ----------
    work
        A function of a module, so that another process finds it.
    pieces
        What to call it with; enough pieces of equal size keep all processes busy.
    workers
        Number of processes, or another executor.
    progress
        Told how many pieces are done, of how many; first with none done.

    Raises
    ------
    InputError
        Fewer than one process.
    """
    told = progress or _nothing
    results: dict[int, R] = {}
    told(0, len(pieces))
    finished = run_each(work, pieces, workers)
    try:
        for index, result in finished:
            results[index] = result
            told(len(results), len(pieces))
    finally:
        finished.close()
    return [results[index] for index in range(len(pieces))]


def run_each(work: Callable[[T], R], pieces: Sequence[T], workers: Workers) -> Generator[tuple[int, R]]:
    """Yield the index and the result of each piece as it is finished.

    Raises
    ------
    InputError
        Fewer than one process.
    """
    if not isinstance(workers, int):
        return workers.run(work, pieces)
    if workers < 1:
        raise InputError(f"{workers} workers, expected at least 1", code=Code.OUT_OF_RANGE)
    if workers == 1 or len(pieces) < 2:
        return _here(work, pieces)
    return _processes(work, pieces, workers)


def _here(work: Callable[[T], R], pieces: Sequence[T]) -> Generator[tuple[int, R]]:
    for index, piece in enumerate(pieces):
        yield index, work(piece)


def _processes(work: Callable[[T], R], pieces: Sequence[T], workers: int) -> Generator[tuple[int, R]]:
    # Threads inside the processes would only compete.
    with parallel_config(backend="loky", inner_max_num_threads=1):
        # One piece at a time: the slowest process holds up the others by one piece at most.
        one: Any = 1
        pool: Any = Parallel(n_jobs=min(workers, len(pieces)), batch_size=one, return_as="generator")
        results: Generator[R] = pool(delayed(work)(piece) for piece in pieces)
        with _left_without_a_word(results):
            yield from enumerate(results)


@contextmanager
def _left_without_a_word(results: Generator[R]) -> Generator[None]:
    """End the processes when results are left early, by an error or Ctrl-C: joblib would warn of it."""
    try:
        yield
    finally:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message=".*tasks ", category=UserWarning, module="joblib")
            results.close()


def _nothing(done: int, total: int) -> None:
    """Report nothing."""


def part_of(progress: Progress | None, before: int, total: int) -> Progress | None:
    """Return the progress of a part of a larger work, of which `before` pieces come first."""
    if progress is None:
        return None
    return lambda done, _: progress(before + done, total)
