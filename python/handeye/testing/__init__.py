"""The tests of every family, for packages that bring members of their own; they need pytest.

A package subclasses the class of its family and gives the fixtures that its docstring names; pytest does the
rest. Our own members are tested by the same classes.

>>> from handeye.testing import PolicyTests                              # doctest: +SKIP
>>> class TestMine(PolicyTests):                                         # doctest: +SKIP
...     @pytest.fixture
...     def policy(self):
...         return MyPolicy()
"""

import pytest

# Before the modules are imported: what an assertion compared is shown where it fails.
for _name in ("cameras", "importers", "policies", "robots", "stop_rules", "targets"):
    pytest.register_assert_rewrite(f"handeye.testing.{_name}")

# ruff: noqa: E402
from handeye.testing.cameras import CameraTests
from handeye.testing.cell import MockCell
from handeye.testing.importers import ImporterTests
from handeye.testing.policies import PolicyTests
from handeye.testing.robots import RobotTests
from handeye.testing.stop_rules import StopRuleTests
from handeye.testing.targets import TargetTests

__all__ = [
    "CameraTests",
    "ImporterTests",
    "MockCell",
    "PolicyTests",
    "RobotTests",
    "StopRuleTests",
    "TargetTests",
]
