"""Any arm behind a trajectory controller of ROS 2 (ros2_control, MoveIt). Not tried on a real arm.

The controller carries out the whole trajectory that it was sent: where this process or the network dies in
mid-motion, it goes on to the end.
"""

import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.errors import DeviceError, HandeyeError
from handeye.robots.model import Arm
from handeye.robots.protocol import Goal, Reading
from handeye.robots.urdf import parse_urdf
from handeye.ros.link import RosLink, look_around, options_of, ros_library, seconds
from handeye.ros.stamps import Stream
from handeye.ros.transforms import Transforms
from handeye.types import Pose
from handeye.types.arrays import FloatArray

ACTION = "control_msgs/action/FollowJointTrajectory"
USUAL = {
    "action": "/joint_trajectory_controller/follow_joint_trajectory",
    "base": "base_link",
    "flange": "tool0",
    "joints": "/joint_states",
    "description": "/robot_description",
    "clock": "system",
}
ACCELERATION_RAD_S2 = 0.8
# A motion of the fifth order that begins and ends at rest: its highest rate and acceleration over those of a
# straight line, 15/8 and 10/sqrt(3) (Biagiotti and Melchiorri, Trajectory Planning, section 2.1.5).
RATE, BEND = 15.0 / 8.0, 10.0 / np.sqrt(3.0)
POINTS_HZ = 20.0
READ_S, STARTS_S, SPARE_S, SETTLE_S, REST_S, REST_RAD = 2.0, 10.0, 30.0, 15.0, 0.3, 2e-4
POLL_S = 0.02
NEAR_RAD = 0.02
CANCELED = 5  # action_msgs/GoalStatus


class Ros2Robot:
    """An arm that follows trajectories of joints.

    Parameters
    ----------
    address
        Name of its action (control_msgs/FollowJointTrajectory); then, each after a comma, what is not usual:
        `base=` and `flange=` frames of tf, `joints=` and `description=` topics, `clock=sim` for the time of a
        simulation.

    Raises
    ------
    InputError
        An address of another form, or a description that cannot be used.
    DeviceError
        ROS 2, the description or the controller is not there.
    """

    def __init__(self, address: str) -> None:
        options = options_of(address, "action", USUAL)
        self._base, self._flange, self._action = options["base"], options["flange"], options["action"]
        sensor = ros_library("sensor_msgs.msg")
        tf = ros_library("tf2_msgs.msg")
        text = ros_library("std_msgs.msg")
        self._kind = ros_library("control_msgs.action").FollowJointTrajectory
        self._trajectories = ros_library("trajectory_msgs.msg")
        self._link = RosLink("handeye_robot", options["clock"])
        self._stopped = threading.Event()
        self._motion: Any = None
        self._description: Stream[str] = Stream(
            options["description"], time.monotonic, code=Code.NO_DESCRIPTION
        )
        self._states: Stream[dict[str, float]] = Stream(
            options["joints"], self._link.now_s, code=Code.NO_JOINTS
        )
        self._frames = Transforms(self._link.now_s)
        link = self._link
        link.subscribe(
            text.String,
            options["description"],
            lambda message: self._description.put(time.monotonic(), message.data),
            latched=True,
        )
        link.subscribe(sensor.JointState, options["joints"], self._take_state)
        link.subscribe(tf.TFMessage, "/tf", lambda message: self._take_frames(message, static=False))
        link.subscribe(
            tf.TFMessage, "/tf_static", lambda message: self._take_frames(message, static=True), latched=True
        )
        self._client = ros_library("rclpy.action").ActionClient(link.node, self._kind, self._action)
        try:
            self._arm = self._described()
        except HandeyeError:
            self.close()
            raise

    @property
    def joint_limits(self) -> FloatArray:
        """(n, 2) limits of the joints in the description that ROS 2 publishes, radians or metres."""
        return self._arm.limits

    @staticmethod
    def found() -> list[tuple[str, str]]:
        """Return the names of actions that follow trajectories.

        Raises
        ------
        DeviceError
            ROS 2 is not there.
        """
        action = ros_library("rclpy.action")

        def look(link: RosLink) -> list[tuple[str, str]]:
            known = action.get_action_names_and_types(link.node)
            return sorted((name, ACTION) for name, kinds in known if ACTION in kinds)

        return look_around(look)

    def close(self) -> None:
        """Leave ROS 2."""
        self._link.close()

    def move_to(self, goal: Goal) -> None:
        """Turn the joints to those of the goal, and wait until the arm rests.

        Raises
        ------
        DeviceError
            `motion_refused` without joints, beyond the limits, or by the controller; `stopped`; `not_ready`;
            `no_joints`, `bad_stamp` where the controller is no longer heard.
        """
        joints = goal.joints_rad
        if joints is None or len(joints) != len(self._arm) or not self._arm.within_limits(joints):
            raise DeviceError(f"{goal.label}: joints within the limits are needed", code=Code.MOTION_REFUSED)
        if not self._client.wait_for_server(timeout_sec=STARTS_S):
            raise DeviceError(
                f"{goal.label}: nobody offers the action {self._action}",
                code=Code.NOT_READY,
                hint="ros2 control list_controllers; ros2 action list",
            )
        self._stopped.clear()
        here = self._joints()
        points, total_s = profile(here, np.array(joints), goal.speed_rad_s)
        sent = self._client.send_goal_async(self._message(points))
        motion = _answer(sent, STARTS_S, f"{goal.label}: {self._action}")
        if not motion.accepted:
            raise DeviceError(
                f"{goal.label}: the controller refuses the trajectory", code=Code.MOTION_REFUSED
            )
        self._motion = motion
        try:
            answer = self._ended(goal.label, motion, total_s + SPARE_S)
        finally:
            self._motion = None
        self._settled()
        off = float(np.abs(self._joints() - joints).max())
        if self._stopped.is_set() or answer.status == CANCELED or off > NEAR_RAD:
            said = answer.result.error_string or f"code {answer.result.error_code}"
            raise DeviceError(
                f"{goal.label}: stopped {np.rad2deg(off):.1f} deg short of it ({said[:200]})",
                code=Code.STOPPED,
            )

    def read_pose(self) -> Reading:
        """Return the joints after now, and the pose of the flange by tf at the same moment.

        Raises
        ------
        DeviceError
            `no_joints`, `no_message` or `unknown_frame`; `bad_stamp` where stamps cannot be true.
        """
        state = self._state(self._link.now_s())
        pose = self._frames.at(self._base, self._flange, state[0], READ_S)
        return Reading(pose, tuple(state[1].tolist()))

    def stop(self) -> None:
        """Cancel whatever was sent from here, and see that the arm rests.

        Raises
        ------
        DeviceError
            The arm still moves, or is no longer heard.
        """
        self._stopped.set()
        motion = self._motion
        if motion is not None:
            motion.cancel_goal_async()
        self._settled()

    def _described(self) -> Arm:
        text = self._description.after(0.0, STARTS_S).value
        return parse_urdf(text.encode(), base=self._base, tip=self._flange)

    def _take_state(self, message: Any) -> None:  # noqa: ANN401 - sensor_msgs/JointState
        positions = dict(zip(message.name, message.position, strict=False))
        self._states.put(seconds(message.header.stamp), positions)

    def _take_frames(self, message: Any, *, static: bool) -> None:  # noqa: ANN401 - tf2_msgs/TFMessage
        for each in message.transforms:
            moved, turned = each.transform.translation, each.transform.rotation
            parent, child = each.header.frame_id.lstrip("/"), each.child_frame_id.lstrip("/")
            try:
                pose = Pose.from_quaternion(
                    [moved.x, moved.y, moved.z], [turned.x, turned.y, turned.z, turned.w]
                )
            except HandeyeError:
                continue  # no rotation: as if it had not been sent
            self._frames.put(parent, child, seconds(each.header.stamp), pose, static=static)

    def _state(self, asked_s: float) -> tuple[float, FloatArray]:
        """Return the time and the joints (n,) of the first message with all joints, made after a time."""
        end, names = time.monotonic() + READ_S, self._arm.joint_names
        while True:
            found = self._states.after(asked_s, max(end - time.monotonic(), POLL_S))
            if all(name in found.value for name in names):
                joints = np.array([found.value[name] for name in names])
                if np.isfinite(joints).all():
                    return found.stamp_s, joints
            if time.monotonic() > end:
                raise DeviceError(
                    f"joint states of {', '.join(sorted(found.value)[:20])}, expected {', '.join(names)}",
                    code=Code.NO_JOINTS,
                    hint="the description and the controller must be of one robot",
                )
            asked_s = np.nextafter(found.stamp_s, np.inf)

    def _joints(self) -> FloatArray:
        return self._state(self._link.now_s())[1]

    def _message(self, points: Sequence[tuple[float, FloatArray, FloatArray, FloatArray]]) -> Any:  # noqa: ANN401
        goal = self._kind.Goal()
        goal.trajectory.joint_names = list(self._arm.joint_names)
        for at_s, positions, rates, accelerations in points:
            point = self._trajectories.JointTrajectoryPoint()
            point.positions = positions.tolist()
            point.velocities = rates.tolist()
            point.accelerations = accelerations.tolist()
            point.time_from_start.sec = int(at_s)
            point.time_from_start.nanosec = int(1e9 * (at_s - int(at_s)))
            goal.trajectory.points.append(point)
        return goal

    def _ended(self, label: str, motion: Any, timeout_s: float) -> Any:  # noqa: ANN401 - of rclpy
        """Wait for the end of a motion while the arm is heard; where it is not, cancel."""
        result = motion.get_result_async()
        end = time.monotonic() + timeout_s
        while not result.done():
            try:
                self._joints()
            except DeviceError:
                motion.cancel_goal_async()  # heard once the connection is back
                raise
            if time.monotonic() > end:
                motion.cancel_goal_async()
                raise DeviceError(f"{label}: not there after {timeout_s:.0f} s", code=Code.STOPPED)
            time.sleep(POLL_S)
        return result.result()

    def _settled(self) -> None:
        """Wait until the joints no longer change, by the clock of the joint states."""
        end = time.monotonic() + SETTLE_S
        since_s, reference = 0.0, np.full(len(self._arm), np.inf)
        while time.monotonic() < end:
            now_s, joints = self._state(self._link.now_s())
            if np.abs(joints - reference).max() > REST_RAD:
                since_s, reference = now_s, joints
            elif now_s - since_s > REST_S:
                return
        raise DeviceError("the arm does not come to rest", code=Code.NOT_AT_REST)


def profile(
    here: FloatArray, there: FloatArray, speed_rad_s: float
) -> tuple[list[tuple[float, FloatArray, FloatArray, FloatArray]], float]:
    """Return points of a motion: time, positions, rates, accelerations (n,) of each; and the time of all.

    All joints are in step; it begins and ends at rest, and no joint turns faster than asked.
    """
    turn = there - here
    way = max(float(np.abs(turn).max()), 1e-6)
    total_s = max(RATE * way / speed_rad_s, float(np.sqrt(BEND * way / ACCELERATION_RAD_S2)), 0.2)
    points: list[tuple[float, FloatArray, FloatArray, FloatArray]] = []
    for share in np.linspace(0, 1, max(2, int(np.ceil(total_s * POINTS_HZ))) + 1)[1:]:
        u = float(share)
        done = u**3 * (10 - 15 * u + 6 * u * u)
        rate = 30 * u * u * (1 - u) ** 2 / total_s
        bend = 60 * u * (1 - u) * (1 - 2 * u) / total_s**2
        points.append((u * total_s, here + done * turn, rate * turn, bend * turn))
    return points, total_s


def _answer(future: Any, timeout_s: float, what: str) -> Any:  # noqa: ANN401 - of rclpy
    """Return what a future brings, spun by another thread."""
    done = threading.Event()

    def tell(_: Any) -> None:  # noqa: ANN401 - the future itself
        done.set()

    future.add_done_callback(tell)
    if not done.wait(timeout_s):
        raise DeviceError(f"{what}: no answer within {timeout_s:.0f} s", code=Code.CONNECTION_LOST)
    return future.result()
