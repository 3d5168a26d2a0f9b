"""What every importer must do."""

import hashlib
import shutil
from pathlib import Path

import pytest

from handeye.datasets import Imported, Importer, ImportOptions
from handeye.errors import InputError


class ImporterTests:
    """Subclass it and give the fixtures `importer` and `layout`, a folder (or file) that it reads.

    `options`, what the files leave open, where there is such a thing.

    Examples
    --------
    >>> class TestMine(ImporterTests):  # with the fixtures `importer` and `layout`
    ...     pass
    >>> hasattr(TestMine, "test_knows_its_own")
    True
    """

    @pytest.fixture
    def options(self) -> ImportOptions:
        """Nothing is left open."""
        return ImportOptions()

    def test_knows_its_own(self, importer: Importer, layout: Path, options: ImportOptions) -> None:
        """It recognises its layout, and reads pictures or poses from it."""
        assert importer.name.strip()
        assert importer.looks_like.strip()
        assert importer.recognises(layout)
        assert isinstance(importer.read(layout, options), Imported)

    def test_leaves_others_alone(self, importer: Importer, tmp_path: Path) -> None:
        """What is empty, missing or something else is not recognised, and raises nothing."""
        empty = tmp_path / "empty"
        empty.mkdir()
        other = tmp_path / "other"
        other.mkdir()
        (other / "notes.txt").write_bytes(bytes(range(256)))
        (other / "data.json").write_text('{"a": [1, 2')
        for place in (empty, other, other / "notes.txt", tmp_path / "missing"):
            assert not importer.recognises(place), place.name

    def test_writes_nothing(self, importer: Importer, layout: Path, options: ImportOptions) -> None:
        """The folder is as before."""
        before = _digests(layout)
        importer.read(layout, options)
        assert _digests(layout) == before

    def test_a_broken_file_is_an_input_error(
        self, importer: Importer, layout: Path, options: ImportOptions, tmp_path: Path
    ) -> None:
        """Each file cut in half, emptied, or filled with noise: read all the same, or refused in words."""
        files = [path.relative_to(layout) for path in _files(layout)] if layout.is_dir() else [Path()]
        for number, file in enumerate(files):
            for kind, change in enumerate((_half, _nothing, _noise)):
                copy = tmp_path / f"copy_{number}_{kind}" / layout.name
                copy.parent.mkdir()
                shutil.copytree(layout, copy) if layout.is_dir() else shutil.copy(layout, copy)
                broken = copy / file
                broken.write_bytes(change(broken.read_bytes()))
                try:
                    importer.recognises(copy)
                    importer.read(copy, options)
                except InputError as error:
                    assert error.message.strip()  # noqa: PT017 - any other error fails the test


def _half(content: bytes) -> bytes:
    return content[: len(content) // 2]


def _nothing(content: bytes) -> bytes:
    return content[:0]


def _noise(content: bytes) -> bytes:
    return hashlib.shake_128(content).digest(min(len(content), 4096))


def _files(layout: Path) -> list[Path]:
    return sorted(path for path in layout.rglob("*") if path.is_file()) if layout.is_dir() else [layout]


def _digests(layout: Path) -> dict[Path, bytes]:
    return {path: hashlib.blake2b(path.read_bytes()).digest() for path in _files(layout)}
