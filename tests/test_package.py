"""The package's front door: what is at the top, and what importing it costs."""

import subprocess
import sys
from importlib.metadata import version

import numpy as np
import pytest

import handeye
from folders import made_recording
from handeye.types import Pose


def test_what_is_named_is_there() -> None:
    for name in handeye.__all__:
        assert getattr(handeye, name) is not None
        assert name in dir(handeye)
    assert handeye.__version__ == version("handeye")
    with pytest.raises(AttributeError, match="no attribute 'solv'"):
        _ = handeye.solv  # type: ignore[attr-defined]


def test_importing_it_imports_nothing_heavy() -> None:
    code = "import sys, handeye; print([m for m in ('numpy', 'cv2', 'matplotlib', 'rich', 'handeye._core') if m in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


@pytest.mark.parametrize(
    "code", ["import handeye; handeye.solve", "from handeye.cli.boundary import run; run(['--help'])"]
)
def test_who_drives_nothing_imports_no_driver(code: str) -> None:
    ask = "[m for m in sys.modules if '.drivers.' in m or m.startswith(('handeye.ros', 'handeye.testing'))]"
    whole = f"import sys\ntry:\n    {code}\nexcept SystemExit:\n    pass\nprint({ask})"
    found = subprocess.run([sys.executable, "-c", whole], capture_output=True, text=True, check=True)
    assert found.stdout.splitlines()[-1] == "[]"


def test_it_runs_as_a_module() -> None:
    found = subprocess.run(
        [sys.executable, "-m", "handeye", "--version"], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == f"handeye {version('handeye')}"


def test_solve_and_plan_from_the_top() -> None:
    recording = made_recording(6)
    calibration = handeye.solve(recording)
    assert recording.truth is not None
    assert recording.truth.X is not None
    assert np.abs((calibration.X.inverse() @ recording.truth.X).log()).max() < 5e-3
    poses = [view.T_base_flange @ Pose.exp([0, 0, 0, 0, 0, 0.3]) for view in recording.views]
    ranking = handeye.plan(recording, poses, top=2)
    assert len(ranking.prospects) <= 2
    assert ranking.feasible_count + len(ranking.infeasible) == len(poses)
