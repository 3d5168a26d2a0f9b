"""Kill simulated sessions, go on with them, and compare the end with an undisturbed run.

.venv/bin/python tools/kill_sessions.py --kills 500
.venv/bin/python tools/kill_sessions.py --kills 200 --at-writes --kind manual

At random instants, or with `--at-writes` right before or after an fsync, a rename or an unlink, each in turn.
Kinds: points (projected), faults (with faults of robot and camera), pictures (rendered), manual (a person who
types poses and joints), rig (four cameras and two boards), rig-faults (the same with faults of robot and
cameras).
"""

import argparse
import os
import re
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from handeye.notations import notation_of, pose_text, read_numbers
from handeye.robots.manual import ManualRobot
from handeye.robots.protocol import Goal
from handeye.robots.simulated import SimulatedArm
from handeye.session.configuration import begin, prepare
from handeye.session.faults import FaultRates
from handeye.session.loop import Session
from handeye.session.settings import Configuration, Simulation
from handeye.session.store import is_session, open_session
from handeye.types import Pose
from sessions import RIG, Outcome, configured, run, run_rig

KINDS = ("points", "faults", "pictures", "manual", "rig", "rig-faults")
# Calls into the system at which a process dies, and how many of them one view takes at most.
WRITES = ("fsync", "replace", "rename", "unlink", "ftruncate")
MOST_WRITES = 24


class Typist:
    """A person who drives a simulated arm to the joints that are shown, and types what it says then."""

    def __init__(self, arm: SimulatedArm, forward: Callable[[Any], Any]) -> None:
        self._arm, self._forward = arm, forward

    def tell(self, text: str) -> None:
        """Drive where a text says."""
        label = re.match(r"Go to (\S+):", text)
        shown = re.search(r"joints (.*)  deg", text)
        if label is not None and shown is not None:
            joints = np.deg2rad(read_numbers(shown[1]))
            self._arm.move_to(Goal(label[1], Pose(self._forward(joints)), tuple(joints.tolist())))

    def ask(self, question: str) -> str:
        """Answer with the pose or the joints."""
        reading = self._arm.read_pose()
        if "joint positions" in question:
            return " ".join(f"{value:.6f}" for value in np.rad2deg(reading.joints_rad or ()))
        return pose_text(reading.T_base_flange, notation_of("ur"))


def run_by_hand(configuration: Configuration, folder: Path) -> None:
    """Run to the end with a typist, from the beginning or from where it broke off."""
    prepared = prepare(configuration)
    hidden, arm = prepared.hidden_arm, prepared.arm
    assert hidden is not None
    typist = Typist(hidden, arm.forward)
    robot = ManualRobot(typist.ask, typist.tell, arm=arm, joints_told=True)
    prepared = replace(prepared, cell=replace(prepared.cell, robot=robot, by_hand=True))
    if is_session(folder):
        store = open_session(folder)
        stood = [entry.standing_rad for entry in store.entries if entry.standing_rad is not None]
        if stood:
            hidden.place(stood[-1])
        session = Session(prepared.cell, store, prepared.chooser(), configuration.wish())
    else:
        session, store = begin(prepared, folder)
    try:
        session.run()
    finally:
        store.close()


def configuration_of(kind: str, seed: int) -> Configuration:
    """Return a run of a kind."""
    if kind == "faults":
        return configured(seed, faults=FaultRates(refused=0.1, not_found=0.1, camera_fails=0.05))
    if kind == "rig":
        return replace(RIG, seed=seed)
    if kind == "rig-faults":
        rates = FaultRates(refused=0.1, robot_dies=0.05, not_found=0.1, camera_fails=0.05)
        return replace(RIG, seed=seed, simulation=Simulation(faults=rates))
    if kind == "pictures":
        return configured(seed, points_only=None, most_views=5)
    return configured(seed)


def die_at(number: int, *, after: bool) -> None:
    """Let this process die right before or after the write of a number."""
    left = [number]

    def dying(call: Callable[..., Any]) -> Callable[..., Any]:
        def wrapped(*arguments: Any, **named: Any) -> Any:  # noqa: ANN401
            left[0] -= 1
            if left[0] < 0 and not after:
                os.kill(os.getpid(), signal.SIGKILL)
            answer = call(*arguments, **named)
            if left[0] < 0:
                os.kill(os.getpid(), signal.SIGKILL)
            return answer

        return wrapped

    for name in WRITES:
        setattr(os, name, dying(getattr(os, name)))


def killed_once(
    work: Callable[[], object], random: np.random.Generator, mean_s: float, at: int | None
) -> bool:
    """Do work in a process that is killed; tell whether it was, rather than come to its end."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            if at is not None:
                die_at(at // 2, after=at % 2 == 1)
            work()
            code = 0
        finally:
            os._exit(code)
    deadline = time.monotonic() + (random.exponential(mean_s) if at is None else 600.0)
    while time.monotonic() < deadline:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            code = os.waitstatus_to_exitcode(status)
            if code not in {0, -signal.SIGKILL}:
                raise AssertionError(f"a run failed with {code}")
            return code != 0
        time.sleep(0.001)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    return os.waitstatus_to_exitcode(status) != 0


def main() -> int:
    """Run until enough kills are done; return 1 if any session ended otherwise than undisturbed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--kills", type=int, default=500)
    parser.add_argument("--mean-s", type=float, default=0.5, help="mean life of a process")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kind", choices=KINDS, help="one kind; by default they take turns")
    parser.add_argument("--at-writes", action="store_true")
    options = parser.parse_args()
    kills = runs = different = 0
    began = time.monotonic()
    while kills < options.kills:
        seed = options.seed + runs
        kind = options.kind or KINDS[runs % len(KINDS)]
        configuration = configuration_of(kind, seed)
        runner = run_by_hand if kind == "manual" else run_rig if kind in {"rig", "rig-faults"} else run
        random = np.random.default_rng(seed)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            runner(configuration, folder / "undisturbed")
            at = 0
            while killed_once(
                lambda: runner(configuration, folder / "killed"),  # noqa: B023 - done before the next
                random,
                options.mean_s * (1 + at / 20),
                at % (2 * MOST_WRITES) if options.at_writes else None,
            ):
                kills += 1
                at += 1
            if Outcome.of(folder / "undisturbed") != Outcome.of(folder / "killed"):
                different += 1
                shutil.copytree(folder, Path("out") / f"killed_{kind}_{seed}", dirs_exist_ok=True)
        runs += 1
        seconds = time.monotonic() - began
        print(f"{runs} runs, {kills} kills, {different} ended otherwise, {seconds:.0f} s", flush=True)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
