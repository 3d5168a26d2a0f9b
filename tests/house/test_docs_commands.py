"""The commands that the documentation shows on our own recording work as they stand."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from handeye.datasets.shipped import shipped_recording

ROOT = Path(__file__).resolve().parents[2]
FENCE = re.compile(r"^```console\n(.*?)^```", re.DOTALL | re.MULTILINE)


def shown() -> list[str]:
    """The commands of the console blocks of the pages about commands."""
    lines = [
        re.sub(r"\s+#.*$", "", line)
        for page in sorted((ROOT / "docs" / "commands").glob("*.md"))
        for block in FENCE.findall(page.read_text())
        for line in block.splitlines()
    ]
    # A page stays open until Ctrl-C; tests/ui opens it.
    served = re.compile(r"handeye ui\b|--ui\b")
    return [line for line in lines if line.startswith("handeye ") and not served.search(line)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the pages speak of: a recording, and candidate poses."""
    folder = tmp_path_factory.mktemp("docs")
    shutil.copytree(shipped_recording(), folder / "recording")
    poses = "name,x,y,z,qx,qy,qz,qw\nleft_high,0.412,-0.120,0.655,0.0,0.9659258,0.0,0.2588190\n"
    (folder / "poses.csv").write_text(poses)
    return folder


def test_there_are_commands() -> None:
    assert {command.split()[1] for command in shown()} >= {"solve", "plan", "validate"}


@pytest.mark.parametrize("command", shown())
def test_command_runs(command: str, folder: Path) -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    run = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env=os.environ | {"PATH": path},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert run.returncode == 0, f"{command}\n{run.stdout}\n{run.stderr}"
