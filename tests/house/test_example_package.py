"""The package of the examples, installed as another package would be: its tests pass, and it calibrates."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from handeye.testing import MockCell
from handeye.types import Pose

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "desk_arm"
LINES = 60


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """A folder to be put on the path, with what an installer writes beside the module."""
    folder = tmp_path / "site"
    shutil.copytree(EXAMPLE, folder)
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    groups = [
        f"[{group}]\n" + "".join(f"{name} = {place}\n" for name, place in points.items())
        for group, points in project["entry-points"].items()
    ]
    beside = folder / f"desk_arm-{project['version']}.dist-info"
    beside.mkdir()
    (beside / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: desk-arm\nVersion: {project['version']}\n"
    )
    (beside / "entry_points.txt").write_text("\n".join(groups))
    return folder


def ran(folder: Path, *command: str | Path) -> str:
    done = subprocess.run(
        [sys.executable, "-m", *map(str, command)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return done.stdout


def test_it_is_short() -> None:
    lines = [line for path in EXAMPLE.iterdir() if path.is_file() for line in path.read_text().splitlines()]
    assert len(lines) <= LINES


def test_it_passes_the_shipped_tests(installed: Path) -> None:
    assert " passed" in ran(installed, "pytest", "-q", "-p", "no:cacheprovider", ".")


def test_it_runs_a_calibration(installed: Path, tmp_path: Path) -> None:
    cell = MockCell("ur5e", seed=4, points_only=True)
    camera, target = cell.write(tmp_path)
    command = [
        "handeye",
        "run",
        "--session",
        tmp_path / "session",
        "--robot",
        "ur5e",
        "--no-confirm",
        "--json",
    ]
    command += ["--driver", "desk_arm:here", "--images", "desk_camera:here", "--policy", "gain_for_the_way"]
    command += ["--camera", camera, "--target", target, "--workspace-mm"]
    command += ["-1100", "-1100", "20", "1100", "1100", "1300"]
    answer = json.loads(ran(installed, *command))
    assert answer["end"] == "accuracy_reached"
    T_flange_camera = Pose(answer["calibration"]["T_flange_camera"])
    assert cell.truth.X is not None
    off = (cell.truth.X @ T_flange_camera).log()
    assert np.linalg.norm(off[:3]) < 0.5e-3
    assert np.rad2deg(np.linalg.norm(off[3:])) < 0.05
