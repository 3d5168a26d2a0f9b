"""What drivers talk to on loopback, each with a cell behind it and a cable that can be pulled."""

import json
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handeye.cameras.drivers import genicam, realsense
from handeye.cameras.drivers.basler import BaslerCamera
from handeye.cameras.drivers.genicam import GenicamCamera
from handeye.cameras.drivers.realsense import RealSenseCamera
from handeye.cameras.drivers.ros2 import Ros2Camera
from handeye.cameras.protocol import Frame, ImageSource
from handeye.errors import DeviceError
from handeye.robots import read_urdf
from handeye.robots.drivers.franka import FrankaRobot
from handeye.robots.drivers.lerobot import STEP_RAD
from handeye.robots.protocol import Goal
from handeye.testing import MockCell
from handeye.testing.robodk import MockRoboDK
from handeye.testing.universal_robots import MockUniversalRobot
from handeye.testing.xarm import MockXArm
from handeye.types import Pose
from ros2_peer import BASE_AND_FLANGE, Peer

NEVER = 10_000
# An arm turns that moves so far in so long; a simulated controller trembles at rest.
TURNS_RAD, LOOK_S = 1e-3, 0.01
Cable = tuple[Callable[[], None], Callable[[], None]]
# What holds the joints of franky-sim: N m/rad and N m s/rad. Its own damping, 200 at the last three, is unstable
# at its step of 1 ms (200 * 0.001 / 0.078 kg m2 > 2): once an abrupt stop has stirred joint 7, its torque jumps
# between the bounds of 12 N m for good, nothing holds the joint, and it creeps. The time constant stays 0.1 s.
STIFFNESS = (4500.0, 4500.0, 3500.0, 3500.0, 500.0, 500.0, 500.0)
DAMPING = (450.0, 450.0, 350.0, 350.0, 50.0, 50.0, 50.0)


@dataclass(frozen=True)
class Partner:
    """A controller: its cell, how its driver is named, where its arm is, its cable, and its description."""

    cell: MockCell
    driver: str
    joints: Callable[[], np.ndarray]
    cut: Callable[[], None]
    mend: Callable[[], None]
    close: Callable[[], None]
    robot: str = "ur5e"
    speed_rad_s: float = 3.0
    followed: bool = False
    peer: Peer | None = None

    def moves(self, seconds: float = LOOK_S) -> bool:
        """Whether the arm turns just now."""
        before = self.joints().copy()
        time.sleep(seconds)
        return float(np.abs(self.joints() - before).max()) > TURNS_RAD

    def show(self) -> None:
        """Let the camera look from where the arm stands, if the controller does not see to it."""
        if self.followed:
            self.cell.stand(tuple(np.clip(self.joints(), *self.cell.arm.limits.T).tolist()))


def universal_robot(seed: int, _: Path) -> Partner:
    cell = MockCell("ur5e", seed=seed, points_only=True)
    made = MockUniversalRobot(cell, pace=4.0)
    return Partner(cell, f"ur:{made.address}", lambda: made._q, made.cut, made.mend, made.close)


def xarm(seed: int, _: Path) -> Partner:
    cell = MockCell("ur5e", seed=seed, points_only=True)
    made = MockXArm(cell)
    return Partner(cell, f"xarm:{made.address}", lambda: made._q, made.cut, made.mend, made.close)


def robodk(seed: int, _: Path) -> Partner:
    pytest.importorskip("robodk.robolink", reason="robodk is not installed (extra robodk)")
    cell = MockCell("ur5e", seed=seed, points_only=True)
    made = MockRoboDK(cell)
    return Partner(cell, f"robodk:{made.address}", lambda: made._joints, made.cut, made.mend, made.close)


def lerobot(seed: int, folder: Path) -> Partner:
    """Servos on a bus in the joints of a larger arm: the driver asks for no more than a name for each."""
    pytest.importorskip("serial", reason="pyserial is not installed (extra lerobot)")
    pytest.importorskip("pty", reason="there are no pseudo terminals on this system")
    from handeye.testing.feetech import MockFeetechBus

    cell, middle, top = MockCell("lbr_iiwa_14", seed=seed, points_only=True), 2048, 4095
    made = MockFeetechBus([round(middle + q / STEP_RAD) for q in cell.start_rad])
    urdf, calibration = folder / "arm.urdf", folder / "arm.json"
    urdf.write_text((resources.files("handeye.robots") / "arms" / "lbr_iiwa_14.urdf").read_text())
    ranges = {"range_min": 1, "range_max": top, "drive_mode": 0}
    calibration.write_text(
        json.dumps({name: {"id": k} | ranges for k, name in enumerate(cell.arm.joint_names, 1)})
    )

    def joints() -> np.ndarray:
        return (np.array([round(step) for step in made._places.values()]) - middle) * STEP_RAD

    driver = f"lerobot:{made.address},{calibration},{urdf},{cell.arm.flange}"
    return Partner(cell, driver, joints, made.cut, made.mend, made.close, str(urdf), followed=True)


class FciCable:
    """The network of a server of franky-sim, handled by the thread that serves: cut, connections end at once."""

    def __init__(self, server: Any) -> None:
        self._server, self._serve = server, server.process_commands
        self._wanted = self._whole = True
        server.process_commands = self._process

    def cut(self) -> None:
        self._change(whole=False)

    def mend(self) -> None:
        self._change(whole=True)

    def _change(self, *, whole: bool) -> None:
        self._wanted = whole
        while self._whole is not whole:
            time.sleep(0.005)

    def _process(self) -> None:
        if self._wanted and not self._whole:
            # The one name it had: it would look for another.
            self._server._FrankaServer__hostname_candidates = [self._server.hostname]
            self._server.init()
        elif self._whole and not self._wanted:
            self._server.cleanup()
            self._server.reset_state()
        self._whole = self._wanted
        if self._whole:
            self._serve()
        else:
            self._server._post_process_commands()  # the arm is held


@contextmanager
def simulated_franka() -> Iterator[tuple[str, Callable[[], np.ndarray], FciCable]]:
    """Give the address of an arm of franky-sim, where it stands, and its cable."""
    pytest.importorskip("franky", reason="franky-control is not installed (extra franka)")
    sim = pytest.importorskip("franky_sim", reason="franky-sim is not installed")
    import pinocchio
    from franky_sim.base_simulator import BaseRobot
    from franky_sim.mujoco_simulator import MujocoSimulator

    # franky-sim 1.0.4 hands out its one pose and computes the next one into it: O_T_EE, the measured pose, comes
    # out as that of the commanded joints, 0.1 deg beside the measured ones. Here it hands out copies.
    shared = BaseRobot.kinematics
    BaseRobot.kinematics = lambda self, q: pinocchio.SE3(shared(self, q))
    try:
        with MujocoSimulator(enable_visualization=False) as simulator:
            model = simulator.add_robot(kp=STIFFNESS, kv=DAMPING)
            with sim.SimulationServer(simulator) as server:
                server.run_async()
                cable = FciCable(server.robot_servers[0])
                yield f"{model.hostname},no-realtime", (lambda: np.array(model.inner_state.q)), cable
            for one in server.robot_servers:
                one.reset_state()  # it forgets to close its connection
    finally:
        BaseRobot.kinematics = shared


def franka(seed: int, _: Path) -> Partner:
    running = ExitStack()
    address, joints, cable = running.enter_context(simulated_franka())
    import franky_sim

    described = str(Path(franky_sim.__file__).parent / "assets" / "fr3_clean.urdf")
    cell = MockCell(read_urdf(Path(described)), seed=seed, points_only=True)
    driver = FrankaRobot(address)
    driver.move_to(Goal("start.1", Pose(cell.arm.forward(cell.start_rad)), cell.start_rad, 1.0))
    driver.close()
    return Partner(
        cell,
        f"franka:{address}",
        joints,
        cable.cut,
        cable.mend,
        running.close,
        described,
        speed_rad_s=1.0,
        followed=True,
    )


def ros2(seed: int, _: Path) -> Partner:
    peer = Peer(seed)
    cell = MockCell("ur5e", seed=seed, points_only=True)
    driver = f"ros2:{BASE_AND_FLANGE}"
    return Partner(cell, driver, peer.joints, peer.cut, peer.mend, peer.close, peer=peer)


ROBOTS = {
    "ur": universal_robot,
    "xarm": xarm,
    "robodk": robodk,
    "lerobot": lerobot,
    "franka": franka,
    "ros2": ros2,
}


@dataclass
class Eye:
    """A camera whose cable is pulled while it takes a picture."""

    inner: ImageSource
    cut: Callable[[], None]
    mend: Callable[[], None]
    show: Callable[[], None] = lambda: None
    close: Callable[[], None] = lambda: None
    cell: MockCell | None = None
    grabs: int = 0
    cut_at: int = NEVER

    def grab(self, label: str) -> Frame:
        """Take a picture; of a device that cannot be shown the cell, only that it came counts."""
        self.grabs += 1
        if self.grabs >= self.cut_at:
            threading.Timer(0.01, self.cut).start()
        self.show()
        frame = self.inner.grab(label)
        return frame if self.cell is None else self.cell.grab(label)


class Wire:
    """The camera of the cell, on a wire; an exposure takes a moment."""

    def __init__(self, cell: MockCell) -> None:
        self.cell, self.connected = cell, True

    def grab(self, label: str) -> Frame:
        if self.connected:
            time.sleep(0.03)
        if not self.connected:
            raise DeviceError("no camera", code="connection_lost")
        return self.cell.grab(label)


def of_the_cell(partner: Partner, _: Path) -> Eye:
    wire = Wire(partner.cell)
    return Eye(
        wire,
        lambda: setattr(wire, "connected", False),
        lambda: setattr(wire, "connected", True),
        partner.show,
    )


def basler(partner: Partner, folder: Path) -> Eye:
    """One of pylon's emulated cameras; one that is taken away is there again at once."""
    os.environ.setdefault("PYLON_CAMEMU", "2")  # read when the library is loaded
    pytest.importorskip("pypylon.pylon", reason="pypylon is not installed (extra basler)")
    from pypylon.pylon import FeaturePersistence

    settings, number = folder / "camera.pfs", "0815-0000"
    made = BaslerCamera(number)
    made._camera.ExposureTimeAbs.Value = 2e5
    FeaturePersistence.Save(str(settings), made._camera.GetNodeMap())
    made.close()
    made = BaslerCamera(f"{number},{settings}")

    def cut() -> None:
        end = time.monotonic() + 5
        while (camera := made._camera) is None or not camera.IsGrabbing():
            if time.monotonic() > end:
                return
            time.sleep(0.005)
        camera.DestroyDevice()

    return Eye(made, cut, lambda: None, partner.show, made.close, partner.cell)


def genicam_cable(camera: GenicamCamera) -> Cable:
    """The cable of one of the cameras that the library genicam simulates: cut, it is not found either."""
    harvester = genicam._harvester(camera._producers)
    create = harvester.create

    def gone(*_: object) -> None:
        raise RuntimeError("the cable is pulled")

    def cut() -> None:
        harvester.create = gone
        if camera._source is not None:
            with suppress(Exception):  # pulled a second time
                camera._source.device.close()

    def mend() -> None:
        harvester.create = create

    return cut, mend


def genicam_camera(partner: Partner, _: Path) -> Eye:
    pytest.importorskip("harvesters", reason="harvesters is not installed (extra genicam)")
    producer = Path(str(pytest.importorskip("genicam").__file__)).parent / "viky.cti"
    made = GenicamCamera(f"0,{producer}")
    return Eye(made, *genicam_cable(made), partner.show, made.close, partner.cell)


def realsense_camera(partner: Partner, _: Path) -> Eye:
    pytest.importorskip(
        "pyrealsense2", reason="pyrealsense2 is not installed (extra realsense)", exc_type=ImportError
    )
    from handeye.testing.realsense import MockRealSense

    device = MockRealSense((64, 48))
    listed = realsense._devices
    realsense._devices = lambda _: [device.device]
    made = RealSenseCamera("")

    def close() -> None:
        made.close()
        device.close()
        realsense._devices = listed

    return Eye(made, device.cut, device.mend, partner.show, close, partner.cell)


def ros2_camera(partner: Partner, _: Path) -> Eye:
    """The camera of the cell that is there in ROS 2, beside its arm."""
    peer = partner.peer
    assert peer is not None
    made = Ros2Camera("")
    return Eye(made, lambda: peer.say("image silent"), lambda: peer.say("well"), close=made.close)


CAMERAS: dict[str, Callable[[Partner, Path], Eye]] = {
    "mock": of_the_cell,
    "basler": basler,
    "genicam": genicam_camera,
    "realsense": realsense_camera,
    "ros2": ros2_camera,
}
