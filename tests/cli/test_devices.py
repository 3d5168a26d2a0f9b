"""`handeye devices`: every driver with its state, whatever drivers of others do."""

from importlib.metadata import EntryPoint

import pytest

from commands import Handeye
from handeye.errors import DeviceError
from handeye.session import devices


class Seeing:
    @staticmethod
    def found() -> list[tuple[str, str]]:
        return [("12", "a \x1b[31mcamera"), ("13", "[/b]")]


class WithoutLibrary:
    @staticmethod
    def found() -> list[tuple[str, str]]:
        raise DeviceError("the library x is not installed", code="library_missing", hint="pip install x")


class Falling:
    @staticmethod
    def found() -> list[tuple[str, str]]:
        raise RuntimeError("no bus")


class Babbling:
    @staticmethod
    def found() -> list[str]:
        return ["abc"]


class Silent:
    pass


PLACES = {kind.__name__.lower(): kind for kind in (Seeing, WithoutLibrary, Falling, Babbling, Silent)}


class Point(EntryPoint):
    def load(self) -> object:
        if self.name == "absent":
            raise ModuleNotFoundError("No module named 'absent'")
        return PLACES[self.name]


@pytest.fixture(autouse=True)
def _others(monkeypatch: pytest.MonkeyPatch) -> None:
    others = {name: Point(name, "m:f", "g") for name in [*PLACES, "absent"]}
    monkeypatch.setattr(devices, "announced", lambda group: others if "cameras" in group else {})


def test_every_driver_has_a_state(handeye: Handeye) -> None:
    drivers = {driver["name"]: driver for driver in handeye.json("devices")["drivers"]}
    assert {name: drivers[name]["state"] for name in [*PLACES, "absent"]} == {
        "seeing": "found",
        "withoutlibrary": "missing",
        "falling": "broken",
        "babbling": "broken",
        "silent": "ready",
        "absent": "broken",
    }
    assert [device["address"] for device in drivers["seeing"]["devices"]] == ["12", "13"]
    assert drivers["withoutlibrary"]["hint"] == "pip install x"
    assert "no bus" in drivers["falling"]["detail"]


def test_it_is_shown_without_what_would_steer_a_terminal(handeye: Handeye) -> None:
    shown = handeye("devices")
    assert shown.code == 0
    assert "seeing:12  a ?[31mcamera" in shown.out
    assert "[/b]" in shown.out
    assert "pip install x" in shown.out
