"""Ctrl-C is heard while the core works."""

import os
import signal
import threading

import numpy as np
import pytest

from handeye.robots import open_arm


@pytest.mark.skipif(os.name != "posix", reason="sends a signal to itself")
def test_inverse_kinematics_of_many_poses_can_be_interrupted() -> None:
    arm = open_arm("ur5e")
    far = np.tile(np.eye(4), (100_000, 1, 1))  # half an hour, if nobody interrupts
    far[:, 0, 3] = 5.0
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        arm.inverse_all(far)
    timer.join()
