"""No untested block: commands run and print what is shown, others are understood, programs run."""

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

import shown
from handeye.cli.app import make_app
from handeye.datasets import write_rig
from handeye.datasets.shipped import shipped_recording
from handeye.simulation.cells import CellOptions, ErrorKind, simulate, simulated_arm
from handeye.simulation.example_folder import write_example
from handeye.simulation.rigs import simulate_rig
from handeye.types import Pose

PAGES = {path.relative_to(shown.DOCS).as_posix(): path.read_text() for path in shown.pages()}
WITH_COMMANDS = [name for name, text in PAGES.items() if shown.steps(text)]
# Names that stand for what a reader has.
PYTHON = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
PROGRAMS = [(name, body) for name, text in PAGES.items() for body in PYTHON.findall(text)]
UNRUN = [(name, line) for name, text in PAGES.items() for line in shown.unrun(text)]


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Folders that many pages begin with."""
    folder = tmp_path_factory.mktemp("written")
    write_example(folder / "my_folder", 0)
    write_rig(simulate_rig(ErrorKind.WHITE_FLANGE, 2), folder / "my_rig")
    return {f"handeye demo --{kind} my_{kind}": folder / f"my_{kind}" for kind in ("folder", "rig")}


def test_blocks_are_understood() -> None:
    page = "```console\na  # why\nb\n```\n\n```text\nout 1.5\n```\n\n```text\nhandeye x \\\n  y\n```\n\n    handeye z\n"
    assert shown.steps(page) == [shown.Step("a"), shown.Step("b", "out 1.5\n")]
    assert [line.split() for line in shown.unrun(page)] == [["handeye", "x", "y"], ["handeye", "z"]]
    assert {"solve", "plan", "validate"} <= {
        s.command.split()[1] for s in shown.steps("\n".join(PAGES.values()))
    }
    assert len([s for s in shown.steps(PAGES["tutorial.md"]) if s.output]) >= 3
    with pytest.raises(AssertionError, match="is printed"):
        shown.check(shown.Step("a", "within 2.5 mm"), "2.5 mm of 3.0: within 2.9 mm")
    with pytest.raises(AssertionError, match="not printed"):
        shown.check(shown.Step("a", "two words"), "two other words")


@pytest.mark.parametrize("name", WITH_COMMANDS)
def test_commands_run_and_print_what_is_shown(name: str, tmp_path: Path, written: dict[str, Path]) -> None:
    if name.startswith("commands/"):
        shutil.copytree(shipped_recording(), tmp_path / "recording")
        poses = "name,x,y,z,qx,qy,qz,qw\nleft_high,0.412,-0.120,0.655,0.0,0.9659258,0.0,0.2588190\n"
        (tmp_path / "poses.csv").write_text(poses)
    shown.run_page(PAGES[name], tmp_path, written)


@pytest.mark.parametrize(("name", "line"), UNRUN)
def test_other_commands_are_understood(name: str, line: str) -> None:
    tokens = shlex.split(re.sub(r"\[([^]]*)\]", r"\1", line).replace("...", ""))
    if tokens[0] != "handeye":
        assert (shown.ROOT / tokens[1]).is_file() or tokens[1] == "-m", f"{name}: {line}"
        return
    if "<" in line or "&&" in tokens:
        tokens = tokens[: tokens.index("&&")] if "&&" in tokens else tokens
    make_app().parse_args(tokens[1:], exit_on_error=False, print_error=False)


def needs_a_reader(body: str) -> bool:
    """Tell whether a program speaks of something that only its reader has."""
    return re.search(r"\bconnect\(|MyRobot\(|RealSenseCamera\(|\[\.\.\.\]", body) is not None


@pytest.mark.parametrize(("name", "body"), PROGRAMS)
def test_programs_run(name: str, body: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    recording = simulate(ErrorKind.WHITE_FLANGE, 3, CellOptions(views=(9, 9)))
    code = compile(body, name, "exec")
    if needs_a_reader(body):
        return
    arm, views = simulated_arm(), recording.views
    q = np.array(views[0].joints_rad)
    exec(
        code,
        {
            "__name__": name,
            "recording": recording,
            "camera": recording.camera,
            "board": recording.target,
            "my_rows": [(v.name, v.T_base_flange.matrix, v.pixels) for v in views],
            "kinematics": None,
            "arm": arm,
            "q": q,
            "T_base_flange": Pose(arm.forward(q)),
            "near": q,
        },
    )
