"""Whole calibrations by `handeye run` through what the makers and ROS 2 offer to test against, where it is installed."""

import os
import sys
from argparse import Namespace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import pytest

from ros2_peer import MODULES

TOOL = Path(__file__).resolve().parents[2] / "tools" / "measure_drivers.py"
PARTNERS = {
    "ur, basler": ("ur", "basler", ("pypylon.pylon",)),
    "franka": ("franka", "mock", ("franky", "franky_sim")),
    "ros2": ("ros2", "mock", MODULES),
}

# Libraries of others warn of what is theirs.
pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = spec_from_file_location("measure_drivers", TOOL)
    assert spec is not None
    assert spec.loader is not None
    made = module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


@pytest.mark.parametrize("seed", [int(seed) for seed in os.environ.get("HANDEYE_SEEDS", "1").split()])
@pytest.mark.parametrize("name", PARTNERS)
def test_it_ends_at_the_truth(
    name: str, seed: int, tool: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, camera, modules = PARTNERS[name]
    monkeypatch.setenv("PYLON_CAMEMU", "1")  # read when the library is loaded
    for module in modules:
        pytest.importorskip(module, reason=f"{module} is not installed")
    found = tool.calibrated(Namespace(robot=robot, camera=camera, pace=4.0), seed, tmp_path)
    sys.stdout.write(f"{found}\n")
    assert found["end"] == "accuracy_reached"
    assert found["off_mm"] < 0.5
    assert found["off_deg"] < 0.05
    if robot == "ros2":
        assert found["bag_apart_mm"] < 0.5
        assert found["bag_apart_deg"] < 0.05
