"""What the documentation shows: commands with their output, commands that need what only a reader has, programs."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```", re.DOTALL | re.MULTILINE)
INDENTED = re.compile(r"(?:^ {4}\S.*\n)+", re.MULTILINE)
NUMBER = re.compile(r"[-+]?\d+\.\d+|(?<![\w.])\d+(?![\w.])")
# A page stays open until Ctrl-C; tests/ui opens it.
SERVED = re.compile(r"handeye ui\b(?!.*--help)|--ui\b")


@dataclass(frozen=True)
class Step:
    """A command, and the output that is shown after it; empty if none is."""

    command: str
    output: str = ""


def pages() -> list[Path]:
    """Return every page of the documentation."""
    made = {"_build", "reference"}  # by the build, from the code
    return [path for path in sorted(DOCS.rglob("*.md")) if not made & set(path.parts)]


def steps(markdown: str) -> list[Step]:
    """Return the commands of the console blocks; a block of text right after one is its output."""
    found: list[Step] = []
    end = -1
    for block in FENCE.finditer(markdown):
        kind, body = block.groups()
        if kind == "console":
            lines = [re.sub(r"\s+#.*$", "", line) for line in body.replace("\\\n", " ").splitlines()]
            found += [Step(line.strip()) for line in lines if line.strip()]
            end = block.end()
        elif kind == "text" and end >= 0 and not markdown[end : block.start()].strip():
            found[-1] = Step(found[-1].command, body)
        else:
            end = -1
    return found


def unrun(markdown: str) -> list[str]:
    """Return the commands of ours that are shown but not run: with addresses, folders or hours of their own."""
    outputs = {step.output for step in steps(markdown)}
    blocks = [
        body for kind, body in FENCE.findall(markdown) if kind in {"text", "sh"} and body not in outputs
    ]
    blocks += INDENTED.findall(FENCE.sub("", markdown))
    lines = [line.strip() for block in blocks for line in re.sub(r"\\\n\s*", " ", block).splitlines()]
    lines += [step.command for step in steps(markdown) if SERVED.search(step.command)]
    return [re.sub(r"\s+#.*$", "", line) for line in lines if re.match(r"handeye |\S*python3? ", line)]


def words(text: str) -> str:
    """Return a text with every number replaced by one sign, on one line."""
    return " ".join(NUMBER.sub("#", text.replace("#", "")).split())


def numbers(text: str) -> list[float]:
    """Return the numbers of a text."""
    return [float(value) for value in NUMBER.findall(text)]


def parts(output: str) -> list[str]:
    """Return what is shown between lines of three dots."""
    return re.split(r"^\.\.\.$", output, flags=re.MULTILINE)


def run(command: str, folder: Path) -> "subprocess.CompletedProcess[str]":
    """Run a command of a page in a folder."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    return subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env=os.environ | {"PATH": path, "COLUMNS": "120", "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )


def run_page(markdown: str, folder: Path, written: Mapping[str, Path]) -> None:
    """Run the commands of a page one after the other; what is shown must be printed, with about these numbers.

    `written` are folders for commands of which tests elsewhere show that they write such ones.
    """
    for step in steps(markdown):
        if SERVED.search(step.command):
            continue
        if step.command in written and not step.output:
            shutil.copytree(written[step.command], folder / step.command.split()[-1])
            continue
        ran = run(step.command, folder)
        expected = 3 if step.output.startswith("error:") else 0
        assert ran.returncode == expected, f"{step.command}\n{ran.stdout}\n{ran.stderr}"
        check(step, ran.stdout + "\n" + ran.stderr)


def check(step: Step, printed: str) -> None:
    """Compare what is shown of a command with what it printed, each number with the one in its place."""
    place, said, actual = 0, words(printed), numbers(printed)
    for part in parts(step.output):
        found = said.find(words(part), place)
        assert found >= 0, f"{step.command}\nnot printed: {words(part)}\nbut: {said}"
        place = found
        first = said[:found].count("#")
        # Noise levels and accuracies may move a little with the estimator; positions may not.
        for shown, there in zip(numbers(part), actual[first:], strict=False):
            assert abs(there - shown) <= 0.1 + 0.01 * abs(shown), f"{shown} is shown, {there} is printed"
