"""The drivers of this package keep the contract, and the contract finds those that do not."""

from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from threading import Timer
from types import ModuleType

import cv2
import numpy as np
import pytest

from handeye.cameras.folder import WatchedFolder
from handeye.cameras.protocol import Frame
from handeye.cameras.replay import ReplayCamera
from handeye.datasets.images import read_image
from handeye.errors import DeviceError, InputError
from handeye.extension import CAMERAS, ROBOTS, announced
from handeye.notations import MAKERS, Notation, pose_text
from handeye.robots import open_arm
from handeye.robots.manual import ManualRobot
from handeye.robots.protocol import Goal, Reading
from handeye.robots.replay import ReplayRobot
from handeye.robots.simulated import ArmErrors, SimulatedArm
from handeye.session.contract import check_camera, check_robot
from handeye.session.drivers import Person, open_camera, open_robot
from handeye.session.simulated import looking_down, surrounding
from handeye.types import Pose, View

ARM = open_arm("ur5e")
HOME = looking_down(ARM, surrounding(ARM))[1]
FAR = Goal("far", Pose.exp([9.0, 0, 0, 0, 0, 0]))
NOBODY = Person(lambda _: "skip", lambda _: None)


def goals() -> list[Goal]:
    postures = [np.array(HOME) + offset for offset in (0.0, 0.05, -0.1)]
    return [Goal(f"view_{i:02d}.1", Pose(ARM.forward(q)), tuple(q)) for i, q in enumerate(postures, 1)]


# They speak their protocols themselves.
WITHOUT_LIBRARY = {"ur", "xarm"}
POINTS = [
    point
    for group in (ROBOTS, CAMERAS)
    for point in announced(group).values()
    if point.value.startswith("handeye.") and point.name not in WITHOUT_LIBRARY
]


@pytest.mark.parametrize("point", POINTS, ids=[f"{point.group}.{point.name}" for point in POINTS])
def test_a_driver_without_its_library_says_what_it_would_need(
    point: EntryPoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent(name: str) -> ModuleType:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)

    driver = point.load()
    monkeypatch.setattr("handeye.extension.import_module", absent)
    with pytest.raises(DeviceError) as caught:
        driver.found()
    assert caught.value.code == "library_missing"
    assert caught.value.hint == f"pip install 'handeye[{point.name}]'" or "source ROS 2" in caught.value.hint


def test_the_simulated_arm_keeps_the_contract() -> None:
    arm = SimulatedArm(ARM, ArmErrors(backlash_rad=1e-3, offset_sigma_rad=1e-3), 0, HOME)
    assert check_robot(arm, goals(), FAR) == []


def test_a_replay_keeps_the_contract() -> None:
    views = [View(f"v{i}", goal.T_base_flange, [0], [[1.0, 2.0]]) for i, goal in enumerate(goals())]
    robot = ReplayRobot(views)
    assert check_robot(robot, goals(), FAR) == []
    assert check_camera(ReplayCamera(lambda: robot.view)) == []
    assert ReplayCamera(lambda: robot.view).grab("x").points is not None
    with pytest.raises(DeviceError):
        ReplayCamera(lambda: None).grab("x")


@pytest.mark.parametrize("notation", MAKERS, ids=lambda notation: notation.name)
def test_a_person_keeps_the_contract(notation: Notation, tmp_path: Path) -> None:
    texts = [pose_text(goal.T_base_flange, notation) for goal in goals()]
    (tmp_path / "pose.txt").write_text(texts[-1])
    told: list[str] = []
    answers: Iterator[str] = iter([texts[0], "rubbish", texts[1], str(tmp_path / "pose.txt"), "skip"])
    robot = ManualRobot(lambda _: next(answers), told.append, notation)
    assert check_robot(robot, goals(), FAR) == []
    assert texts[0] in told[0]
    assert "joints" in told[0]
    assert any("expected" in text or "missing" in text for text in told)


def test_the_contract_finds_degrees_millimetres_and_early_returns() -> None:
    class Sloppy:
        def __init__(self) -> None:
            self.at = Pose.identity()
            self.reads = 0

        def move_to(self, goal: Goal) -> None:
            self.at = goal.T_base_flange

        def read_pose(self) -> Reading:
            self.reads += 1
            drift = Pose.exp([1e-3 * self.reads, 0, 0, 0, 0, 0])
            matrix = (drift @ self.at).matrix.copy()
            matrix[:3, 3] *= 1000.0
            return Reading(Pose(matrix), tuple(np.rad2deg(HOME)))

        def stop(self) -> None:
            raise OSError("no connection")

    wrong = " ".join(check_robot(Sloppy(), goals(), FAR))
    for words in ("metres", "radians", "before the arm rests", "must refuse", "stop at rest"):
        assert words in wrong


def test_a_watched_folder_gives_the_next_picture_only(tmp_path: Path) -> None:
    picture = np.arange(100, dtype=np.uint8).reshape(10, 10)
    cv2.imwrite(str(tmp_path / "old.png"), picture)
    camera = WatchedFolder(tmp_path, read_image, patience_s=20.0)
    Timer(0.1, lambda: cv2.imwrite(str(tmp_path / "new.png"), picture + 1)).start()
    frame = camera.grab("view_01.1")
    assert frame.image is not None
    assert np.array_equal(frame.image, picture + 1)
    quick = WatchedFolder(tmp_path, read_image, patience_s=0.1)
    with pytest.raises(DeviceError) as error:
        quick.grab("view_01.2")
    assert error.value.code == "timeout"
    (tmp_path / "broken.png").write_bytes(b"no picture")
    with pytest.raises(DeviceError) as error:
        quick.grab("view_01.3")
    assert error.value.code in {"bad_image", "timeout"}


def test_drivers_are_found_by_name() -> None:
    assert isinstance(open_robot("manual:kuka", NOBODY), ManualRobot)
    with pytest.raises(InputError, match="expected one of"):
        open_robot("nobodys_robot:1.2.3.4", NOBODY)
    with pytest.raises(InputError, match="notation"):
        open_robot("manual:klingon", NOBODY)
    with pytest.raises(InputError, match="replayed robot"):
        open_camera("replay:x", open_robot("manual", NOBODY), NOBODY)


def test_a_frame_is_grey_or_points() -> None:
    with pytest.raises(InputError):
        Frame(None)
    with pytest.raises(InputError):
        Frame(np.zeros((4, 4, 3), dtype=np.uint8))
