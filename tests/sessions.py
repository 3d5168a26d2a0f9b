"""Running simulated sessions, also in processes that are killed."""

import os
import signal
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from handeye.robots.protocol import Goal, Reading, Robot
from handeye.robots.simulated import ArmErrors
from handeye.session.attempt import Cell, Missed, Seen, arrive, look
from handeye.session.configuration import begin, go_on, prepare
from handeye.session.loop import End
from handeye.session.rig import RigEnd
from handeye.session.rig_prepared import begin_rig, go_on_rig, is_rig_session
from handeye.session.rig_store import open_rig_session
from handeye.session.settings import Configuration, RigSettings, Simulation
from handeye.session.store import is_session, open_session
from handeye.studies.rig_cell import rig_cell
from handeye.types import Recording, RigRecording, Target

QUICK = Configuration("epson_c4l", simulation=Simulation(points_only=0.1))


def configured(seed: int = 0, errors: ArmErrors | None = None, **changes: Any) -> Configuration:
    """Return a quick run: points instead of pictures."""
    changed = {name: value for name, value in changes.items() if hasattr(QUICK, name)}
    inner = {name: value for name, value in changes.items() if name not in changed}
    simulation = replace(QUICK.simulation, **inner)
    if errors is not None:
        simulation = replace(simulation, errors=errors)
    return replace(QUICK, seed=seed, simulation=simulation, **changed)


def attempt(cell: Cell, goal: Goal, digests: frozenset[str] = frozenset()) -> Seen | Missed:
    """Go to a goal and look at the one target through the one camera."""
    arrived = arrive(cell, goal, None, {})
    if isinstance(arrived, Missed):
        return arrived
    return look(cell, cell.eyes[0], goal.label, digests, {}, None)


def run(configuration: Configuration, folder: Path, target: Target | None = None) -> End:
    """Run to the end, from the beginning or from where it broke off."""
    if is_session(folder):
        session, store, _ = go_on(folder)
    else:
        session, store = begin(prepare(configuration, target=target), folder)
    try:
        return session.run()
    finally:
        store.close()


@dataclass(frozen=True)
class Outcome:
    """Everything that must not depend on breaks."""

    journal: list[dict[str, Any]]
    recording: Recording | RigRecording
    images: dict[str, bytes]

    @classmethod
    def of(cls, folder: Path) -> "Outcome":
        store = open_rig_session(folder) if is_rig_session(folder) else open_session(folder)
        try:
            journal = [entry.to_dict() for entry in store.entries]
            recording = store.recording
        finally:
            store.close()
        for entry in journal:
            del entry["timings_s"]
        images = {path.name: path.read_bytes() for path in sorted((folder / "images").glob("*.png"))}
        return cls(journal, recording, images)


RIG = Configuration(
    "ur5e", accuracy_mm=None, accuracy_deg=None, most_views=7, seed=3, rig=RigSettings(candidates=60)
)


def run_rig(configuration: Configuration, folder: Path) -> RigEnd:
    """Run a simulated rig to the end, from the beginning or from where it broke off."""
    if is_session(folder):
        session, store, _ = go_on_rig(folder, lambda asked, *_: rig_cell(asked))
    else:
        session, store = begin_rig(rig_cell(configuration), folder)
    try:
        return session.run()
    finally:
        store.close()


def run_killed(
    configuration: Configuration,
    folder: Path,
    random: np.random.Generator,
    mean_s: float,
    runner: Callable[[Configuration, Path], object] = run,
) -> int:
    """Run to the end in processes that are killed after a random time each; return the number of kills."""
    kills = 0
    while True:
        child = os.fork()
        if child == 0:
            code = 1
            try:
                runner(configuration, folder)
                code = 0
            finally:
                os._exit(code)
        # Longer lives after many kills: a slow machine gets to the end too.
        deadline = time.monotonic() + random.exponential(mean_s) * (1 + kills / 20)
        while time.monotonic() < deadline:
            pid, status = os.waitpid(child, os.WNOHANG)
            if pid:
                if os.waitstatus_to_exitcode(status) != 0:
                    raise AssertionError(f"a run failed with {os.waitstatus_to_exitcode(status)}")
                return kills
            time.sleep(0.001)
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        if os.WIFEXITED(status) and os.WEXITSTATUS(status) == 0:
            return kills
        kills += 1


def number(label: str) -> int:
    return int(label.split("_")[1].partition(".")[0])


class Lying:
    """A robot that goes only a part of the way at some views, and says that it went."""

    def __init__(self, robot: Robot, at: Collection[int], share: float = 0.05) -> None:
        self._robot, self._at, self._share = robot, at, share
        self._claimed: Reading | None = None

    def move_to(self, goal: Goal) -> None:
        self._claimed = None
        if number(goal.label) not in self._at:
            self._robot.move_to(goal)
            return
        here = np.array(self._robot.read_pose().joints_rad)
        there = here + self._share * (np.array(goal.joints_rad) - here)
        self._robot.move_to(replace(goal, joints_rad=tuple(there.tolist())))
        self._claimed = Reading(goal.T_base_flange, goal.joints_rad)

    def read_pose(self) -> Reading:
        return self._claimed or self._robot.read_pose()

    def stop(self) -> None:
        self._robot.stop()
