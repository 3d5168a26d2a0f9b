"""The driver of Franka keeps the contract against franky-sim, which speaks libfranka's own protocol."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from handeye.errors import DeviceError, InputError
from handeye.robots import Arm, read_urdf
from handeye.robots.drivers import franka
from handeye.robots.drivers.franka import FrankaRobot
from handeye.robots.protocol import Goal, Robot
from handeye.testing import RobotTests
from handeye.types import Pose
from partners import FciCable, simulated_franka

TURN = np.array([0.2, 0.1, 0.0, -0.1, 0.2, 0.0, -0.2])
HOME = np.array([0.0, -0.3, 0.0, -1.9, 0.0, 1.7, 0.7])


@pytest.fixture(scope="module")
def simulated() -> Iterator[tuple[str, FciCable]]:
    with simulated_franka() as (address, _, cable):
        yield address, cable


class TestContract(RobotTests):
    @pytest.fixture
    def robot(self, simulated: tuple[str, FciCable]) -> Iterator[Robot]:
        made = FrankaRobot(simulated[0])
        yield made
        made.close()

    @pytest.fixture
    def cable(self, simulated: tuple[str, FciCable]) -> tuple[Callable[[], None], Callable[[], None]]:
        return simulated[1].cut, simulated[1].mend

    @pytest.fixture
    def arm(self, simulated: tuple[str, FciCable]) -> Arm:
        import franky_sim

        return read_urdf(Path(franky_sim.__file__).parent / "assets" / "fr3.urdf", tip="fr3_link8")

    @pytest.fixture
    def goals(self, arm: Arm) -> Sequence[Goal]:
        postures = [HOME, HOME + TURN]
        return [Goal(f"view_{i}.1", Pose(arm.forward(q)), tuple(q)) for i, q in enumerate(postures, 1)]

    @pytest.fixture
    def unreachable(self, arm: Arm) -> Goal:
        joints = (9.0,) * 7
        return Goal("far.1", Pose(arm.forward(HOME)), joints)


class WireError(Exception):
    """Stands for what the library raises where the network fails."""


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A library whose robot is not there."""

    def robot(*_: object, **__: object) -> object:
        raise WireError("no route to host")

    made = SimpleNamespace(
        RealtimeConfig=SimpleNamespace(Enforce=1, Ignore=2),
        Exception=WireError,
        NetworkException=WireError,
        Robot=robot,
    )
    monkeypatch.setattr(franka, "library", lambda *_: made)
    return made


def test_who_is_not_there_is_named(library: SimpleNamespace) -> None:
    with pytest.raises(DeviceError, match="no route") as caught:
        FrankaRobot("127.0.0.9")
    assert caught.value.code == "connection_lost"
    assert "FCI" in str(caught.value.hint)
    for address in ("", "127.0.0.9,fast"):
        with pytest.raises(InputError):
            FrankaRobot(address)


def test_a_missing_library_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> ModuleType:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)

    monkeypatch.setattr("handeye.extension.import_module", absent)
    with pytest.raises(DeviceError, match="franky is not installed") as caught:
        FrankaRobot("127.0.0.1")
    assert caught.value.code == "library_missing"
    assert caught.value.hint == "pip install 'handeye[franka]'"
