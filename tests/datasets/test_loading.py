"""One door for all data."""

from pathlib import Path

import pytest

from datasets.layouts import some_recording, write_rct, write_rwhe
from handeye.datasets import IMPORTERS, ImageSet, LoadedRecording, load, write_recording
from handeye.errors import InputError
from handeye.types import Mounting


def test_layouts_are_recognised(tmp_path: Path) -> None:
    write_recording(some_recording(), tmp_path / "a")
    write_rwhe(tmp_path / "b")
    write_rct(tmp_path / "c")
    loaded = load(tmp_path / "a")
    assert isinstance(loaded, LoadedRecording)
    assert loaded.recording == some_recording()
    for name, layout in (("b", "rwhe-calib"), ("c", "robot_cal_tools")):
        for path in (tmp_path / name, str(tmp_path / name)):
            found = load(path, pattern=(3, 4))
            assert isinstance(found, ImageSet)
            assert found.layout == layout
            assert found.name == name


def test_the_file_that_tells_the_layout_will_do(tmp_path: Path) -> None:
    write_recording(some_recording(), tmp_path / "a")
    assert isinstance(load(tmp_path / "a" / "recording.toml"), LoadedRecording)
    assert isinstance(load(write_rct(tmp_path / "c") / "cal_data.yaml"), ImageSet)


def test_two_layouts_at_once_need_a_name(tmp_path: Path) -> None:
    folder = write_rct(write_rwhe(tmp_path / "both"))
    with pytest.raises(InputError, match="rwhe-calib and robot_cal_tools") as caught:
        load(folder)
    assert caught.value.code == "ambiguous_format"
    found = load(folder, layout="robot_cal_tools")
    assert isinstance(found, ImageSet)
    assert found.layout == "robot_cal_tools"
    with pytest.raises(InputError, match="expected one of"):
        load(folder, layout="rosbag")


def test_options_that_would_have_no_effect_are_refused(tmp_path: Path) -> None:
    write_recording(some_recording(), tmp_path / "a")
    with pytest.raises(InputError) as caught:
        load(tmp_path / "a", mounting=Mounting.EYE_TO_HAND)
    assert caught.value.code == "options_unused"


def test_what_is_not_recognised_says_what_would_be(tmp_path: Path) -> None:
    write_rwhe(tmp_path / "kuka_1")
    (tmp_path / "other").mkdir()
    with pytest.raises(InputError) as caught:
        load(tmp_path)
    assert caught.value.code == "unknown_format"
    for importer in IMPORTERS.values():
        assert importer.looks_like in caught.value.message
    assert caught.value.hint is not None
    assert "kuka_1" in caught.value.hint
    assert "other" not in caught.value.hint


@pytest.mark.parametrize("name", ["poses.mat", "poses.pkl", "poses.pickle", "poses.npy", "POSES.MAT"])
def test_files_that_could_run_code_are_never_loaded(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"cos\nsystem\n(S'false'\ntR.")
    with pytest.raises(InputError, match="never loaded"):
        load(tmp_path / name)


@pytest.mark.parametrize("path", ["no/such/folder", "", "a\0b", "x" * 5000])
def test_places_that_are_none(tmp_path: Path, path: str) -> None:
    with pytest.raises(InputError):
        load(tmp_path / path)
    with pytest.raises(InputError):
        load(path or tmp_path)


@pytest.mark.parametrize("names", [("episode_0.parquet",), ("meta/info.json", "data/chunk-000/a.parquet")])
def test_parquet_is_said_not_to_be_read(tmp_path: Path, names: tuple[str, ...]) -> None:
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"PAR1")
    with pytest.raises(InputError) as caught:
        load(tmp_path)
    assert "Parquet is not read" in str(caught.value.hint)
