"""Press Ctrl-C while commands work, and measure how soon they end.

.venv/bin/python tools/interrupt_commands.py --times 3

Of each command: at so many instants between its start and `--seconds`. Right is exit code 130 (or an end just
before), within half a second; a run on a driver that hangs, and the page, are among them. Before a line of
handeye is run, and after the last, Python itself ends of the signal, which shells call 130 too.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from try_hostile_drivers import ARM, SPACE, ours

from bags_written import Journey
from bags_written import write as write_bag
from folders import made_recording, photographed, written
from handeye.errors import ExitCode

HANDEYE = (sys.executable, "-c", "from handeye.cli import main; main()")
SOONEST_S, ENOUGH_S = 0.02, 0.5
# A command line that is refused has not been interrupted.
RIGHT = {0, ExitCode.INTERRUPTED, -signal.SIGINT}


def commands(folder: Path) -> dict[str, tuple[str, ...]]:
    """Return command lines by what they do; files are made in a folder."""
    recording = str(written(made_recording(12), folder / "recording"))
    photos, _ = photographed(folder / "photos", count=8)
    board = ("--rows", "5", "--columns", "7")
    (folder / "drivers").mkdir()
    drivers = ours(folder / "drivers")
    files = ("--camera", str(drivers.camera_file), "--target", str(drivers.target_file))
    stuck = ("--robot", ARM, *files, *SPACE, "--no-confirm")
    journey = Journey(stations=8, stand_s=0.5, move_s=0.3, picture_hz=10.0, pose_hz=50.0)
    bag = str(write_bag(folder / "bag", "mcap", journey, picture="png"))
    (folder / "target.json").write_text(drivers.target_file.read_text())
    new = str(folder / "NEW")
    return {
        "solve": ("solve", recording),
        "validate": ("validate", recording, "--splits", "200"),
        "doctor": ("doctor", recording),
        "plan": ("plan", recording),
        "detect": ("detect", str(photos), *board),
        "import": ("import", str(photos), new, *board),
        "import a bag": ("import", bag, new, "--rows", "6", "--columns", "8", "--pitch-mm", "30"),
        "expect": ("expect", "--robot", "ur5e"),
        "demo": ("demo",),
        "study": ("study", "twin", "--workers", "1"),
        "study, two processes": ("study", "twin", "--workers", "2"),
        "run, points": ("run", "--session", new, "--points-only", "0.1", "--accuracy-mm", "0.01"),
        "run, rendered": ("run", "--session", new, "--accuracy-mm", "0.01", "--seed", "3"),
        "run, robot hangs": (
            *("run", "--session", new, "--driver", "hostile:stuck", "--images", "hostilecam:ok", *stuck),
        ),
        "run, camera hangs": (
            *("run", "--session", new, "--driver", "hostile:ok", "--images", "hostilecam:stuck", *stuck),
        ),
        "run, no picture comes": (
            *("run", "--session", new, "--driver", "hostile:ok", "--images", f"folder:{folder}", *stuck),
        ),
        "page": ("ui", recording),
        "target": ("target", "charuco", "--rows", "40", "--columns", "30", "--output", f"{new}.pdf"),
        "bench": ("bench", "loop"),
    }


def interrupted(line: tuple[str, ...], folder: Path, after_s: float) -> tuple[int | None, float, str]:
    """Interrupt a command; return its exit code, the seconds that it took then, and what it said last."""
    path = os.pathsep.join([str(folder / "drivers"), str(Path(__file__).resolve().parent)])
    environment = dict(os.environ) | {"PYTHONPATH": path, "HOSTILE_LOG": os.devnull, "HOSTILE_POINTS": "1"}
    child = subprocess.Popen(
        [*HANDEYE, *line],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A shell's background jobs are started deaf to Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # noqa: PLW1509
    )
    try:
        _, said = child.communicate(timeout=after_s)
    except subprocess.TimeoutExpired:
        began = time.monotonic()
        os.killpg(child.pid, signal.SIGINT)  # as a terminal does
        try:
            _, said = child.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            child.communicate()
            return None, 20.0, "killed after 20 s"
        return child.returncode, time.monotonic() - began, " ".join(said.split()[-12:])
    return child.returncode, 0.0, " ".join(said.split()[-12:])


def main() -> int:
    """Interrupt everything; return 1 if a command did not end soon."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=3.0, help="latest")
    parser.add_argument("--only", nargs="+", default=[""], help="words of their names")
    options = parser.parse_args()
    late = 0
    for name in commands_named(options.only):
        worst, codes, words = 0.0, list[int | None](), ""
        for k in range(options.times):
            with tempfile.TemporaryDirectory() as scratch:
                line = commands(Path(scratch))[name]
                share = (k + 0.5) / options.times
                after_s = SOONEST_S + share * (options.seconds - SOONEST_S)
                code, seconds, said = interrupted(line, Path(scratch), after_s)
            codes.append(code)
            if seconds >= worst:
                worst, words = seconds, said
        wrong = worst > ENOUGH_S or not RIGHT.issuperset(codes)
        late += wrong
        print(
            f"{'LATE' if wrong else 'ok':<5}{name:<24} {worst:.2f} s, exit {codes} | {words[:160]}",
            flush=True,
        )
    return 1 if late else 0


def commands_named(words: list[str]) -> list[str]:
    """Return the names of the commands with one of these words."""
    with tempfile.TemporaryDirectory() as scratch:
        return [name for name in commands(Path(scratch)) if any(word in name for word in words)]


if __name__ == "__main__":
    sys.exit(main())
