"""Every way a command can end, in words, in JSON and as an exit code."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from cyclopts import App

from commands import Handeye
from handeye.cli import boundary, main
from handeye.cli.answer import Answer
from handeye.cli.app import COMMANDS, make_app
from handeye.cli.options import Common
from handeye.errors import DegenerateError, DetectionError, HandeyeError, InputError, OutputError, SolveError

BINARY = Path(sys.executable).parent / "handeye"


class Ending:
    """A command that ends as told."""

    def __init__(self) -> None:
        self.how: BaseException | Answer = Answer({"a": 1}, lambda console: console.print("one"))

    def run(self, common: Common = Common()) -> Answer:  # noqa: B008
        """End."""
        if isinstance(self.how, Answer):
            return self.how
        raise self.how


@pytest.fixture
def ending(monkeypatch: pytest.MonkeyPatch) -> Ending:
    ending = Ending()

    def app(named: str) -> App:
        app = App(name="handeye", result_action="return_value", suppress_keyboard_interrupt=False)
        app.command(ending.run, name="run")
        return app

    monkeypatch.setattr(boundary, "make_app", app)
    return ending


def test_answer_for_a_person_and_for_a_program(handeye: Handeye, ending: Ending) -> None:
    assert handeye("run").out == "one\n"
    outcome = handeye("run", "--json")
    assert (outcome.code, outcome.data, outcome.err) == (0, {"a": 1}, "")


@pytest.mark.parametrize(
    ("kind", "code"),
    [(InputError, 3), (DegenerateError, 4), (DetectionError, 5), (SolveError, 6), (OutputError, 7)],
)
def test_each_kind_of_error_has_its_exit_code(
    handeye: Handeye, ending: Ending, kind: type[HandeyeError], code: int
) -> None:
    ending.how = kind("this went wrong", code="some_word", hint="do that")
    outcome = handeye("run")
    assert (outcome.code, outcome.out) == (code, "")
    assert outcome.err == "error: this went wrong\nhint: do that\n"
    assert handeye("run", "--json").error == {
        "code": "some_word",
        "message": "this went wrong",
        "hint": "do that",
        "exit_code": code,
    }


def test_error_without_hint_has_the_advice_of_its_code(handeye: Handeye, ending: Ending) -> None:
    ending.how = InputError("so", code="truncated_image")
    assert handeye("run").err == "error: so\nhint: copy the file again\n"
    assert handeye("run", "--json").error["hint"] == "copy the file again"


def test_code_of_another_package_has_no_hint(handeye: Handeye, ending: Ending) -> None:
    ending.how = InputError("so", code="lamp_off")
    assert handeye("run").err == "error: so\n"
    assert handeye("run", "--json").error["hint"] is None


def test_mistake_is_short_and_asks_for_a_report(handeye: Handeye, ending: Ending) -> None:
    ending.how = ZeroDivisionError("division by zero")
    outcome = handeye("run")
    assert outcome.code == 1
    assert outcome.err.startswith("error: unexpected ZeroDivisionError: division by zero\nhint: ")
    assert "report" in outcome.err
    assert "Traceback" not in outcome.err
    assert handeye("run", "--json").error["code"] == "unexpected"


def test_debug_shows_where(handeye: Handeye, ending: Ending) -> None:
    ending.how = ZeroDivisionError("division by zero")
    error = handeye("run", "--debug").err
    assert "Traceback" in error
    assert "test_boundary.py" in error
    ending.how = InputError("so")
    assert "test_boundary.py" in handeye("run", "--debug").err


def test_interruption(handeye: Handeye, ending: Ending) -> None:
    ending.how = KeyboardInterrupt()
    outcome = handeye("run")
    assert (outcome.code, outcome.err) == (130, "interrupted\n")


def test_nan_is_null(handeye: Handeye, ending: Ending) -> None:
    ending.how = Answer({"a": float("nan")}, lambda console: None)
    assert handeye("run", "--json").data == {"a": None}


@pytest.mark.parametrize("arguments", [["--wrong"], ["wrong"], ["solve"], ["solve", "a", "b"], ["solve", "a", "--splits", "3"], ["demo", "--starts", "x"], ["plan", "a", "--criterion", "beauty"], ["solve", "a", "--mounting", "nowhere"]])  # fmt: skip
def test_usage(handeye: Handeye, arguments: list[str]) -> None:
    error = handeye.fails(*arguments)
    assert (error["exit_code"], error["code"]) == (2, "usage")
    assert "--help" in error["hint"]
    assert "\n" not in error["message"]


def test_help_lists_every_command(handeye: Handeye) -> None:
    outcome = handeye("--help")
    assert outcome.code == 0
    words = " ".join(outcome.out.replace("│", " ").split())
    for name, _, line in COMMANDS:
        assert f" {name} {line}" in words


@pytest.mark.parametrize("name", [name for name, _, _ in COMMANDS])
def test_every_command_explains_itself(handeye: Handeye, name: str) -> None:
    outcome = handeye(name, "--help")
    assert outcome.code == 0
    assert f"handeye {name}" in outcome.out
    assert make_app(name)[name].help


def test_version(handeye: Handeye) -> None:
    assert handeye("--version").out.startswith("handeye ")


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys\nfrom handeye.cli.boundary import run\nrun(['--help'])\n"
        "heavy = {'cv2', 'numpy', 'matplotlib', 'joblib', 'handeye._core'} & set(sys.modules)\n"
        "sys.exit(f'loaded {heavy}' if heavy else 0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def started(*arguments: str, **how: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([BINARY, *arguments], check=False, text=True, timeout=60, **how)  # type: ignore[call-overload]


def test_reader_that_goes_away_is_no_traceback() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        outcome = started("--help", stdout=writing, stderr=subprocess.PIPE)
    finally:
        os.close(writing)
    assert (outcome.returncode, outcome.stderr) == (7, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_full_disk_behind_stdout() -> None:
    with Path("/dev/full").open("w") as full:
        outcome = started("--version", stdout=full, stderr=subprocess.PIPE)
    assert outcome.returncode == 7
    assert "cannot be written" in outcome.stderr
    assert "Traceback" not in outcome.stderr


def test_entry_point() -> None:
    outcome = started("solve", "nowhere", "--json", capture_output=True)
    assert outcome.returncode == 3
    assert '"code": "missing_file"' in outcome.stdout


def test_interrupted_process_ends_with_130(tmp_path: Path) -> None:
    code = "import handeye.cli.boundary as b\n" + "def app(named):\n    raise KeyboardInterrupt\n"
    code += "b.make_app = app\nraise SystemExit(b.run([]))"
    assert subprocess.run([sys.executable, "-c", code], check=False, capture_output=True).returncode == 130


WHILE_IT_STARTS = """
class Boundary:
    def find_spec(name, *_):
        if "boundary" in name:
            raise KeyboardInterrupt
sys.meta_path.insert(0, Boundary)
"""
WHILE_IT_SAYS_SO = """
import handeye.cli.boundary as b
def interrupted(_):
    raise KeyboardInterrupt
b.make_app = b._complain = interrupted
"""


@pytest.mark.parametrize("there", [WHILE_IT_STARTS, WHILE_IT_SAYS_SO])
def test_an_interruption_outside_the_boundary_is_one_too(there: str) -> None:
    code = f"import sys\n{there}\nfrom handeye.cli import main\nmain()"
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True)
    assert (done.returncode, done.stderr) == (130, b"")


@pytest.mark.parametrize(
    ("typed", "meant"), [("slove", "solve"), ("valdate", "validate"), ("improt", "import")]
)
def test_a_slip_of_the_fingers_is_understood(handeye: Handeye, typed: str, meant: str) -> None:
    error = handeye.fails(typed, "folder")
    assert error["code"] == "usage"
    assert error["hint"].startswith(f"did you mean {meant}?")
    assert "did you mean" not in handeye.fails("xyzzy")["hint"]


def test_help_is_a_command_too(handeye: Handeye) -> None:
    assert "solve" in handeye("help").out
    assert "--notation" in handeye("help", "solve").out


def test_linear_algebra_of_a_command_runs_on_one_thread_unless_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["handeye", "--version"])
    for given, expected in ((None, "1"), ("2", "2")):
        monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
        if given is not None:
            monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
        with pytest.raises(SystemExit):
            main()
        assert os.environ["OPENBLAS_NUM_THREADS"] == expected
