"""An arm, its camera and a policy; a mock stands where a package would talk to a device."""

import numpy as np

from handeye.planning.policies import Choice, Policy
from handeye.robots.protocol import Reading
from handeye.testing import MockCell

DEVICE = MockCell("ur5e", seed=4, points_only=True)


class DeskArm:
    def __init__(self, address):
        self.device = DEVICE  # such as socket.create_connection((address, 4000))

    def move_to(self, goal):
        self.device.stand(goal.joints_rad)  # which raises DeviceError(..., code="motion_refused")

    def read_pose(self):
        return Reading(self.device.T_base_flange, self.device.joints_rad)

    def stop(self):
        pass  # it never moves for long


def desk_camera(address):
    return DEVICE  # a camera is what has grab(label)


class GainForTheWay(Policy):
    name = "gain_for_the_way"

    def choose(self, situation):
        way_m = np.linalg.norm(
            situation.pool.positions - situation.views[-1].T_base_flange.translation, axis=1
        )
        score = situation.gains / (0.1 + way_m)
        return Choice(int(np.nanargmax(score)), float(np.nanmax(score)))
