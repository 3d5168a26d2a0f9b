import pytest
from desk_arm import DEVICE, DeskArm, GainForTheWay

from handeye.testing import PolicyTests, RobotTests


class TestArm(RobotTests):
    takes_time = False
    robot = pytest.fixture(lambda self: DeskArm(""))
    goals = pytest.fixture(lambda self: DEVICE.goals())


class TestPolicy(PolicyTests):
    policy = pytest.fixture(lambda self: GainForTheWay())
