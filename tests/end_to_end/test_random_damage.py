"""Folders with random damage: an answer or an error with its own words, never a mistake of ours."""

import shutil
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from folders import made_recording, written
from handeye.cli.boundary import run
from strategies import mutated

KNOWN = {0, 3, 4, 5, 6}
WORDS = (b"nan", b"1e400", b"-", b"0.0", b"[[view]]", b"mounting", b"eye_to_hand", b"\xff", b"1e-300", b"1e9")


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    return written(made_recording(4), tmp_path_factory.mktemp("good") / "made")


@settings(max_examples=30)
@given(data=st.data(), command=st.sampled_from([("solve",), ("plan",), ("solve", "--model", "paper")]))
def test_random_damage(good: Path, data: st.DataObject, command: tuple[str, ...]) -> None:
    with TemporaryDirectory() as scratch:
        folder = Path(scratch) / "made"
        shutil.copytree(good, folder)
        files = sorted(path for path in folder.rglob("*") if path.is_file())
        for path in data.draw(st.lists(st.sampled_from(files), min_size=1, max_size=2, unique=True)):
            path.write_bytes(data.draw(mutated(path.read_bytes(), WORDS)))
        out, err = StringIO(), StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            code = run([*command, str(folder), "--json"])
    assert code in KNOWN, err.getvalue()
    assert out.getvalue().startswith("{")
