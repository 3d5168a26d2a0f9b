"""Settings and fixtures of all tests."""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from commands import Handeye

# The same examples in every run; slow machines do not fail tests.
settings.register_profile(
    "handeye",
    deadline=None,
    derandomize=True,
    database=None,
    max_examples=50,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("handeye")
# A longer search with new examples every time: pytest --hypothesis-profile=search
settings.register_profile("search", settings.get_profile("handeye"), derandomize=False, max_examples=3000)


@pytest.fixture(scope="session")
def data_folder() -> Path:
    """The folder of public recordings that HANDEYE_DATA names; skips where there is none."""
    named = os.environ.get("HANDEYE_DATA", "")
    if not named:
        pytest.skip(
            "HANDEYE_DATA is not set: it names the folder with the public recordings (rwhe-calib, ...)"
        )
    folder = Path(named)
    if not folder.is_dir():
        pytest.skip(f"HANDEYE_DATA names {folder}, which is no folder")
    return folder


@pytest.fixture(scope="session")
def rwhe_calib(data_folder: Path) -> Path:
    """The folder with the sets of Ali et al.; skips where it is missing."""
    return _needed(data_folder / "rwhe-calib")


@pytest.fixture(scope="session")
def circle_grid_10x10(data_folder: Path) -> Path:
    """The folder of the 10 x 10 circle grid of robot_cal_tools; skips where it is missing."""
    return _needed(data_folder / "robot_cal_tools" / "test_set_10x10")


def _needed(folder: Path) -> Path:
    if not folder.is_dir():
        pytest.skip(f"{folder} is missing (HANDEYE_DATA names {folder.parent})")
    return folder


@pytest.fixture
def handeye(capsys: pytest.CaptureFixture[str]) -> Handeye:
    """The command line."""
    return Handeye(capsys)
