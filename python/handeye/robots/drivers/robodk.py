"""Any arm that RoboDK drives, by its own library (extra `robodk`). Not tried with RoboDK or a real arm."""

import socket
import threading
import time
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.extension import library
from handeye.robots.protocol import Goal, Reading
from handeye.types import Pose

PORT = 20500
# RoboDK's numbers: the type of an item that is a robot; a run that moves the real robot; connected and ready.
ITEM_TYPE_ROBOT, RUN_ROBOT, READY = 2, 6, 0
ACCELERATION_DEG_S2 = 50.0
POLL_S, REST_RAD, STARTS_S, STOPS_S = 0.05, 1e-4, 1.0, 4.0


class RoboDKRobot:
    """A robot of the station that is open in RoboDK.

    Parameters
    ----------
    address
        `HOST` or `HOST:PORT`; after a comma the robot's name in the station; after another comma `real`, to
        move the real robot through RoboDK's driver instead of the simulated one.

    Raises
    ------
    InputError
        An address of another form.
    DeviceError
        The library, RoboDK, the robot or its connection is not there.
    """

    def __init__(self, address: str) -> None:
        where, _, rest = address.partition(",")
        self._name, _, mode = rest.partition(",")
        self._host, _, port = where.partition(":")
        if not self._host or (port and not port.isdecimal()) or mode not in {"", "real"}:
            raise InputError(
                f"address {address[:60]!r}, expected HOST:PORT,ROBOT or HOST:PORT,ROBOT,real",
                code=Code.BAD_ADDRESS,
            )
        self._port = int(port or PORT)
        self._real = bool(mode)
        self._robolink = library("robodk.robolink", "robodk")
        self._stopped = threading.Event()
        self._robot()

    @staticmethod
    def found() -> list[tuple[str, str]]:
        """Return nothing: robots are reached by the address of RoboDK.

        Raises
        ------
        DeviceError
            The library is not there.
        """
        library("robodk.robolink", "robodk")
        return []

    def move_to(self, goal: Goal) -> None:
        """Turn the joints to those of the goal.

        Raises
        ------
        DeviceError
            `motion_refused` where RoboDK will not, or without joints; `stopped`; `connection_lost`.
        """
        if goal.joints_rad is None:
            raise DeviceError(f"{goal.label}: joint positions are needed", code=Code.MOTION_REFUSED)
        degrees = np.rad2deg(goal.joints_rad).tolist()
        self._stopped.clear()
        robot = self._robot()
        try:
            robot.setSpeed(-1, float(np.rad2deg(goal.speed_rad_s)), -1, ACCELERATION_DEG_S2)
            robot.MoveJ(degrees, blocking=False)
            while robot.Busy():
                time.sleep(POLL_S)
            joints = _rested(robot)
        except self._robolink.TargetReachError as error:
            raise DeviceError(f"{goal.label}: {error}", code=Code.MOTION_REFUSED) from error
        except self._robolink.StoppedError as error:
            raise DeviceError(f"{goal.label}: {error}", code=Code.STOPPED) from error
        except Exception as error:
            raise self._lost(goal.label, error) from error
        if self._stopped.is_set() or np.abs(joints - goal.joints_rad).max() > 0.02:
            raise DeviceError(f"{goal.label}: stopped short of it", code=Code.STOPPED)

    def read_pose(self) -> Reading:
        """Return the pose of the flange in the base, without tool and reference frame, and the joints.

        Raises
        ------
        DeviceError
            `connection_lost`.
        """
        try:
            robot = self._robot()
            joints = robot.Joints().list()
            matrix = np.array(robot.SolveFK(joints).rows, dtype=np.float64)
        except DeviceError:
            raise
        except Exception as error:
            raise self._lost("reading", error) from error
        matrix[:3, 3] /= 1000.0
        return Reading(Pose(matrix), tuple(np.deg2rad(joints).tolist()))

    def stop(self) -> None:
        """Stop the robot over a connection of its own, and see that it rests.

        Raises
        ------
        DeviceError
            `connection_lost`, or it still moves.
        """
        self._stopped.set()
        try:
            robot = self._robot()
            robot.Stop()
            _rested(robot)
        except DeviceError:
            raise
        except Exception as error:
            raise self._lost("stop", error) from error

    def _robot(self) -> Any:  # noqa: ANN401 - an item of RoboDK
        """Return the robot over a connection of its own: a call that hangs holds up no other."""
        try:
            # The library would start RoboDK where nobody listens.
            socket.create_connection((self._host, self._port), timeout=STARTS_S).close()
            link = self._robolink.Robolink(self._host, self._port)
            robot = link.Item(self._name, ITEM_TYPE_ROBOT)
            there = robot.Valid()
            if there and self._real:
                link.setRunMode(RUN_ROBOT)
                state, said = robot.ConnectedState()
                if state != READY:
                    raise DeviceError(
                        f"RoboDK has no connection to its robot: {said}",
                        code=Code.NOT_READY,
                        hint="connect it in RoboDK first (Connect to robot)",
                    )
        except DeviceError:
            raise
        except Exception as error:
            raise self._lost("connecting", error) from error
        if not there:
            raise DeviceError(
                f"RoboDK has no robot {self._name!r} in its station",
                code=Code.NO_ROBOT,
                hint="open the station, and name the robot as its tree does",
            )
        return robot

    def _lost(self, what: str, error: Exception) -> DeviceError:
        return DeviceError(
            f"{what}: RoboDK at {self._host}:{self._port}: {type(error).__name__}: {error}",
            code=Code.CONNECTION_LOST,
            hint="is RoboDK running, with its API allowed from here?",
        )


def _rested(robot: Any) -> Any:  # noqa: ANN401 - an item of RoboDK; joints in radians
    """Return the joints once they no longer change."""
    end, before = time.monotonic() + STOPS_S, None
    while time.monotonic() < end:
        joints = np.deg2rad(robot.Joints().list())
        if before is not None and np.abs(joints - before).max() < REST_RAD:
            return joints
        before = joints
        time.sleep(POLL_S)
    raise DeviceError("the arm does not come to rest", code=Code.NOT_AT_REST)
