"""A node of ROS 2 in a thread of its own."""

import secrets
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.extension import library

HINT = "source ROS 2 first (source /opt/ros/DISTRIBUTION/setup.bash), in a Python environment that sees it"
LISTENS_S = 1.5


class RosLink:
    """A node, spun in a thread until it is closed.

    Parameters
    ----------
    name
        Of the node; a number is added, as names must differ.
    clock
        `system`, or `sim` for the time that a simulation publishes (use_sim_time).
    threads
        That many callbacks run at a time.

    Raises
    ------
    InputError
        Another clock.
    DeviceError
        ROS 2 is not there, or does not start.
    """

    def __init__(self, name: str, clock: str = "system", threads: int = 1) -> None:
        if clock not in {"system", "sim"}:
            raise InputError(f"clock {clock[:40]!r}, expected system or sim", code=Code.BAD_ADDRESS)
        self.rclpy = ros_library("rclpy")
        executors = ros_library("rclpy.executors")
        ros_library("rclpy.parameter")
        try:
            self._context = self.rclpy.context.Context()
            self.rclpy.init(args=[], context=self._context)
            simulated = self.rclpy.parameter.Parameter("use_sim_time", value=clock == "sim")
            self.node = self.rclpy.create_node(
                f"{name}_{secrets.token_hex(4)}", context=self._context, parameter_overrides=[simulated]
            )
        except Exception as error:
            raise DeviceError(f"ROS 2 does not start: {error}", code=Code.NOT_READY, hint=HINT) from error
        self._executor = (
            executors.SingleThreadedExecutor(context=self._context)
            if threads == 1
            else executors.MultiThreadedExecutor(threads, context=self._context)
        )
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True, name=f"ros2 {name}")
        self._thread.start()

    def now_s(self) -> float:
        """Return the time of the node's clock, in seconds."""
        return float(self.node.get_clock().now().nanoseconds) * 1e-9

    def subscribe(
        self,
        kind: Any,  # noqa: ANN401 - a type of messages
        topic: str,
        take: Callable[[Any], None],
        *,
        latched: bool = False,
    ) -> None:
        """Hand every message of a topic to a function; `latched` also those that came before."""
        qos = ros_library("rclpy.qos")
        if latched:
            profile = qos.QoSProfile(
                depth=100,
                durability=qos.DurabilityPolicy.TRANSIENT_LOCAL,
                reliability=qos.ReliabilityPolicy.RELIABLE,
            )
        else:  # what reaches senders of either kind
            profile = qos.QoSProfile(depth=50, reliability=qos.ReliabilityPolicy.BEST_EFFORT)
        self.node.create_subscription(kind, topic, take, profile)

    def topics(self, kind: str) -> list[str]:
        """Return the topics of a kind, such as sensor_msgs/msg/Image, that are known by now."""
        return sorted(name for name, kinds in self.node.get_topic_names_and_types() if kind in kinds)

    def close(self) -> None:
        """End the node and its thread."""
        self._executor.shutdown(timeout_sec=2.0)
        self._thread.join(timeout=2.0)
        self.node.destroy_node()
        self.rclpy.try_shutdown(context=self._context)

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except self.rclpy.executors.ExternalShutdownException:
            return


def ros_library(module: str) -> Any:  # noqa: ANN401 - a module without types
    """Return a module of ROS 2.

    Raises
    ------
    DeviceError
        It is not there; `code` is `library_missing`.
    """
    try:
        return library(module, "ros2")
    except DeviceError as error:
        raise DeviceError(error.message, code=error.code, hint=HINT) from error


def look_around(look: Callable[[RosLink], list[tuple[str, str]]]) -> list[tuple[str, str]]:
    """Return what is found by a node that has listened for a moment.

    Raises
    ------
    DeviceError
        ROS 2 is not there.
    """
    link = RosLink("handeye_devices")
    try:
        time.sleep(LISTENS_S)
        return look(link)
    finally:
        link.close()


def seconds(stamp: Any) -> float:  # noqa: ANN401 - builtin_interfaces/Time
    """Return a stamp in seconds."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def options_of(address: str, first: str, known: Mapping[str, str]) -> dict[str, str]:
    """Return the parts of an address `NAME,key=value,...` over what is usual.

    Parameters
    ----------
    address
        The text.
    first
        Key of the part that has none.
    known
        Every key and its usual value.

    Raises
    ------
    InputError
        A key that is not known, or a part without one.
    """
    found = dict(known)
    for number, part in enumerate(part for part in address.split(",") if part):
        key, equals, value = part.partition("=")
        if number == 0 and not equals:
            found[first] = part
        elif not equals or key not in known or not value:
            raise InputError(
                f"address {address[:80]!r}: {part[:40]!r}, expected {', '.join(f'{k}=...' for k in known)}",
                code=Code.BAD_ADDRESS,
            )
        else:
            found[key] = value
    return found
