"""Whole calibrations by `handeye run` through the protocols of devices on loopback, judged by the truth.

A cell with a truth stands behind a controller and a camera; pictures are rendered. The controller is the
mock of Universal Robots (`--robot ur`) or franky-sim (`--robot franka`, which needs franky-control and
franky-sim), whose arm MuJoCo moves; the camera sees it there, with the errors of the cell's arm on top. The
camera is pylon's emulator (`--camera basler`, extra basler) or the cell itself (`--camera mock`).
`--robot ros2` is a cell in ROS 2 in a process of its own, with its own camera; a third process records a bag,
which is solved too (tools/make_ros2_peer.py makes the environment).

python tools/measure_drivers.py --camera basler --seeds 1 2 3
"""

import argparse
import io
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from handeye import extension
from handeye.cameras.protocol import Frame
from handeye.cli.boundary import run
from handeye.robots import read_urdf
from handeye.robots.drivers.franka import FrankaRobot
from handeye.robots.protocol import Goal
from handeye.session import drivers
from handeye.testing import MockCell
from handeye.testing.universal_robots import MockUniversalRobot
from handeye.types import Pose
from partners import simulated_franka

SPACE_MM = ("-1100", "-1100", "20", "1100", "1100", "1300")
SERIAL = "0815-0000"


class Shown(MockCell):
    """A cell whose picture lies in a file, new whenever the arm comes to rest: what an emulator shows."""

    file: Path | None = None

    def stand(self, joints_rad: tuple[float, ...] | None) -> None:
        """Come to rest, and show what is seen there."""
        super().stand(joints_rad)
        if self.file is not None:
            cv2.imwrite(str(self.file), self.picture(f"shown_{time.monotonic_ns()}"))


def emulated(cell: Shown, folder: Path) -> str:
    """Let pylon's emulator show the cell; return the specification of the camera."""
    from pypylon import pylon  # noqa: PLC0415 - only where it is asked for

    cell.file = folder / "scene.png"
    cell.stand(cell.start_rad)
    found = pylon.DeviceInfo()
    found.SetSerialNumber(SERIAL)
    camera = pylon.InstantCamera(pylon.TlFactory.GetInstance().CreateFirstDevice(found))
    camera.Open()
    camera.ImageFileMode.Value, camera.TestImageSelector.Value = "On", "Off"
    camera.ImageFilename.Value = str(cell.file)
    camera.Width.Value, camera.Height.Value = cell.camera.size_px
    pylon.FeaturePersistence.Save(str(folder / "camera.pfs"), camera.GetNodeMap())
    camera.Close()
    return f"basler:{SERIAL},{folder / 'camera.pfs'}"


def of_the_cell(cell: Shown) -> str:
    """Announce the cell itself as a camera; return its specification."""

    class Point(EntryPoint):
        def load(self) -> object:
            return lambda _: cell

    def announced(group: str) -> dict[str, EntryPoint]:
        found = extension.announced(group)
        return found | {"mock": Point("mock", "", group)} if group == extension.CAMERAS else found

    drivers.announced = announced
    return "mock"


@contextmanager
def universal_robot(arguments: argparse.Namespace, seed: int) -> Iterator[tuple[Shown, str, str]]:
    """Give a cell, the specification of its driver and the description of its arm."""
    cell = Shown("ur5e", seed=seed)
    controller = MockUniversalRobot(cell, pace=arguments.pace)
    try:
        yield cell, f"ur:{controller.address}", "ur5e"
    finally:
        controller.close()


class Followed(Shown):
    """A cell whose arm stands where the simulation of others has it."""

    qpos: Any = None

    def grab(self, label: str) -> Frame:
        """Look from where the simulated arm stands now."""
        if self.qpos is not None:
            self.stand(tuple(np.clip(self.qpos()[:7], *self.arm.limits.T).tolist()))
        return super().grab(label)


@contextmanager
def franka(_: argparse.Namespace, seed: int) -> Iterator[tuple[Shown, str, str]]:
    """Give a cell, the specification of its driver and the description of its arm."""
    import franky_sim  # noqa: PLC0415 - only where it is asked for

    described = Path(franky_sim.__file__).parent / "assets" / "fr3_clean.urdf"
    cell = Followed(read_urdf(described), seed=seed)
    with simulated_franka() as (address, joints, _):
        driver = FrankaRobot(address)
        start = cell.start_rad
        driver.move_to(Goal("start.1", Pose(cell.arm.forward(start)), start, 1.0))
        driver.close()
        cell.qpos = joints
        yield cell, f"franka:{address}", str(described)


@contextmanager
def started(*command: str) -> Iterator[None]:
    """Start a process that says when it is ready, and ends with its input."""
    process = subprocess.Popen(
        [sys.executable, *command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    try:
        yield
    finally:
        process.stdin.close()
        process.wait(60)


@contextmanager
def ros2(arguments: argparse.Namespace, seed: int) -> Iterator[tuple[Shown, str, str]]:
    """Give a cell, whose twin moves in another process, the specification of its driver, its arm."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    recorder = str(Path(__file__).parent / "record_ros2_bag.py")
    with (
        started("-m", "handeye.testing.ros2", "--seed", str(seed)),
        started(recorder, str(arguments.folder / "bag")),
    ):
        yield Shown("ur5e", seed=seed), "ros2:base=base,flange=flange", "ur5e"


def of_the_bag(cell: Shown, folder: Path, arm: str) -> Pose | None:
    """Return what the bag of a session is solved to; None where it is not."""
    printed = io.StringIO()
    command = ["solve", str(folder / "bag"), "--target", str(folder / "target.toml"), "--json"]
    command += ["--base-frame", "base", "--flange-frame", "flange", "--mounting", cell.mounting.value]
    command += ["--robot", arm, "--pose-topic", "/joint_states"]
    with redirect_stdout(printed):
        run(command)
    answer = json.loads(printed.getvalue())
    if "error" in answer:
        print(answer["error"])
    return Pose(answer["T_flange_camera"]) if "T_flange_camera" in answer else None


ROBOTS = {"ur": universal_robot, "franka": franka, "ros2": ros2}


def calibrated(arguments: argparse.Namespace, seed: int, folder: Path) -> dict[str, object]:
    """Run one calibration; return what came of it."""
    printed, began = io.StringIO(), time.monotonic()
    arguments.folder = folder
    with ROBOTS[arguments.robot](arguments, seed) as (cell, driver, arm):
        camera, target = cell.write(folder)
        if arguments.robot == "ros2":
            images = "ros2:/camera/image_raw"
        else:
            images = emulated(cell, folder) if arguments.camera == "basler" else of_the_cell(cell)
        command = ["run", "--session", str(folder / "session"), "--robot", arm, "--no-confirm", "--json"]
        command += ["--driver", driver, "--images", images, "--speed-deg-s", "60"]
        command += ["--camera", str(camera), "--target", str(target), "--workspace-mm", *SPACE_MM]
        with redirect_stdout(printed):
            run(command)
    answer = json.loads(printed.getvalue())
    if "error" in answer:
        return {"seed": seed, "error": answer["error"]["message"]}
    T_flange_camera = Pose(answer["calibration"]["T_flange_camera"])
    truth = cell.truth.X
    off = (truth @ T_flange_camera).log() if truth is not None else np.full(6, np.nan)
    bag: dict[str, float] = {}
    if arguments.robot == "ros2":
        solved = of_the_bag(cell, folder, arm)
        apart = np.full(6, np.nan) if solved is None else (solved.inverse() @ T_flange_camera).log()
        bag["bag_apart_mm"] = round(1e3 * float(np.linalg.norm(apart[:3])), 4)
        bag["bag_apart_deg"] = round(float(np.rad2deg(np.linalg.norm(apart[3:]))), 5)
    return {
        "seed": seed,
        "end": answer["end"],
        "views": answer["views"],
        "attempts": answer["attempts"],
        "off_mm": round(1e3 * float(np.linalg.norm(off[:3])), 3),
        "off_deg": round(float(np.rad2deg(np.linalg.norm(off[3:]))), 4),
        "seconds": round(time.monotonic() - began, 1),
    } | bag


def main() -> None:
    """Print a line a seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", choices=[*ROBOTS], default="ur")
    parser.add_argument("--camera", choices=["basler", "mock"], default="mock")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--keep", type=Path, help="folder to keep everything in")
    parser.add_argument("--pace", type=float, default=4.0, help="so many times faster than stated")
    arguments = parser.parse_args()
    os.environ["PYLON_CAMEMU"] = "1"
    for seed in arguments.seeds:
        with tempfile.TemporaryDirectory() as temporary:
            folder = (
                Path(temporary) if arguments.keep is None else arguments.keep / f"{arguments.robot}_{seed}"
            )
            folder.mkdir(parents=True, exist_ok=True)
            print(json.dumps(calibrated(arguments, seed, folder)), flush=True)


if __name__ == "__main__":
    main()
