"""The tutorial works as it stands: its commands run in order and print what it shows."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```(console|text)\n(.*?)^```", re.DOTALL | re.MULTILINE)
NUMBER = re.compile(r"[-+]?\d+\.\d+|(?<![\w.])\d+(?![\w.])")


def steps(markdown: str) -> list[tuple[str, str]]:
    """Commands, each with the output that is shown after it, empty if none is."""
    found: list[tuple[str, str]] = []
    fresh = False
    for kind, body in BLOCK.findall(markdown):
        if kind == "console":
            found += [(line, "") for line in body.splitlines() if line.strip()]
            fresh = True
        elif fresh:
            found[-1] = (found[-1][0], body)
            fresh = False
    return found


def words(text: str) -> str:
    return " ".join(NUMBER.sub("#", text).split())


STEPS = steps((ROOT / "docs" / "tutorial.md").read_text())


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """What each command printed, run one after the other in one folder."""
    folder = tmp_path_factory.mktemp("tutorial")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    outputs: list[str] = []
    for command, shown in STEPS:
        run = subprocess.run(
            ["bash", "-c", command],
            cwd=folder,
            env=os.environ | {"PATH": path, "COLUMNS": "120"},
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )
        expected = 3 if shown.startswith("error:") else 0
        assert run.returncode == expected, f"{command}\n{run.stdout}\n{run.stderr}"
        outputs.append(run.stdout + "\n" + run.stderr)
    return outputs


def test_there_are_commands_with_output() -> None:
    assert len([shown for _, shown in STEPS if shown]) >= 3


@pytest.mark.parametrize("index", [i for i, (_, shown) in enumerate(STEPS) if shown])
def test_what_is_shown_is_printed(index: int, printed: list[str]) -> None:
    shown, output = STEPS[index][1], words(printed[index])
    place = 0
    for part in re.split(r"^\.\.\.$", shown, flags=re.MULTILINE):
        found = output.find(words(part), place)
        assert found >= 0, f"not printed: {words(part)}\nbut: {output}"
        place = found


@pytest.mark.parametrize("index", [i for i, (_, shown) in enumerate(STEPS) if shown])
def test_figures_shown_are_about_those_printed(index: int, printed: list[str]) -> None:
    # Noise levels and accuracies may move a little with the estimator; positions may not.
    actual = [float(value) for value in NUMBER.findall(printed[index])]
    for part in re.split(r"^\.\.\.$", STEPS[index][1], flags=re.MULTILINE):
        for value in map(float, NUMBER.findall(part)):
            near = min(actual, key=lambda other: abs(other - value))
            assert abs(near - value) <= 0.1 + 0.01 * abs(value), f"{value} is shown, {near} is nearest"
