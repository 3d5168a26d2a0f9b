"""Arms that are not six joints in a row: a loop of views in simulation, and a plan from what it took.

Arms that turn about one axis only are told the height of the target, which no view of theirs shows.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from commands import Handeye
from handeye.errors import ExitCode
from handeye.estimation.height import Height
from handeye.robots import Arm, Joint, open_arm
from handeye.robots.corrected import urdf_of
from handeye.session.configuration import prepare
from handeye.session.deciding import EndReason
from handeye.session.settings import Configuration, Simulation
from handeye.studies.cheap_arm import five_joint_arm
from handeye.types import Chessboard, Mounting, Pose
from sessions import run

DOWN = Pose.exp([0, 0, 0, np.pi, 0, 0])
BOARD = Chessboard(5, 7, 0.01)
HEIGHT_SIGMA_M = 1e-3


def at(x: float, y: float, z: float) -> Pose:
    return Pose.exp([x, y, z, 0, 0, 0])


def scara() -> Arm:
    shoulder = Joint("shoulder", at(0, 0, 0.45), lower=-2.3, upper=2.3)
    elbow = Joint("elbow", at(0.35, 0, 0), lower=-2.5, upper=2.5)
    quill = Joint("quill", at(0.3, 0, 0) @ DOWN, sliding=True, lower=0.0, upper=0.3)
    return Arm("scara", (shoulder, elbow, quill, Joint("roll", Pose.identity(), lower=-3.1, upper=3.1)))


def gantry() -> Arm:
    x = Joint("x", at(0, 0, 0.9), (1.0, 0.0, 0.0), sliding=True, lower=0.0, upper=0.8)
    y = Joint("y", Pose.identity(), (0.0, 1.0, 0.0), sliding=True, lower=-0.4, upper=0.4)
    z = Joint("z", DOWN, sliding=True, lower=0.0, upper=0.5)
    return Arm("gantry", (x, y, z, Joint("roll", Pose.identity(), lower=-3.1, upper=3.1)))


def on_a_rail() -> Arm:
    arm = open_arm("ur5e")
    rail = Joint("rail", at(0, 0, 0.2), (0.0, 1.0, 0.0), sliding=True, lower=-0.5, upper=0.5)
    return Arm("on_a_rail", (rail, *arm.joints), arm.T_last_flange)


def before_a_turntable() -> Arm:
    """The base is the plate, which turns: what lies on it lies still in its frame."""
    arm = open_arm("ur5e")
    first = replace(arm.joints[0], placement=at(-0.5, 0, 0.1) @ arm.joints[0].placement)
    plate = Joint("plate", at(0, 0, 0.1), lower=-2.0, upper=2.0)
    return Arm("before_a_turntable", (plate, first, *arm.joints[1:]), arm.T_last_flange)


def configured(arm: Arm, mounting: Mounting, folder: Path) -> Configuration:
    description = folder / f"{arm.name}.urdf"
    description.write_text(urdf_of(arm))
    return Configuration(
        str(description),
        mounting=mounting,
        accuracy_mm=4.0,
        accuracy_deg=0.5,
        most_views=14,
        simulation=Simulation(points_only=0.1),
        limits=replace(Configuration("ur5e").limits, distance_m=(0.1, 0.9)),
    )


@pytest.mark.parametrize("mounting", list(Mounting))
@pytest.mark.parametrize("make", [scara, gantry], ids=lambda make: make.__name__)
def test_four_axes_with_a_height(make: type, mounting: Mounting, tmp_path: Path, handeye: Handeye) -> None:
    configuration = configured(make(), mounting, tmp_path)
    truth = prepare(configuration, target=BOARD).truth
    assert truth is not None
    assert truth.X is not None
    assert truth.Y is not None
    middle = truth.Y.act(BOARD.points.mean(axis=0)[np.newaxis])[0]
    height = Height(float(middle[2]) + HEIGHT_SIGMA_M, HEIGHT_SIGMA_M)
    end = run(replace(configuration, height=height), tmp_path / "told", target=BOARD)
    assert end.reason is EndReason.ACCURACY_REACHED
    assert end.calibration is not None
    off = end.calibration.X.inverse().matrix - truth.X.inverse().matrix
    assert 1e3 * np.linalg.norm(off[:3, 3]) < 4.0
    asked = ("--robot", configuration.robot or "", "--json")
    stated = ("--height-mm", str(1e3 * height.at_m), str(1e3 * HEIGHT_SIGMA_M))
    assert handeye("solve", tmp_path / "told", *asked).code == ExitCode.DEGENERATE
    solved = handeye.json("solve", tmp_path / "told", *asked[:2], *stated)
    assert solved["unobservable"] == []
    planned = handeye.json("plan", tmp_path / "told", *asked[:2], *stated)
    assert planned["ranking"]
    untold = run(configuration, tmp_path / "untold", target=BOARD)
    assert untold.calibration is None


@pytest.mark.parametrize("mounting", list(Mounting))
@pytest.mark.parametrize("make", [on_a_rail, before_a_turntable], ids=lambda make: make.__name__)
def test_a_joint_more(make: type, mounting: Mounting, tmp_path: Path, handeye: Handeye) -> None:
    configuration = configured(make(), mounting, tmp_path)
    end = run(configuration, tmp_path / "views")
    assert end.reason is EndReason.ACCURACY_REACHED
    first = end.calibration
    assert first is not None
    views = prepare(configuration).arm.joint_names
    assert len(views) == 7
    planned = handeye.json("plan", tmp_path / "views", "--robot", configuration.robot or "")
    assert planned["ranking"]


@pytest.mark.parametrize("mounting", list(Mounting))
def test_five_joints(mounting: Mounting, tmp_path: Path, handeye: Handeye) -> None:
    """As small as an SO-101: a camera in its hand stands a few centimetres over the board."""
    configuration = configured(five_joint_arm(), mounting, tmp_path)
    board = BOARD
    if mounting is Mounting.EYE_IN_HAND:
        near = replace(configuration.limits, distance_m=(0.03, 0.5))
        configuration, board = replace(configuration, seed=2, limits=near), Chessboard(5, 7, 0.003)
    end = run(configuration, tmp_path / "views", target=board)
    assert end.reason is EndReason.ACCURACY_REACHED
    planned = handeye.json("plan", tmp_path / "views", "--robot", configuration.robot or "")
    assert planned["ranking"]


@pytest.mark.parametrize("height", ["nan 1", "10 0", "10 200"])
def test_heights_that_say_nothing(handeye: Handeye, tmp_path: Path, height: str) -> None:
    assert handeye.fails("run", "--session", tmp_path / "s", "--height-mm", *height.split())["code"]
