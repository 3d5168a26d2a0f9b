"""Sets are found, read once, and remembered by their content."""

from pathlib import Path

import numpy as np
import pytest

from handeye.datasets import write_recording
from handeye.errors import InputError
from handeye.importing import open_folder
from handeye.simulation.cells import ErrorKind, simulate
from handeye.studies import data


@pytest.fixture
def sets(tmp_path: Path) -> Path:
    """A folder with two recordings, one of them where the published sets are."""
    (tmp_path / "rwhe-calib").mkdir()
    write_recording(simulate(ErrorKind.PIXEL_ONLY, 0), tmp_path / "near")
    write_recording(simulate(ErrorKind.PIXEL_ONLY, 1), tmp_path / "rwhe-calib" / "far")
    return tmp_path


def test_sets_are_found_in_either_place_and_carry_their_folders_name(sets: Path) -> None:
    near, far = data.load_sets(sets, ["near", "far"])
    assert (near.name, far.name) == ("near", "far")
    assert near.views == simulate(ErrorKind.PIXEL_ONLY, 0).views
    with pytest.raises(InputError, match="no set other"):
        data.load_sets(sets, ["near", "other"])


def test_the_second_time_nothing_is_read_anew(
    sets: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[Path] = []

    def counted(path: Path) -> object:
        read.append(path)
        return open_folder(path)

    monkeypatch.setattr(data, "open_folder", counted)
    cache = tmp_path / "cache" / "deep"
    first = data.load_sets(sets, ["near"], cache=cache)
    assert data.load_sets(sets, ["near"], cache=cache) == first
    assert len(read) == 1
    # Other content, other memory; and a damaged memory is none.
    table = next((sets / "near" / "corners").iterdir())
    table.write_text(table.read_text().replace("0,", "0,", 1) + "\n")
    data.load_sets(sets, ["near"], cache=cache)
    assert len(read) == 2
    for file in cache.rglob("recording.toml"):
        file.write_text("garbage")
    assert data.load_sets(sets, ["near"], cache=cache) == first
    assert len(read) == 3


def test_a_place_that_cannot_remember_does_no_harm(sets: Path, tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    assert data.load_sets(sets, ["near"], cache=blocked / "cache") == data.load_sets(sets, ["near"])


def test_the_folder_is_given_or_named(sets: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(data.DATA_VARIABLE, str(sets))
    assert data.data_folder() == sets
    assert data.data_folder(sets / "near") == sets / "near"
    monkeypatch.delenv(data.DATA_VARIABLE)
    with pytest.raises(InputError, match="no folder"):
        data.data_folder()
    with pytest.raises(InputError, match="no such folder"):
        data.data_folder(sets / "missing")


def test_the_cache_is_where_the_system_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(data.CACHE_VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert data.cache_folder() == tmp_path / "handeye"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert data.cache_folder() == Path.home() / ".cache" / "handeye"
    monkeypatch.setenv(data.CACHE_VARIABLE, str(tmp_path / "own"))
    assert data.cache_folder() == tmp_path / "own"


def test_a_published_set_is_searched_and_its_camera_calibrated(rwhe_calib: Path, tmp_path: Path) -> None:
    (found,) = data.load_sets(rwhe_calib.parent, ["CS_synthetic_1"], cache=tmp_path)
    assert len(found) == 15
    assert found.camera.covariance is not None
    np.testing.assert_allclose(found.camera.parameters[:2], 1080, atol=3)
    (again,) = data.load_sets(rwhe_calib, ["CS_synthetic_1"], cache=tmp_path)
    np.testing.assert_array_equal(again.camera.parameters, found.camera.parameters)
    np.testing.assert_array_equal(again.camera.covariance, found.camera.covariance)
