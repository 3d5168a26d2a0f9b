"""Files of strangers: whatever they hold, the caller sees our errors and no others."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from datasets.layouts import RCT_FILES, some_recording, write_rct, write_rwhe
from datasets.test_pose_pairs import easy_samples, moveit_samples, stations, visp_pose
from handeye.datasets import load, read_poses, read_recording, write_recording
from handeye.errors import InputError
from handeye.types import Mounting, Pose
from importing.test_streams import WRITERS, certifiable
from strategies import mutated

WORDS = [
    b"version = 2",
    b"[[view]]\n",
    b"= [[[[",
    b"&a [*a, *a]",
    b"!!int ''",
    b"\n- ",
    b"id,u_px,v_px\n",
    b"1:30:00",
]
LAYOUTS = ("easy_handeye2", "moveit", "visp", *WRITERS, "certifiable")
EXAMPLES = settings(max_examples=3 * settings().max_examples)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("hostile") / "rec"
    write_recording(some_recording(2), folder)
    return folder


@pytest.fixture(scope="module")
def rwhe(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_rwhe(tmp_path_factory.mktemp("hostile") / "rwhe", 2)


@pytest.fixture(scope="module")
def rct(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_rct(tmp_path_factory.mktemp("hostile") / "rct")


def attack(data: st.DataObject, folder: Path, names: list[str], **options: object) -> None:
    """Load a folder with one file mutated or replaced; then put it back."""
    path = folder / data.draw(st.sampled_from(names))
    original = path.read_bytes()
    path.write_bytes(data.draw(mutated(original, WORDS) | st.binary(max_size=300)))
    try:
        load(folder, **options)  # type: ignore[arg-type]
    except InputError:
        pass
    finally:
        path.write_bytes(original)


@EXAMPLES
@given(st.data())
def test_recordings(recording: Path, data: st.DataObject) -> None:
    attack(data, recording, ["recording.toml", "recording.toml", "corners/im_0.csv"])


@EXAMPLES
@given(st.data())
def test_rwhe_calib(rwhe: Path, data: st.DataObject) -> None:
    names = ["RobotPosesVec.txt", "square size.txt", "GroundTruth.txt", "im_8.png"]
    attack(data, rwhe, names, pattern=(3, 4))


@EXAMPLES
@given(st.data())
def test_robot_cal_tools(rct: Path, data: st.DataObject) -> None:
    attack(data, rct, list(RCT_FILES))


@pytest.fixture(scope="module")
def without_pictures(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return poses_alone(tmp_path_factory.mktemp("hostile"))


def poses_alone(root: Path, listed: Sequence[tuple[Pose, Pose]] = ()) -> dict[str, Path]:
    """Write one small set of every layout that has poses in the place of pictures."""
    listed = listed or stations(Mounting.EYE_IN_HAND, 3)
    times = [0.1 * k for k in range(len(listed))]
    streams = times, [pose for pose, _ in listed], times, [seen for _, seen in listed]
    folders = {name: root / name for name in LAYOUTS}
    for folder in folders.values():
        folder.mkdir()
    (folders["easy_handeye2"] / "a.samples").write_text(easy_samples(Mounting.EYE_IN_HAND, listed=listed))
    (folders["moveit"] / "samples.yaml").write_text(moveit_samples(listed))
    for k, (pose, seen) in enumerate(listed, start=1):
        (folders["visp"] / f"pose_rPe_{k}.yaml").write_text(visp_pose(pose))
        (folders["visp"] / f"pose_cPo_{k}.yaml").write_text(visp_pose(seen))
    for name, write in WRITERS.items():
        write(folders[name], streams)
    certifiable(folders["certifiable"], listed)
    return folders


@given(st.data())
@pytest.mark.parametrize("name", LAYOUTS)
def test_poses_without_pictures(without_pictures: dict[str, Path], name: str, data: st.DataObject) -> None:
    folder = without_pictures[name]
    names = [path.name for path in sorted(folder.iterdir())]
    attack(data, folder, names, mounting=Mounting.EYE_IN_HAND)


@EXAMPLES
@given(st.data())
def test_poses(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "poses.csv"
    good = b"name,x,y,z,qx,qy,qz,qw\na,1,2,3,0,0,0,1\nb,0.1,0.2,0.3,0.6,0,0,0.8\n"
    path.write_bytes(data.draw(mutated(good, WORDS) | st.binary(max_size=300)))
    try:
        table = read_poses(path)
    except InputError:
        return
    assert len(table.names) == len(table.poses) > 0


def test_every_truncation_of_a_recording_is_noticed(recording: Path) -> None:
    path = recording / "recording.toml"
    original = path.read_text()
    try:
        for length in range(0, len(original) - 1, 7):
            path.write_text(original[:length])
            with pytest.raises(InputError):
                read_recording(recording)
    finally:
        path.write_text(original)


@given(st.text(max_size=60))
def test_paths(tmp_path: Path, text: str) -> None:
    for path in (text, tmp_path / text):
        try:
            load(path)
        except InputError:
            continue
