"""The mock of a cell in ROS 2, in a process of its own; where ROS 2 is not there, tests that want it are skipped."""

import os
import subprocess
import sys

import numpy as np
import pytest

BASE_AND_FLANGE = "base=base,flange=flange"
MODULES = (
    "rclpy",
    "rclpy.action",
    "sensor_msgs.msg",
    "tf2_msgs.msg",
    "control_msgs.action",
    "trajectory_msgs.msg",
)


class Peer:
    """A process that publishes and listens on this machine only."""

    def __init__(self, seed: int = 0) -> None:
        for module in MODULES:
            pytest.importorskip(module, reason=f"ROS 2 is not there ({module}); tools/make_ros2_peer.py")
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
        os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
        self._process = subprocess.Popen(
            [sys.executable, "-m", "handeye.testing.ros2", "--seed", str(seed)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"

    def say(self, line: str) -> None:
        """Tell it what goes wrong from now on; it says when it has heard."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()
        assert self._process.stdout.readline() == "heard\n"

    def joints(self) -> np.ndarray:
        """(n,) where its arm stands, past ROS 2."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("where\n")
        self._process.stdin.flush()
        return np.array([float(word) for word in self._process.stdout.readline().split()])

    def cut(self) -> None:
        """Let nothing of it be heard; the motion that runs goes on."""
        for stream in ("joints", "tf", "image"):
            self.say(f"{stream} silent")

    def mend(self) -> None:
        """Let it be heard again."""
        self.say("well")

    def close(self) -> None:
        """End it."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        assert self._process.wait(20) == 0
        assert self._process.stdout is not None
        self._process.stdout.close()
