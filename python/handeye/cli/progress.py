"""Telling a person how far long work has got, on stderr, so that stdout stays the answer."""

from collections.abc import Callable, Generator
from contextlib import contextmanager


@contextmanager
def progress(description: str) -> Generator[Callable[[int, int], None]]:
    """Give a function that says how many steps are done, of how many.

    From the first call on: a bar on a terminal; elsewhere, such as in a log, one line.
    """
    from rich.console import Console  # noqa: PLC0415 - only commands with long work need it
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn  # noqa: PLC0415

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    task = bar.add_task(description, start=False)
    begun = False

    def advance(done: int, total: int) -> None:
        nonlocal begun
        if not begun:
            begun = True
            bar.start()
            bar.start_task(task)
            if not console.is_terminal:
                console.print(f"{description} ({total}) ...", highlight=False, markup=False)
        bar.update(task, completed=done, total=total)

    try:
        yield advance
    finally:
        bar.stop()
