"""Give readers and commands inputs that are broken at random, and see that each is answered in words.

.venv/bin/python tools/fuzz.py --inputs 100000
.venv/bin/python tools/fuzz.py --only 4711          one input again, with its traceback

Every input follows from the seed and its number. Small examples of the files that handeye reads are made, and
one to three of their places are changed: bits, numbers, words, parts cut, doubled, swapped, taken from
another file. Right is an answer, or an error of handeye with its own words; wrong is any other exception,
exit code 1, more than ten seconds of processor time, more than a gigabyte. Wrong inputs are kept in out/fuzz.
"""

import argparse
import importlib.util
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path
from types import FrameType

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from bags_written import Journey
from bags_written import write as write_bag
from cli.test_verify import touched
from datasets.layouts import some_recording, write_rct, write_rwhe
from datasets.test_hostile import poses_alone
from folders import made_recording, photographed, written
from handeye.cli.boundary import run as run_command
from handeye.datasets import read_camera, read_poses, read_recording, read_rig, read_target, write_rig
from handeye.datasets.images import read_image
from handeye.datasets.touches import read_touches
from handeye.errors import HandeyeError
from handeye.export.result import read_result
from handeye.importing import SourceOptions, open_any, open_folder
from handeye.notations import NOTATIONS, read_pose_text
from handeye.robots import open_arm
from handeye.robots.shapes import read_shapes
from handeye.session.rig_store import open_rig_session
from handeye.session.store import open_session
from handeye.types import Body, CameraView, MountedCamera, MountedTarget, RigRecording
from robots.test_mjcf import MJCF
from sessions import RIG, configured, run_rig
from sessions import run as run_session

ROOT = Path(__file__).resolve().parent.parent
MOST_CPU_S, MOST_BYTES = 10, 1 << 30
BATCH = 200
# Larger folders among the cases are no examples: every input copies one.
MOST_EXAMPLE_BYTES = 500_000
# One in so many inputs goes to a command rather than a reader.
COMMANDS_SHARE = 40
WORDS = (
    *b"nan inf -1 0 1e400 1e-320 -0.0 1,5 [/b] &x; null true [[view]] ../../etc/passwd /dev/zero".split(),
    *b'%s%n !!python "" \' " # \x00 \xff\xfe'.split(),
    *(b"9" * 400, b"0x" + b"f" * 300, b"[" * 500, b"{" * 500, b"<a " * 300, b"\n" * 200, b"\r"),
    "\u00df\u2075\u202e".encode(),
)


@dataclass(frozen=True)
class Example:
    """A small good input: a file, or a folder of which one file is broken, and who reads it."""

    name: str
    path: Path
    read: Callable[[Path], object]


def command(*before: str) -> Callable[[Path], object]:
    """Return what runs a command on a path and refuses exit code 1."""

    def call(path: Path) -> None:
        out, err = StringIO(), StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            code = run_command([*before, str(path), "--json", "--debug"])
        if code == 1:
            raise AssertionError(f"exit code 1: {err.getvalue()[-1500:]}")

    return call


def pose_texts(path: Path) -> None:
    """Read a text as a pose in every notation."""
    text = path.read_bytes().decode("utf-8", "replace")
    for notation in NOTATIONS.values():
        try:
            read_pose_text(text, notation)
        except HandeyeError:
            continue


def arm_and_shapes(path: Path) -> None:
    """Read a description of an arm, and the shapes of its links."""
    read_shapes(path, open_arm(path))


def bag_of(journey: Journey) -> Callable[[Path], object]:
    """Return what opens a bag."""
    options = SourceOptions(target=journey.target, mounting=journey.mounting)
    return lambda path: open_folder(path, options)


def rig() -> RigRecording:
    """Return a recording with two cameras."""
    one = some_recording()
    cameras = {name: MountedCamera(one.camera, Body.FLANGE) for name in ("left", "right")}
    views = [CameraView(name, "table", view) for view in one.views for name in cameras]
    return RigRecording.of_views("two", cameras, {"table": MountedTarget(one.target, Body.BASE)}, views)


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def session(path: Path) -> None:
    """Open a session."""
    open_session(path).close()


def rig_session(path: Path) -> None:
    """Open a session with several cameras."""
    open_rig_session(path).close()


def dry_run(path: Path) -> None:
    """Plan the first motions of an arm that a file describes."""
    command("run", "--dry-run", "--session", str(path.parent / "none"), "--robot")(path)


def examples(folder: Path) -> tuple[list[Example], list[Example]]:
    """Make the examples of readers and of commands."""
    recording = written(made_recording(5), folder / "recording")
    photos, _ = photographed(folder / "photos", count=3)
    run_session(configured(0, most_views=4), folder / "session")
    layouts = [write_rwhe(folder / "rwhe"), write_rct(folder / "rct")]
    (folder / "text").write_text("412.5 -31.2 640.0 178.9 -2.5 91.0\n")
    readers = [
        Example("recording", recording, read_recording),
        Example("session", folder / "session", session),
        Example("pose text", folder / "text", pose_texts),
        *(Example(f"folder {path.name}", path, open_folder) for path in layouts),
    ]
    arms = sorted((ROOT / "python/handeye/robots/arms").glob("*.urdf"))
    (folder / "three.xml").write_text(MJCF)
    arms.append(folder / "three.xml")
    readers += [Example(f"arm {path.name}", path, arm_and_shapes) for path in arms]
    (folder / "poses").mkdir()
    made = list(poses_alone(folder / "poses").values())
    readers += [Example(f"folder {path.name}", path, open_any) for path in made]
    (folder / "touched").mkdir()
    touched_recording, touches = touched(folder / "touched", 0.0)
    readers.append(Example("touches", touches, read_touches))
    run_rig(replace(RIG, most_views=3), folder / "rig session")
    readers.append(Example("rig session", folder / "rig session", rig_session))
    journey = Journey(stations=3, stand_s=0.3, move_s=0.3, picture_hz=5.0, pose_hz=20.0)
    # Written by a peer, which need not be installed.
    peer = importlib.util.find_spec("rosbags") is not None
    bags = [write_bag(folder / "bag", "mcap", journey, picture="jpeg")] if peer else []
    readers += [Example(f"bag {path.name}", path, bag_of(journey)) for path in bags]
    write_rig(rig(), folder / "rig")
    readers.append(Example("rig", folder / "rig", read_rig))
    with redirect_stdout(StringIO()) as printed:
        run_command(["solve", str(recording), "--json"])
    (folder / "result.json").write_text(printed.getvalue())
    readers.append(Example("result", folder / "result.json", read_result))
    pictures = sorted(path for path in photos.rglob("*") if path.suffix in {".png", ".jpg", ".pgm", ".webp"})
    readers += [Example("image", path, read_image) for path in pictures[:2]]
    cases = Path(os.environ.get("HANDEYE_DATA", "/nonexistent")) / "cases"
    for path in sorted(cases.rglob("*")):
        if not path.is_file() or path.stat().st_size > 200_000:
            continue
        if path.suffix in {".yaml", ".yml", ".ini", ".xml"} or "camera" in path.name:
            readers.append(Example(f"camera {path.name}", path, read_camera))
        elif path.suffix in {".csv", ".txt"} and "pose" in path.name:
            readers.append(Example(f"poses {path.name}", path, read_poses))
        elif path.suffix in {".toml", ".json"}:
            readers.append(Example(f"target {path.name}", path, read_target))
    small = [path for path in sorted(cases.glob("*")) if path.is_dir() and _size(path) < MOST_EXAMPLE_BYTES]
    readers += [Example(f"folder {path.name}", path, open_folder) for path in small]
    commands = [
        Example(f"handeye {words[0]}", path, command(*words))
        for path in (recording, folder / "session")
        for words in (
            ("solve",),
            ("plan",),
            ("validate", "--splits", "1"),
            ("arm",),
            ("import",),
            ("doctor",),
            ("replay",),
            ("check", str(recording)),
            ("run", "--resume", "--session"),
        )
    ]
    result, log = folder / "result.json", folder / "nights.jsonl"
    with redirect_stdout(StringIO()):
        run_command(["check", str(recording), str(recording), "--log", str(log)])
    commands += [
        Example(f"handeye {words[0]} of a rig", folder / "rig session", command(*words))
        for words in (("solve",), ("report",), ("validate",), ("run", "--resume", "--session"))
    ]
    commands += [Example(f"handeye solve {path.name}", path, command("solve")) for path in made]
    commands += [Example("handeye run --dry-run", path, dry_run) for path in arms]
    commands += [
        Example("handeye detect", photos, command("detect", "--rows", "6", "--columns", "9")),
        Example("handeye verify", touches, command("verify", str(touched_recording))),
        Example("handeye solve --touches", touches, command("solve", str(touched_recording), "--touches")),
        Example("handeye check --log", log, command("check", str(recording), str(recording), "--log")),
        Example("handeye report", result, command("report")),
        Example("handeye export", result, command("export", "--format", "ros2")),
        Example("handeye diff", result, command("diff", str(result))),
    ]
    return readers, commands


def mutated(content: bytes, other: bytes, random: np.random.Generator) -> bytes:
    """Return content with one to three places changed."""
    data = bytearray(content)
    for _ in range(int(random.integers(1, 4))):
        size = len(data)
        a, b = sorted(int(x) for x in random.integers(0, size + 1, 2))
        b = min(b, a + int(2 ** random.uniform(0, 12)))
        match int(random.integers(0, 9)):
            case 0 if size:
                data[a % size] ^= 1 << int(random.integers(8))
            case 1 if size:
                data[a % size] = int(random.integers(256))
            case 2:
                del data[a:b]
            case 3:
                data[a:a] = data[a:b]
            case 4:
                data[a:a] = WORDS[int(random.integers(len(WORDS)))]
            case 5:
                data[a:b] = WORDS[int(random.integers(len(WORDS)))]
            case 6:
                del data[a:]
            case 7:
                data[a:b] = other[a:b]
            case _:
                data[a:a] = bytes(data[a:b]) * int(2 ** random.uniform(0, 8))
    return bytes(data[: 1 << 22])


class Inputs:
    """The inputs by number."""

    def __init__(self, folder: Path, seed: int) -> None:
        self._readers, self._commands = examples(folder)
        self._seed = seed

    def make(self, number: int, scratch: Path) -> tuple[Example, Path]:
        """Write the input of a number; return the example and the path to be read."""
        random = np.random.default_rng([self._seed, number])
        some = self._commands if number % COMMANDS_SHARE == 0 else self._readers
        example, other = (some[int(i)] for i in random.integers(0, len(some), 2))
        scratch.mkdir()
        if example.path.is_file():
            path = scratch / example.path.name
            path.write_bytes(mutated(example.path.read_bytes(), _content(other, random), random))
            return example, path
        path = scratch / "folder"
        shutil.copytree(example.path, path)
        files = sorted(file for file in path.rglob("*") if file.is_file())
        for index in random.integers(0, len(files), int(random.integers(1, 3))):
            files[int(index)].write_bytes(
                mutated(files[int(index)].read_bytes(), _content(other, random), random)
            )
        return example, path


def _content(example: Example, random: np.random.Generator) -> bytes:
    files = (
        [example.path]
        if example.path.is_file()
        else sorted(p for p in example.path.rglob("*") if p.is_file())
    )
    return files[int(random.integers(len(files)))].read_bytes()


class TooLong(BaseException):
    """Raised after too much processor time."""


def _too_long(number: int, frame: FrameType | None) -> None:
    del number, frame
    raise TooLong


def tried(inputs: Inputs, number: int, scratch: Path) -> tuple[str, str, float]:
    """Try an input in this process; return the example's name, what was wrong (or nothing), seconds."""
    example, path = inputs.make(number, scratch)
    began = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, MOST_CPU_S)
    wrong = ""
    try:
        example.read(path)
    except HandeyeError:
        pass
    except TooLong:
        wrong = f"more than {MOST_CPU_S} s"
    except MemoryError:
        wrong = "more than 1 GB"
    except BaseException as error:  # noqa: BLE001 - what is looked for
        wrong = f"{type(error).__name__}: {str(error)[:300]}\n{traceback.format_exc()[-1500:]}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    return example.name, wrong, time.process_time() - began


def worker(inputs: Inputs, numbers: range, to: int) -> None:
    """Try inputs, and write what came of each into a pipe."""
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MOST_BYTES, used + MOST_BYTES))
    signal.signal(signal.SIGPROF, _too_long)
    with tempfile.TemporaryDirectory() as name, os.fdopen(to, "w") as pipe:
        os.chdir(name)  # commands write beside themselves
        for number in numbers:
            pipe.write(f"begin\t{number}\n")
            pipe.flush()
            scratch = Path(name) / str(number)
            try:
                example, wrong, seconds = tried(inputs, number, scratch)
            except OSError as error:  # names that no file system takes
                example, wrong, seconds = "unwritable", str(error), 0.0
            pipe.write(
                f"end\t{number}\t{example}\t{seconds:.3f}\t{wrong.encode('unicode_escape').decode()}\n"
            )
            pipe.flush()
            shutil.rmtree(scratch, ignore_errors=True)


def outcomes(inputs: Inputs, numbers: range) -> Iterator[tuple[int, str, float, str]]:
    """Try inputs in a process of their own; go on behind one that ends it."""
    while numbers:
        read, write = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(read)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
            try:
                worker(inputs, numbers, write)
            finally:
                os._exit(0)
        os.close(write)
        at = numbers.start
        with os.fdopen(read) as pipe:
            for line in pipe:
                kind, number, *rest = line.rstrip("\n").split("\t", 4)
                at = int(number)
                if kind == "end":
                    yield at, rest[0], float(rest[1]), rest[2]
                    at += 1
        _, status = os.waitpid(child, 0)
        if at in numbers:
            code = os.waitstatus_to_exitcode(status)
            yield at, "?", 0.0, f"the process ended with {code}"
            at += 1
        numbers = range(at, numbers.stop)


def main() -> int:
    """Try all inputs; return 1 if one was not answered in words."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument("--only", type=int, help="number of one input, tried here")
    options = parser.parse_args()
    began, counts, bad, slowest = time.monotonic(), Counter[str](), 0, (0.0, -1, "")
    said = began
    with tempfile.TemporaryDirectory() as name:
        inputs = Inputs(Path(name), options.seed)
        if options.only is not None:
            signal.signal(signal.SIGPROF, _too_long)
            example, wrong, seconds = tried(inputs, options.only, Path(name) / "scratch")
            print(f"{example}: {wrong or 'good'}, {seconds:.2f} s")
            return 1 if wrong else 0
        end = options.first + options.inputs
        for first in range(options.first, end, BATCH):
            for number, example, seconds, wrong in outcomes(inputs, range(first, min(end, first + BATCH))):
                counts[example] += 1
                slowest = max(slowest, (seconds, number, example))
                if wrong:
                    bad += 1
                    kept = Path("out") / "fuzz" / str(number)
                    shutil.rmtree(kept, ignore_errors=True)
                    kept.parent.mkdir(parents=True, exist_ok=True)
                    inputs.make(number, kept)
                    print(f"input {number}, {example}: {wrong}", flush=True)
            if time.monotonic() - said > 60 or time.monotonic() - began > options.seconds:
                said, done = time.monotonic(), counts.total()
                print(
                    f"{done} inputs, {bad} wrong, slowest {slowest[0]:.1f} s ({slowest[2]}, {slowest[1]}), "
                    f"{time.monotonic() - began:.0f} s",
                    flush=True,
                )
            if time.monotonic() - began > options.seconds:
                break
    print(f"{counts.total()} inputs over {len(counts)} examples, {bad} wrong")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
