"""Run sessions on drivers with one fault each, and count what must never happen.

.venv/bin/python tools/try_hostile_drivers.py --rendered
.venv/bin/python tools/try_hostile_drivers.py --sessions 200 --first 100
.venv/bin/python tools/try_hostile_drivers.py --drivers $HANDEYE_DATA/cases/hostile/evil_driver

The drivers are those of `hostile_drivers.py`, or with `--drivers` a folder with `evil.py`, which announces
`evil:MODE` as robot and `evilcam:MODE` as camera. Both log every motion: whether the joints sent are beyond
a limit, and how many motions run at once. Counted are goals beyond limits, motions at once, robots that are
closed while they move, exit codes that mean a mistake of ours, answers outside twice their stated radius, and
sessions that do not go on with --resume. `--sessions` mixes faults of robot and camera in 30 % of the calls.
"""

import argparse
import json
import os
import re
import signal
import sys
import tempfile
import time
import traceback
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

# Imported once for all runs.
import handeye.cli.run
import handeye.cli.run_answer
import handeye.report  # noqa: F401
from handeye.cli.boundary import run as run_command

EVIL_ROBOT = """
ok raise raise_once sysexit kbd hang hang_once slow refuse half elsewhere ignore mem longmsg binmsg degrees
degrees_nojoint offset offset_nojoints frozen none matrix nanjoints fewjoints manyjoints emptyjoints nppose
npjoints strjoints mm inverse nanpose readhang stopraise stophang
"""
EVIL_CAMERA = """
none array raise hang hang_once stale stalenoise colour size float readonly strided fortran flip rot black
noise tsnan tsstr points_nan points_dup points_out points_many points_list
"""
ENTRY_POINTS = """
[handeye.robots]
hostile = hostile_drivers:Robot
[handeye.cameras]
hostilecam = hostile_drivers:Camera
"""
# Few views, much asked for, little patience: the faults come at the fourth motion or picture.
ASKED = ("--accuracy-mm", "0.02", "--accuracy-deg", "0.002", "--no-confirm", "--json")
SPACE = ("--workspace-mm", "-900", "-900", "20", "900", "900", "1400")
ARM = "epson_c4l"


@dataclass(frozen=True)
class Told:
    """What is told of the cell, and what is true of it."""

    camera: dict[str, Any]
    target: dict[str, Any]
    T_camera_flange: np.ndarray
    robot_modes: tuple[str, ...]
    camera_modes: tuple[str, ...]


def told() -> Told:
    """Return it from a process of its own: threads of the core would not live on in those that are forked."""
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(_told).result()


def _told() -> Told:
    from hostile_drivers import CAMERA_MODES, CELL, ROBOT_MODES  # noqa: PLC0415 - in that process only

    made = CELL
    assert made.truth.X is not None
    return Told(
        made.cell.camera.to_dict(), made.cell.target.to_dict(), made.truth.X.matrix, ROBOT_MODES, CAMERA_MODES
    )


@dataclass(frozen=True)
class Drivers:
    """Where the drivers are, what they are called, and the files of camera and target."""

    path: tuple[Path, ...]
    robot: str
    camera: str
    camera_file: Path
    target_file: Path
    robot_modes: tuple[str, ...]
    camera_modes: tuple[str, ...]
    T_camera_flange: np.ndarray


def ours(folder: Path) -> Drivers:
    """Announce our own drivers in an empty folder."""
    announced = folder / "hostile-1.0.dist-info"
    announced.mkdir()
    (announced / "METADATA").write_text("Metadata-Version: 2.1\nName: hostile\nVersion: 1.0\n")
    (announced / "entry_points.txt").write_text(ENTRY_POINTS)
    cell = told()
    (folder / "camera.json").write_text(json.dumps(cell.camera))
    (folder / "target.json").write_text(json.dumps(cell.target))
    path = (folder, Path(__file__).resolve().parent)
    files = folder / "camera.json", folder / "target.json"
    return Drivers(
        path, "hostile", "hostilecam", *files, cell.robot_modes, cell.camera_modes, cell.T_camera_flange
    )


def run(
    arguments: list[str], environment: dict[str, str], folder: Path, seconds: float, truth: np.ndarray
) -> dict[str, Any]:
    """Run a command in a process of its own; return its exit code, what it said and how far off it is."""
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            code = called(arguments, environment, folder)
        except BaseException:  # noqa: BLE001 - what is not caught there is what is looked for
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    status = None
    while status is None:
        pid, ended = os.waitpid(child, os.WNOHANG)
        if pid:
            status = os.waitstatus_to_exitcode(ended)
        elif time.monotonic() - began > seconds:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return {"code": "timeout", "said": "", "seconds": seconds}
        else:
            time.sleep(0.02)
    printed, errors = ((folder / name).read_text(errors="replace") for name in ("stdout", "stderr"))
    said = errors.strip().splitlines()
    return {
        "code": status,
        "said": next((line for line in reversed(said) if line.startswith("error")), said[-1] if said else ""),
        "seconds": time.monotonic() - began,
        "traceback": "Traceback" in errors or "PanicException" in errors,
        "failures": sorted(set(re.findall(r"s  ([a-z_]+): ", errors))),
        "off": off(printed, truth),
    }


def called(arguments: list[str], environment: dict[str, str], folder: Path) -> int:
    """Run a command in this process, which has imported all that it needs; return its exit code."""
    for name, number in (("stdout", 1), ("stderr", 2)):
        os.dup2(os.open(folder / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.chdir(folder)
    os.environ.update(environment)
    sys.path[:0] = environment["PYTHONPATH"].split(os.pathsep)
    return run_command(arguments)


def off(printed: str, truth: np.ndarray) -> float:
    """Return by how many times its stated radius an answer is off; 0 without an answer."""
    try:
        answer = json.loads(printed[printed.index("\n{\n" if printed[:1] != "{" else "{") :])
        found, within = answer["calibration"]["T_flange_camera"], answer["within_95"]
    except (ValueError, KeyError, TypeError):
        return 0.0
    if found is None or within is None:
        return 0.0
    matrix = np.array(found["matrix"] if isinstance(found, dict) else found)
    error = truth @ matrix
    angle = np.rad2deg(np.arccos(np.clip((np.trace(error[:3, :3]) - 1) / 2, -1, 1)))
    distance = 1e3 * float(np.linalg.norm(matrix[:3, 3] - np.linalg.inv(truth)[:3, 3]))
    return max(distance / within["translation_mm"], float(angle) / within["rotation_deg"])


def attempt(drivers: Drivers, robot: str, camera: str, options: argparse.Namespace) -> dict[str, Any]:
    """Run a session on one robot and one camera, then go on with it, the second time without faults."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log = folder / "motions.log"
        environment = {
            "PYTHONPATH": os.pathsep.join(map(str, drivers.path)),
            "EVIL_LOG": str(log),
            "HOSTILE_LOG": str(log),
            "EVIL_SLOW": "2.5",
        }
        if not options.rendered:
            environment |= {"EVIL_POINTS": "1", "HOSTILE_POINTS": "1"}
        command = ["run", "--session", "session"]
        patience = str(options.patience_s)
        first = [
            *("--robot", ARM, "--driver", robot, "--images", camera),
            *("--camera", str(drivers.camera_file), "--target", str(drivers.target_file)),
            *SPACE,
            *ASKED,
            *("--max-views", str(options.views), "--move-timeout-s", "1.5"),
            *("--read-timeout-s", patience, "--camera-timeout-s", patience),
        ]
        truth = drivers.T_camera_flange
        outcome = run([*command, *first], environment, folder, options.seconds, truth)
        began = (folder / "session").exists()
        again: list[dict[str, Any]] = []
        for faults in ({}, {"HOSTILE_CALM": "1"}) if began else ():
            line = [*command, "--resume", "--no-confirm", "--json"]
            again.append(run(line, environment | faults, folder, options.seconds, truth))
        events = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
        moves = [event for event in events if event.get("event") == "move"]
        closed = [event for event in events if event.get("event") == "close"]
        return {
            **outcome,
            "began": began,
            "again": [one["code"] for one in again],
            "traceback": any(one.get("traceback") for one in (outcome, *again)),
            "offs": [one.get("off", 0.0) for one in (outcome, *again)],
            "moves": len(moves),
            "beyond": sum(bool(move["beyond"]) for move in moves),
            "concurrent": sum(move["concurrent"] > 1 for move in moves),
            "closed": len(closed),
            "closed_early": sum(
                event.get("event") == "close" and event["concurrent"] > 0 for event in events
            ),
        }


def main() -> int:
    """Run every mode; return 1 if anything happened that must not."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--drivers", type=Path, help="folder with evil.py; by default our own")
    parser.add_argument("--modes", nargs="*", help="only these, of robot or camera")
    parser.add_argument("--part", type=int, nargs=2, default=(0, 1), help="the k-th of n parts of the modes")
    parser.add_argument("--sessions", type=int, default=0, help="sessions with mixed faults instead")
    parser.add_argument("--first", type=int, default=0, help="seed of the first of them")
    parser.add_argument("--rendered", action="store_true", help="pictures instead of points")
    parser.add_argument("--views", type=int, default=8, help="most views")
    parser.add_argument("--patience-s", type=float, default=1.0, help="for readings and pictures")
    parser.add_argument("--seconds", type=float, default=120.0, help="longest run")
    options = parser.parse_args()
    bad, stuck, worst = 0, 0, 0.0
    with tempfile.TemporaryDirectory() as name:
        if options.drivers is None:
            drivers = ours(Path(name))
        else:
            folder = options.drivers.resolve()
            files = folder / "simcam.json", folder / "simtarget.json"
            modes = tuple(EVIL_ROBOT.split()), tuple(EVIL_CAMERA.split())
            drivers = Drivers((folder,), "evil", "evilcam", *files, *modes, told().T_camera_flange)
        good = f"{drivers.robot}:ok,99", f"{drivers.camera}:ok,99"
        cases = [(f"{drivers.robot}:{mode}", good[1]) for mode in drivers.robot_modes]
        cases += [(good[0], f"{drivers.camera}:{mode}") for mode in drivers.camera_modes]
        if options.modes:
            wanted = {f"{kind}:{mode}" for kind in (drivers.robot, drivers.camera) for mode in options.modes}
            cases = [case for case in cases if wanted & set(case)]
        if options.sessions:
            seeds = range(options.first, options.first + options.sessions)
            cases = [(f"{drivers.robot}:mix,{seed}", f"{drivers.camera}:mix,{seed}") for seed in seeds]
        cases = cases[options.part[0] :: options.part[1]]
        for robot, camera in cases:
            found = attempt(drivers, robot, camera, options)
            codes = [found["code"], *found["again"]]
            wrong = found["beyond"] > 0 or found["concurrent"] > 0 or 1 in codes or "timeout" in codes
            wrong = wrong or found["closed_early"] > 0
            wrong = wrong or bool(found["traceback"]) or max(found["offs"]) > 2
            # Without faults our own drivers have nothing that a session could not go on with.
            held = drivers.robot == "hostile" and found["began"] and codes[-1] != 0
            stuck += held
            bad, worst = bad + wrong, max(worst, *found["offs"])
            counts = f"moves {found['moves']} beyond {found['beyond']} at once {found['concurrent']}"
            counts += f" closed {found['closed']}"
            word = "WRONG" if wrong else "STUCK" if held else "ok"
            print(
                f"{word:<6}{robot:<20} {camera:<20} exit {found['code']} "
                f"then {found['again']} {counts} off {max(found['offs']):.2f} {found['seconds']:.0f} s "
                f"{','.join(found.get('failures', []))} | {found['said'][:150]}",
                flush=True,
            )
    print(
        f"{bad} of {len(cases)} wrong, {stuck} do not go on without faults, "
        f"answers at most {worst:.2f} of their stated radius off"
    )
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
