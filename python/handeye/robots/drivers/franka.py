"""Franka's arms (FR3) through libfranka, by franky (extra `franka`). Not tried on a real arm."""

import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.extension import library
from handeye.robots.protocol import Goal, Reading
from handeye.types import Pose

JOINTS = 7
# Shares of what the arm can: gentle, whatever the speed that is asked for.
ACCELERATION_SHARE, JERK_SHARE = 0.2, 0.2
# The arm rests where no joint has turned by more in so long; that is waited for so long. Rates are too noisy.
REST_RAD, REST_S, SETTLE_S = 2e-4, 0.3, 15.0
POLL_S, STOPPED_S = 0.01, 0.1


class FrankaRobot:
    """An arm whose Franka Control Interface is active.

    Parameters
    ----------
    address
        Host. After a comma `no-realtime`, for a kernel without real-time priority, such as a simulation's.

    Raises
    ------
    InputError
        An address of another form.
    DeviceError
        The library or the arm is not there.
    """

    def __init__(self, address: str) -> None:
        self._host, _, option = address.partition(",")
        if not self._host or option not in {"", "no-realtime"}:
            raise InputError(
                f"address {address[:60]!r}, expected HOST or HOST,no-realtime", code=Code.BAD_ADDRESS
            )
        self._franky = library("franky", "franka")
        realtime = self._franky.RealtimeConfig
        self._realtime = realtime.Ignore if option else realtime.Enforce
        self._link: Any = None
        self._lock = threading.Lock()
        _ = self._arm

    @property
    def joint_limits(self) -> tuple[tuple[float, float], ...]:
        """Lowest and highest position of each joint of an FR3, radians."""
        return LIMITS_RAD

    @staticmethod
    def found() -> list[tuple[str, str]]:
        """Return nothing: arms are reached by their address.

        Raises
        ------
        DeviceError
            The library is not there.
        """
        library("franky", "franka")
        return []

    def move_to(self, goal: Goal) -> None:
        """Turn the joints to those of the goal, and wait until the arm rests.

        Raises
        ------
        DeviceError
            `motion_refused` beyond the joint limits, or without joints; `stopped`; `connection_lost`.
        """
        if goal.joints_rad is None or len(goal.joints_rad) != JOINTS:
            raise DeviceError(f"{goal.label}: seven joint positions are needed", code=Code.MOTION_REFUSED)
        self._check_limits(goal.label, goal.joints_rad)
        franky = self._franky
        try:
            if self._arm.has_errors and not self._arm.recover_from_errors():
                raise DeviceError("the arm reports an error that cannot be undone", code=Code.NOT_READY)
            limits = np.asarray(self._arm.joint_velocity_limit.max)
            self._arm.joint_velocity_limit.set(
                [min(float(goal.speed_rad_s), float(limit)) for limit in limits]
            )
            share = franky.RelativeDynamicsFactor(1.0, ACCELERATION_SHARE, JERK_SHARE)
            target = franky.JointState(np.array(goal.joints_rad, dtype=np.float64))
            self._arm.move(franky.JointMotion(target, relative_dynamics_factor=share), asynchronous=True)
            # `poll_motion` of franky 2.0 says the opposite of its documentation, and is not asked.
            while self._arm.is_in_control:
                time.sleep(POLL_S)
            self._arm.join_motion(STOPPED_S)  # raises what ended it
        except franky.Exception as error:
            raise self._described(goal.label, error) from error
        self._settled()
        off = float(np.abs(np.asarray(self._arm.state.q) - goal.joints_rad).max())
        if off > 0.02:
            raise DeviceError(
                f"{goal.label}: stopped {np.rad2deg(off):.1f} deg short of it", code=Code.STOPPED
            )

    def read_pose(self) -> Reading:
        """Return the pose of the flange, whatever end effector is set, and the joints.

        Raises
        ------
        DeviceError
            `connection_lost`.
        """
        try:
            state = self._arm.state
        except self._franky.Exception as error:
            raise self._described("reading", error) from error
        T_base_effector = Pose(np.asarray(state.O_T_EE.matrix))
        T_flange_effector = Pose(np.asarray(state.F_T_EE.matrix))
        return Reading(
            T_base_effector @ T_flange_effector.inverse(), tuple(np.asarray(state.q, dtype=float).tolist())
        )

    def stop(self) -> None:
        """Stop whatever motion runs.

        Raises
        ------
        DeviceError
            The arm cannot be told, or still moves.
        """
        try:
            # Without a motion there is nothing to stop, and the next one would be taken for stopped.
            if self._arm.is_in_control:
                self._arm.stop()
                self._ended()
        except self._franky.Exception as error:
            raise self._described("stop", error) from error
        self._settled()

    def close(self) -> None:
        """Let go of the arm."""
        with self._lock:
            self._link = None

    def _check_limits(self, label: str, joints_rad: Sequence[float]) -> None:
        for number, (value, (low, high)) in enumerate(zip(joints_rad, LIMITS_RAD, strict=True), 1):
            if not low <= value <= high:
                raise DeviceError(
                    f"{label}: joint {number} at {value:.3f} rad, limits {low} to {high}",
                    code=Code.MOTION_REFUSED,
                )

    def _ended(self) -> None:
        """Wait for the word that the motion was stopped, which would else be taken for that of the next."""
        end = time.monotonic() + SETTLE_S
        while self._arm.is_in_control and time.monotonic() < end:
            with suppress(self._franky.ControlException, self._franky.CommandException):
                self._arm.join_motion(STOPPED_S)
            time.sleep(STOPPED_S)

    def _settled(self) -> None:
        """Wait until the arm rests: the motion of the controller ends before that of the arm."""
        end = time.monotonic() + SETTLE_S
        since_s, reference = 0.0, np.full(JOINTS, np.inf)
        while time.monotonic() < end:
            try:
                state = self._arm.state
                # By the clock of the controller: an old state that comes again is no rest.
                joints, now_s = np.asarray(state.q), state.time.to_sec()
            except self._franky.Exception as error:
                raise self._described("reading", error) from error
            if np.abs(joints - reference).max() > REST_RAD:
                since_s, reference = now_s, joints
            elif now_s - since_s > REST_S:
                return
            time.sleep(POLL_S)
        raise DeviceError("the arm does not come to rest", code=Code.NOT_AT_REST)

    @property
    def _arm(self) -> Any:  # noqa: ANN401 - a robot of franky
        """The arm, connected. Kept nowhere else: an error that holds it would hold the only connection."""
        with self._lock:
            if self._link is None:
                try:
                    self._link = self._franky.Robot(self._host, realtime_config=self._realtime)
                except self._franky.Exception as error:
                    raise self._described("connecting", error) from error
            return self._link

    def _described(self, what: str, error: Exception) -> DeviceError:
        lost = isinstance(error, self._franky.NetworkException)
        if lost:
            self._link = None  # connected again at the next call, which moves nothing by itself
        return DeviceError(
            f"{what}: {str(error).strip()}",
            code=Code.CONNECTION_LOST if lost else Code.STOPPED,
            hint="is the control interface (FCI) active, are the brakes open, is the network direct?",
        )


# Franka Control Interface documentation, limits of FR3; those of the Panda are wider at some joints.
LIMITS_RAD = (
    (-2.7437, 2.7437),
    (-1.7837, 1.7837),
    (-2.9007, 2.9007),
    (-3.0421, -0.1518),
    (-2.8065, 2.8065),
    (0.5445, 4.5169),
    (-3.0159, 3.0159),
)
