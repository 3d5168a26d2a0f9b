"""Run sessions on drivers with one fault each, and count what must never happen.

.venv/bin/python tools/try_hostile_drivers.py --drivers $HANDEYE_DATA/cases/hostile/evil_driver

`--drivers` is a folder with `evil.py`, which announces `evil:MODE` as robot and `evilcam:MODE` as camera, and
logs every motion: the joints sent, whether they are beyond a limit, and how many motions run at once. Counted
are goals beyond limits, motions at once, exit codes that mean a mistake of ours, and sessions that do not go
on with --resume.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROBOT = """
ok raise raise_once sysexit kbd hang hang_once slow refuse half elsewhere ignore mem longmsg binmsg degrees
degrees_nojoint offset offset_nojoints frozen none matrix nanjoints fewjoints manyjoints emptyjoints nppose
npjoints strjoints mm inverse nanpose readhang stopraise stophang
"""
CAMERA = """
none array raise hang hang_once stale stalenoise colour size float readonly strided fortran flip rot black
noise tsnan tsstr points_nan points_dup points_out points_many points_list
"""
# Few views, much asked for, little patience: the faults come at the fourth motion or picture.
HANDEYE = (sys.executable, "-c", "from handeye.cli import main; main()")
ASKED = ("--accuracy-mm", "0.02", "--accuracy-deg", "0.002", "--max-views", "8", "--no-confirm")
TIMES = ("--move-timeout-s", "1.5", "--read-timeout-s", "1", "--camera-timeout-s", "1")
SPACE = ("--workspace-mm", "-900", "-900", "20", "900", "900", "1400")


def run(arguments: list[str], environment: dict[str, str], seconds: float) -> dict[str, Any]:
    """Run a command; return its exit code and what it said."""
    began = time.monotonic()
    try:
        done = subprocess.run(
            arguments,
            env=environment,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return {"code": "timeout", "said": "", "seconds": seconds}
    said = done.stderr.strip().splitlines()
    return {
        "code": done.returncode,
        "said": next((line for line in reversed(said) if line.startswith("error")), said[-1] if said else ""),
        "seconds": time.monotonic() - began,
        "traceback": "Traceback" in done.stderr or "PanicException" in done.stderr,
        "failures": sorted(set(re.findall(r"s  ([a-z_]+): ", done.stderr))),
    }


def attempt(drivers: Path, robot: str, camera: str, points: bool, seconds: float) -> dict[str, Any]:
    """Run a session on one robot and one camera, then go on with it twice."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log = folder / "evil.log"
        environment = dict(os.environ) | {
            "PYTHONPATH": os.pathsep.join([str(drivers), os.environ.get("PYTHONPATH", "")]),
            "EVIL_LOG": str(log),
            "EVIL_SLOW": "2.5",
        }
        if points:
            environment["EVIL_POINTS"] = "1"
        command = [*HANDEYE, "run", "--session", str(folder / "session")]
        first = [
            *("--robot", "epson_c4l", "--driver", robot, "--images", camera),
            *("--camera", str(drivers / "simcam.json"), "--target", str(drivers / "simtarget.json")),
            *SPACE,
            *ASKED,
            *TIMES,
        ]
        outcome = run([*command, *first], environment, seconds)
        began = (folder / "session").exists()
        again = []
        if began:
            calm = environment | {"EVIL_CALM": "1"}
            again = [run([*command, "--resume", "--no-confirm"], calm, seconds) for _ in range(1)]
        events = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
        moves = [event for event in events if event.get("event") == "move"]
        return {
            "robot": robot,
            "camera": camera,
            "points": points,
            **outcome,
            "began": began,
            "again": [one["code"] for one in again],
            "moves": len(moves),
            "beyond": sum(bool(move["beyond"]) for move in moves),
            "concurrent": sum(move["concurrent"] > 1 for move in moves),
        }


def main() -> int:
    """Run every mode; return 1 if anything happened that must not."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--drivers", type=Path, required=True)
    parser.add_argument("--modes", nargs="*", help="only these, of robot or camera")
    parser.add_argument("--rendered", action="store_true", help="pictures instead of points")
    parser.add_argument("--seconds", type=float, default=120.0, help="longest run")
    options = parser.parse_args()
    cases = [(f"evil:{mode}", "evilcam:ok,99") for mode in ROBOT.split()]
    cases += [("evil:ok,99", f"evilcam:{mode}") for mode in CAMERA.split()]
    bad = 0
    for robot, camera in cases:
        mode = robot.partition(":")[2] if camera.endswith("ok,99") else camera.partition(":")[2]
        if options.modes and mode not in options.modes:
            continue
        found = attempt(options.drivers.resolve(), robot, camera, not options.rendered, options.seconds)
        codes = [found["code"], *found["again"]]
        wrong = found["beyond"] > 0 or found["concurrent"] > 0 or 1 in codes or "timeout" in codes
        wrong = wrong or bool(found.get("traceback"))
        bad += wrong
        counts = f"moves {found['moves']} beyond {found['beyond']} at once {found['concurrent']}"
        print(
            f"{'WRONG' if wrong else 'ok':<6}{robot:<20} {camera:<20} exit {found['code']} "
            f"then {found['again']} {counts} {found['seconds']:.0f} s "
            f"{','.join(found.get('failures', []))} | {found['said'][:150]}",
            flush=True,
        )
    print(f"{bad} of {len(cases)} wrong")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
