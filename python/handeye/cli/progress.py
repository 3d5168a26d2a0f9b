"""Telling a person how far long work has got, on stderr, so that stdout stays the answer."""

from collections.abc import Callable, Generator
from contextlib import contextmanager


@contextmanager
def progress(description: str, total: int) -> Generator[Callable[[int], None]]:
    """Give a function that says how many of `total` steps are done.

    A bar on a terminal; elsewhere, such as in a log, one line.
    """
    from rich.console import Console  # noqa: PLC0415 - only commands with long work need it
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn  # noqa: PLC0415

    console = Console(stderr=True)
    if not console.is_terminal:
        console.print(f"{description} ({total}) ...", highlight=False, markup=False)
        yield lambda _: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(description, total=total)
        yield lambda done: bar.update(task, completed=done)
