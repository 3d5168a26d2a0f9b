"""The same results for any number of processes, progress, errors and interruption."""

import os

import pytest

from handeye.compute.parallel import part_of, run_all
from handeye.errors import InputError


def square(number: int) -> tuple[int, int]:
    return number**2, os.getpid()


def refuse(number: int) -> int:
    if number == 3:
        raise InputError("three", code="three", hint="two")
    return number


def interrupt(number: int) -> int:
    if number == 1:
        raise KeyboardInterrupt
    return number


@pytest.mark.parametrize("workers", [1, 2])
def test_results_are_in_order_and_progress_is_told(workers: int) -> None:
    told: list[tuple[int, int]] = []
    results = run_all(square, range(7), workers=workers, progress=lambda *step: told.append(step))
    assert [value for value, _ in results] == [n**2 for n in range(7)]
    assert told == [(done, 7) for done in range(8)]
    elsewhere = {process for _, process in results} - {os.getpid()}
    assert bool(elsewhere) == (workers > 1)


@pytest.mark.parametrize("workers", [1, 2])
def test_errors_arrive_whole(workers: int) -> None:
    with pytest.raises(InputError, match="three") as caught:
        run_all(refuse, range(6), workers=workers)
    assert (caught.value.code, caught.value.hint) == ("three", "two")


def test_an_interruption_ends_the_work_and_leaves_room_for_the_next() -> None:
    with pytest.raises(KeyboardInterrupt):
        run_all(interrupt, range(4), workers=1)
    told: list[int] = []

    def stop(done: int, _: int) -> None:
        told.append(done)
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_all(square, range(50), workers=2, progress=stop)
    assert told == [0, 1, 2]
    assert [value for value, _ in run_all(square, range(3), workers=2)] == [0, 1, 4]


def test_no_pieces_and_no_workers() -> None:
    assert run_all(square, [], workers=4) == []
    with pytest.raises(InputError):
        run_all(square, [1], workers=0)


def test_a_part_counts_on_from_what_came_before() -> None:
    told: list[tuple[int, int]] = []
    part = part_of(lambda *step: told.append(step), 10, 14)
    run_all(square, range(4), progress=part)
    assert told == [(10 + done, 14) for done in range(5)]
    assert part_of(None, 1, 2) is None
