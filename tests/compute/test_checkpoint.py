"""Finished pieces are not done again, whatever happened to the process or the file in between."""

import subprocess
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from handeye.compute.checkpoint import FILE, Checkpoint
from handeye.compute.digest import Digester
from handeye.compute.parallel import run_all
from handeye.errors import InputError
from handeye.simulation.cells import ErrorKind, simulate


@dataclass(frozen=True)
class Result:
    value: float
    numbers: tuple[int, ...]
    by_name: dict[str, tuple[float, ...]]


DONE: list[float] = []


def compute(piece: float) -> Result:
    DONE.append(piece)
    return Result(float(np.sin(piece)), (1, 2), {"nan": (float("nan"), float("inf"), piece)})


def add(piece: int, more: int) -> int:
    DONE.append(piece)
    return piece + more


def stop(piece: int) -> int:
    if piece == 3:
        raise KeyboardInterrupt
    return piece


@pytest.fixture(autouse=True)
def nothing_done() -> None:
    DONE.clear()


def same(found: list[Result], expected: list[Result]) -> bool:
    # NaN differs from itself; what is printed of a number is all of it.
    return repr(found) == repr(expected)


def test_pieces_are_done_once(tmp_path: Path) -> None:
    pieces = [0.1 * i for i in range(8)]
    expected = [compute(piece) for piece in pieces]
    DONE.clear()
    assert same(run_all(compute, pieces[:5], workers=Checkpoint(tmp_path)), expected[:5])
    told: list[tuple[int, int]] = []
    found = run_all(compute, pieces, workers=Checkpoint(tmp_path), progress=lambda *step: told.append(step))
    assert same(found, expected)
    assert pieces == DONE
    assert told == [(n, 8) for n in range(9)]
    # Another order, and some twice, change nothing.
    assert same(run_all(compute, pieces[::-1], workers=Checkpoint(tmp_path)), expected[::-1])
    assert len(DONE) == 8


def test_other_work_and_other_arguments_are_other_pieces(tmp_path: Path) -> None:
    for more in (1, 2):
        found = run_all(partial(add, more=more), [1, 2], workers=Checkpoint(tmp_path))
        assert found == [1 + more, 2 + more]
    assert DONE == [1, 2, 1, 2]
    assert run_all(abs_of, [-1, -2], workers=Checkpoint(tmp_path)) == [1, 2]


def abs_of(piece: int) -> int:
    return abs(piece)


@pytest.mark.parametrize("workers", [1, 2])
def test_an_interruption_keeps_what_was_done(tmp_path: Path, workers: int) -> None:
    with pytest.raises(KeyboardInterrupt):
        run_all(stop, range(6), workers=Checkpoint(tmp_path))
    found = run_all(abs_of, range(6), workers=Checkpoint(tmp_path, workers))
    assert found == list(range(6))
    with pytest.raises(KeyboardInterrupt):
        run_all(stop, range(6), workers=Checkpoint(tmp_path))
    # Three pieces of `stop` and six of `abs_of`, each once.
    again = run_all(stop, range(3), workers=Checkpoint(tmp_path))
    assert again == [0, 1, 2]


@pytest.mark.parametrize("cut", range(1, 40, 3))
def test_a_record_that_was_cut_off_was_never_written(tmp_path: Path, cut: int) -> None:
    pieces = [0.5, 1.5, 2.5]
    run_all(compute, pieces, workers=Checkpoint(tmp_path))
    file = tmp_path / FILE
    whole = file.read_bytes()
    file.write_bytes(whole[:-cut])
    DONE.clear()
    run_all(compute, pieces, workers=Checkpoint(tmp_path))
    assert DONE == [2.5]
    assert file.read_bytes() == whole


def test_a_damaged_record_and_a_strange_file(tmp_path: Path) -> None:
    run_all(compute, [0.5, 1.5], workers=Checkpoint(tmp_path))
    file = tmp_path / FILE
    content = bytearray(file.read_bytes())
    content[-10] ^= 1
    file.write_bytes(content)
    DONE.clear()
    run_all(compute, [0.5, 1.5], workers=Checkpoint(tmp_path))
    assert DONE == [1.5]
    file.write_text("a diary")
    with pytest.raises(InputError) as caught:
        run_all(compute, [0.5], workers=Checkpoint(tmp_path))
    assert caught.value.code == "unknown_format"
    assert file.read_text() == "a diary"


def test_only_one_process_at_a_time(tmp_path: Path) -> None:
    pytest.importorskip("fcntl", reason="this system has no file locks of this kind")
    running = Checkpoint(tmp_path).run(abs_of, [1, 2])
    assert next(running) == (0, 1)
    with pytest.raises(InputError) as caught:
        run_all(abs_of, [1], workers=Checkpoint(tmp_path))
    assert caught.value.code == "in_use"
    running.close()
    assert run_all(abs_of, [1, 2], workers=Checkpoint(tmp_path)) == [1, 2]


def test_digests_tell_apart_what_differs_and_nothing_else() -> None:
    digest = Digester()
    one, same_one = simulate(ErrorKind.PIXEL_ONLY, 1), simulate(ErrorKind.PIXEL_ONLY, 1)
    other = simulate(ErrorKind.PIXEL_ONLY, 2)
    assert digest.of(one) == Digester().of(same_one)
    assert digest.of(one) != digest.of(other)
    different = [1, 1.0, "1", b"1", True, None, (), (1,), ((1,),), {"a": 1}, {"a": 2}, ErrorKind.ENCODER]
    different += [np.zeros(2), np.zeros((2, 1)), np.zeros(2, int), partial(add, more=1), partial(add, more=2)]
    different += [("a", "bc"), ("ab", "c"), add, abs_of, Result(1.0, (), {})]
    assert len({digest.of(value) for value in different}) == len(different)
    with pytest.raises(TypeError):
        digest.of(object())


def test_digests_are_the_same_in_another_process() -> None:
    program = (
        "from handeye.compute.digest import *; from handeye.simulation.cells import *;"
        "print(program_digest(), Digester().of(simulate(ErrorKind.ENCODER, 3)).hex())"
    )
    said = {
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    }
    assert len(said) == 1


def test_results_are_brought_to_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    monkeypatch.setattr("handeye.compute.checkpoint.os.fsync", synced.append)
    run_all(compute, [0.1, 0.2], workers=Checkpoint(tmp_path))
    assert synced
