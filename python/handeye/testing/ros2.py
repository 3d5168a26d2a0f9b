"""A cell in ROS 2: joint states, tf, pictures with camera_info, a controller; a process of its own.

`python -m handeye.testing.ros2 --seed 3` publishes until its input ends. Lines of its input say what goes
wrong from now on: `image late`, `image ahead`, `image unstamped`, `image backwards`, `image silent`, `image
mismatched` (camera_info of another time), the same with `joints` or `tf`; `refuse`; `well`. It answers
`heard`, to `where` the joints.

Pictures are stamped when they are exposed and sent a moment later, all the time: a program that takes
the latest gets one from before the arm came to rest. On the move they show nothing. Joint states name the
joints in alphabetical order. Not shown: the control of a real arm, networks, clocks that differ.
"""

import argparse
import sys
import threading
import time
from collections import deque
from importlib import resources
from typing import Any

import numpy as np

from handeye.cameras.protocol import Grey
from handeye.errors import DeviceError
from handeye.ros.link import RosLink, ros_library
from handeye.testing.cell import MockCell
from handeye.types import Pose
from handeye.types.arrays import FloatArray

ACTION = "/joint_trajectory_controller/follow_joint_trajectory"
IMAGE = "/camera/image_raw"
STATE_HZ, PICTURE_HZ, ON_ITS_WAY_S = 50.0, 8.0, 0.15
FAULTS = ("late", "ahead", "unstamped", "backwards", "silent", "mismatched")
OFFSETS_S = {"late": -3.0, "ahead": 1.0}


class MockRos2:
    """A node that moves a cell and shows it.

    Parameters
    ----------
    cell
        What it moves and sees.
    description
        Its description (URDF), as robot_state_publisher has it.
    base, flange
        Frames of tf.
    """

    def __init__(self, cell: MockCell, description: str, base: str, flange: str) -> None:
        self._cell, self._base, self._flange = cell, base, flange
        self.faults: dict[str, str] = {}
        self.refuses = False
        self._q: FloatArray = np.array(cell.start_rad)
        self._rate: FloatArray = np.zeros(len(cell.arm))
        cell.stand(cell.start_rad)
        self._seen: Grey = cell.picture("start.1")
        self._waiting: deque[tuple[float, float, Grey]] = deque()
        self._last_stamps_s: dict[str, float] = {}
        self._motion: Any = None
        self._messages = {
            name: ros_library(f"{name}.msg")
            for name in ("sensor_msgs", "geometry_msgs", "tf2_msgs", "std_msgs", "builtin_interfaces")
        }
        self._kind = ros_library("control_msgs.action").FollowJointTrajectory
        self._link = RosLink("mock_cell", threads=4)
        self._publish(description)

    def _publish(self, description: str) -> None:
        """Open the topics, the action and the timers."""
        node, sensor, tf = self._link.node, self._messages["sensor_msgs"], self._messages["tf2_msgs"]
        qos = ros_library("rclpy.qos")
        latched = qos.QoSProfile(depth=1, durability=qos.DurabilityPolicy.TRANSIENT_LOCAL)
        self._states = node.create_publisher(sensor.JointState, "/joint_states", 10)
        self._frames = node.create_publisher(tf.TFMessage, "/tf", 10)
        self._pictures = node.create_publisher(sensor.Image, IMAGE, 4)
        self._infos = node.create_publisher(sensor.CameraInfo, "/camera/camera_info", 10)
        self._described = node.create_publisher(
            self._messages["std_msgs"].String, "/robot_description", latched
        )
        self._described.publish(self._messages["std_msgs"].String(data=description))
        self._fixed = node.create_publisher(tf.TFMessage, "/tf_static", latched)
        # The chain has static ends, as of a real cell: a world above, and a flange below the last link.
        self._T_wrist_flange = Pose.exp([0.0, 0.0, 0.05, 0.0, 0.3, 0.0])
        self._fixed.publish(
            tf.TFMessage(
                transforms=[
                    self._transform("world", self._base, Pose.exp([0.5, 0, 0.8, 0, 0, 1.0]), 0.0),
                    self._transform("wrist", self._flange, self._T_wrist_flange, 0.0),
                ]
            )
        )
        action = ros_library("rclpy.action")
        group = ros_library("rclpy.callback_groups").ReentrantCallbackGroup()
        self._server = action.ActionServer(
            node,
            self._kind,
            ACTION,
            execute_callback=self._executed,
            goal_callback=self._judged,
            handle_accepted_callback=self._accepted,
            cancel_callback=self._canceled,
            callback_group=group,
        )
        node.create_timer(1.0 / STATE_HZ, self._tell)
        node.create_timer(1.0 / PICTURE_HZ, self._look)

    @property
    def joints_rad(self) -> list[float]:
        """(n,) where the arm stands."""
        return self._q.tolist()

    def close(self) -> None:
        """Leave ROS 2."""
        self._link.close()

    # What it says.

    def _tell(self) -> None:
        """Publish where the arm is, and pictures whose time has come."""
        sensor = self._messages["sensor_msgs"]
        now_s = self._link.now_s()
        stamp_s = self._stamp("joints", now_s)
        if stamp_s is not None:
            order = np.argsort(self._cell.arm.joint_names)
            state = sensor.JointState()
            state.header.stamp = self._time(stamp_s)
            state.name = [self._cell.arm.joint_names[k] for k in order]
            state.position, state.velocity = self._q[order].tolist(), self._rate[order].tolist()
            self._states.publish(state)
        stamp_s = self._stamp("tf", now_s)
        if stamp_s is not None:
            pose = Pose(self._cell.arm.forward(self._q)) @ self._T_wrist_flange.inverse()
            moving = self._transform(self._base, "wrist", pose, stamp_s)
            self._frames.publish(self._messages["tf2_msgs"].TFMessage(transforms=[moving]))
        while self._waiting and self._waiting[0][0] <= now_s:
            _, exposed_s, picture = self._waiting.popleft()
            self._show(exposed_s, picture)

    def _look(self) -> None:
        """Expose now; the picture is sent later."""
        now_s = self._link.now_s()
        self._waiting.append((now_s + ON_ITS_WAY_S, now_s, self._seen))

    def _show(self, exposed_s: float, picture: Grey) -> None:
        stamp_s = self._stamp("image", exposed_s)
        if stamp_s is None:
            return
        sensor, camera = self._messages["sensor_msgs"], self._cell.camera
        message, info = sensor.Image(), sensor.CameraInfo()
        message.header.stamp = self._time(stamp_s)
        message.height, message.width = picture.shape
        message.encoding, message.step, message.data = "mono8", picture.shape[1], picture.tobytes()
        off_s = 0.01 if self.faults.get("image") == "mismatched" else 0.0
        info.header.stamp = self._time(stamp_s + off_s)
        info.width, info.height = camera.size_px
        fx, fy, cx, cy, *distortion = camera.parameters.tolist()
        info.k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
        # The order of plumb_bob is that of the lens brown_conrady_5.
        info.distortion_model, info.d = "plumb_bob", (distortion + [0.0] * 5)[:5]
        self._infos.publish(info)
        self._pictures.publish(message)

    def _stamp(self, stream: str, true_s: float) -> float | None:
        """Return the stamp that a message gets; None for no message."""
        fault = self.faults.get(stream)
        if fault == "silent":
            return None
        if fault == "unstamped":
            return 0.0
        if fault == "backwards":
            self._last_stamps_s[stream] = self._last_stamps_s.get(stream, true_s) - 0.005
            return self._last_stamps_s[stream]
        self._last_stamps_s[stream] = true_s + OFFSETS_S.get(fault or "", 0.0)
        return self._last_stamps_s[stream]

    def _time(self, stamp_s: float) -> Any:  # noqa: ANN401 - builtin_interfaces/Time
        whole = int(stamp_s)
        return self._messages["builtin_interfaces"].Time(sec=whole, nanosec=int(1e9 * (stamp_s - whole)))

    def _transform(self, parent: str, child: str, pose: Pose, stamp_s: float) -> Any:  # noqa: ANN401
        made = self._messages["geometry_msgs"].TransformStamped()
        made.header.stamp, made.header.frame_id, made.child_frame_id = self._time(stamp_s), parent, child
        moved, turned = made.transform.translation, made.transform.rotation
        moved.x, moved.y, moved.z = pose.translation.tolist()
        turned.x, turned.y, turned.z, turned.w = pose.quaternion_xyzw.tolist()
        return made

    # What it does.

    def _judged(self, _: Any) -> Any:  # noqa: ANN401 - of rclpy
        response = ros_library("rclpy.action").GoalResponse
        return response.REJECT if self.refuses else response.ACCEPT

    def _canceled(self, _: Any) -> Any:  # noqa: ANN401 - of rclpy
        return ros_library("rclpy.action").CancelResponse.ACCEPT

    def _accepted(self, handle: Any) -> None:  # noqa: ANN401 - of rclpy
        self._motion = handle
        threading.Thread(target=handle.execute, daemon=True).start()

    def _executed(self, handle: Any) -> Any:  # noqa: ANN401 - of rclpy
        """Follow the points, between them on straight lines; rest where it is once that is canceled."""
        result = self._kind.Result()
        trajectory = handle.request.trajectory
        names: list[str] = list(trajectory.joint_names)
        order = [names.index(name) for name in self._cell.arm.joint_names]
        stamps: list[float] = [
            float(point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec)
            for point in trajectory.points
        ]
        times = [0.0, *stamps]
        asked: list[list[float]] = [list(point.positions) for point in trajectory.points]
        places: FloatArray = np.vstack([self._q, np.array(asked)[:, order]])
        try:
            there = self._shown_at(places[-1])
        except DeviceError as error:
            result.error_code, result.error_string = -1, error.message
            handle.abort()
            return result
        self._seen = np.full_like(self._seen, 90)  # blurred beyond recognition
        began = time.monotonic()
        while (at_s := time.monotonic() - began) < times[-1]:
            if handle.is_cancel_requested or handle is not self._motion:
                self._seen = self._shown_at(self._q)
                result.error_code, result.error_string = -1, "canceled"
                (handle.canceled if handle.is_cancel_requested else handle.abort)()
                return result
            k = min(max(int(np.searchsorted(times, at_s)), 1), len(times) - 1)
            share = (at_s - times[k - 1]) / (times[k] - times[k - 1])
            self._q = places[k - 1] + share * (places[k] - places[k - 1])
            time.sleep(0.004)
        self._q, self._seen = places[-1], there
        handle.succeed()
        return result

    def _shown_at(self, joints: FloatArray) -> Grey:
        """Return what the camera will see; rendered before the arm is there, as that takes its time."""
        self._cell.stand(tuple(joints.tolist()))
        return self._cell.picture(f"shown_{time.monotonic_ns()}.1")


def main() -> None:
    """Publish until the input ends."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    cell = MockCell("ur5e", seed=arguments.seed)
    text = (resources.files("handeye.robots") / "arms" / "ur5e.urdf").read_text()
    mock = MockRos2(cell, text, cell.arm.base, cell.arm.flange)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    for line in sys.stdin:
        stream, _, fault = line.strip().partition(" ")
        if stream == "well":
            mock.faults.clear()
            mock.refuses = False
        elif stream == "refuse":
            mock.refuses = True
        elif stream == "where":
            sys.stdout.write(" ".join(map(repr, mock.joints_rad)) + "\n")
            sys.stdout.flush()
            continue
        elif fault in FAULTS:
            mock.faults[stream] = fault
        sys.stdout.write("heard\n")
        sys.stdout.flush()
    mock.close()


if __name__ == "__main__":
    main()
