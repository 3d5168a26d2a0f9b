"""What the README shows works: commands, make targets, links."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
FENCE = re.compile(r"^```(?:console|bash|sh|shell)\n(.*?)^```", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\((?!https?://|#|mailto:)([^)\s]+)\)")
# Shown, but not ours to run.
BEFOREHAND = ("cd ", "git clone ")


def shown_commands(markdown: str) -> list[str]:
    """The commands of the fenced shell blocks, in order; output below a line with a prompt is left out."""
    commands: list[str] = []
    for block in FENCE.findall(markdown):
        lines = block.replace("\\\n", " ").splitlines()
        prompted = [line[2:] for line in lines if line.startswith("$ ")]
        commands += prompted or [line for line in lines if line.strip() and not line.startswith("#")]
    return [re.sub(r"\s+#.*$", "", command).strip() for command in commands]


COMMANDS = shown_commands(README.read_text())
OURS = [command for command in COMMANDS if command.split()[0] == "handeye"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the commands run, one after the other: like the root of a clone, without the mess."""
    folder = tmp_path_factory.mktemp("readme")
    for name in ("examples", "fixtures"):
        (folder / name).symlink_to(ROOT / name, target_is_directory=True)
    return folder


def test_blocks_are_understood() -> None:
    console = "```console\n$ handeye demo  # ten seconds\na table\n$ make test\n```\n"
    text = f"{console}\n```bash\nhandeye solve \\\n  a\n```\n"
    assert shown_commands(text) == ["handeye demo", "make test", "handeye solve    a"]


def test_every_command_shown_is_one_we_know() -> None:
    strange = [
        c for c in COMMANDS if c.split()[0] not in {"handeye", "make"} and not c.startswith(BEFOREHAND)
    ]
    assert not strange, strange


@pytest.mark.parametrize("command", OURS)
def test_handeye_command_runs(command: str, folder: Path) -> None:
    if "HANDEYE_DATA" in command and "HANDEYE_DATA" not in os.environ:
        pytest.skip("HANDEYE_DATA does not name the folder of the public recordings")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    run = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", command],
        cwd=folder,
        env=os.environ | {"PATH": path, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert run.returncode == 0, f"{command}\n{run.stdout}\n{run.stderr}"


def test_make_targets_exist() -> None:
    makefile = (ROOT / "Makefile").read_text()
    targets = [t for c in COMMANDS if c.startswith("make") for t in c.split()[1:] if "=" not in t]
    assert {"demo", "test"} <= set(targets)
    missing = [
        target for target in targets if not re.search(rf"^{re.escape(target)}:.*## ", makefile, re.MULTILINE)
    ]
    assert not missing, missing


def test_links_lead_somewhere() -> None:
    targets = [link.split("#")[0] for link in LINK.findall(README.read_text())]
    missing = [target for target in targets if not (ROOT / target).exists()]
    assert not missing, missing
