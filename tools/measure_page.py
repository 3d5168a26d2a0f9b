"""Measure the page: how fast it answers with many candidates, and how much it slows a session.

    .venv/bin/python tools/measure_page.py

Prints, for 5,000 candidates and 50 views, the time from a key press to the scene drawn again, and from the
press of a view to its residuals on the page (median and largest of 20). Needs chromium.

Then pairs of simulated sessions with rendered pictures and no time spent on motions, one without a page and
one with such a crowded page that is looked at, either first in turns: how much longer the steps took by the
clock on the wall, and how much more processor time the loop's own thread and the whole program took (the
median of the pairs). Who looks on is `tools/watch_page.py` in a process of its own, which fetches what a
browser fetches and draws nothing: a browser on the same machine takes its time from everybody, page or not.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from browsers import browser  # noqa: E402
from handeye.planning import Pool  # noqa: E402
from handeye.planning.candidates import Candidate  # noqa: E402
from handeye.robots import open_arm  # noqa: E402
from handeye.robots.protocol import Reading  # noqa: E402
from handeye.session import End  # noqa: E402
from handeye.session.configuration import begin, prepare  # noqa: E402
from handeye.session.deciding import Considered, Step  # noqa: E402
from handeye.session.prepared import Prepared  # noqa: E402
from handeye.session.settings import Configuration, Simulation  # noqa: E402
from handeye.types import Pose, View  # noqa: E402
from handeye.ui import Dashboard, Hub, Server  # noqa: E402
from handeye.ui.documents import Shown  # noqa: E402
from handeye.ui.still import Still  # noqa: E402

CANDIDATES, VIEWS, TIMES = 5000, 50, 20
QUICK = Configuration(
    "ur5e", accuracy_mm=None, accuracy_deg=None, most_views=8, simulation=Simulation(points_only=0.1)
)
RENDERED = replace(QUICK, most_views=12, simulation=Simulation())


def crowded() -> Shown:
    """Return a cell with many candidates and views, after a short simulated session."""
    arm = open_arm("ur5e")
    with tempfile.TemporaryDirectory() as name:
        session, store = begin(prepare(QUICK), Path(name) / "s")
        while isinstance(step := session.next(), Step):
            last = step
            session.take(step)
        views = session.views
        store.close()
    assert last.estimate is not None
    random = np.random.default_rng(0)
    start = np.array(views[0].joints_rad)
    joints = start + 0.3 * random.standard_normal((CANDIDATES, len(arm)))
    poses = arm.forward(joints)
    pool = Pool(tuple(Candidate(f"candidate_{i:04d}", Pose(pose)) for i, pose in enumerate(poses)))
    considered = Considered(pool, random.uniform(0, 10, CANDIDATES))
    many = tuple(
        View(f"view_{i:02d}", v.T_base_flange, v.point_ids, v.pixels, None, None, v.joints_rad)
        for i in range(VIEWS)
        for v in [views[i % len(views)]]
    )
    standing = Reading(views[-1].T_base_flange, views[-1].joints_rad)
    cell = prepare(QUICK).cell
    return Shown(
        QUICK.mounting, cell.camera, cell.target, arm, many, last.estimate, standing, considered=considered
    )


def told(name: str, seconds: list[float]) -> None:
    """Print the median and the largest of times."""
    print(f"{name}: median {1e3 * statistics.median(seconds):.0f} ms, largest {1e3 * max(seconds):.0f} ms")


def interactions() -> None:
    """Measure what a person waits for."""
    shown = crowded()
    hub = Hub()
    still = Still(hub, shown, Path(), "crowded")
    server = Server(hub, pictures=still)
    with tempfile.TemporaryDirectory() as folder, browser(Path(folder)) as opened:
        page = opened(server.address).page
        page.wait_for_timeout(3000)
        page.focus("#scene")
        drawn: list[float] = page.evaluate(
            """async (times) => {
                const scene = document.querySelector('#scene'), found = [];
                for (let i = 0; i < times; i++) {
                    const began = performance.now();
                    scene.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft', bubbles: true }));
                    await new Promise(done => requestAnimationFrame(() => setTimeout(done, 0)));
                    found.push((performance.now() - began) / 1e3);
                }
                return found;
            }""",
            TIMES,
        )
        told(f"turning {CANDIDATES} candidates and {VIEWS} views", drawn)
        pressed: list[float] = page.evaluate(
            """async (times) => {
                const found = [], text = document.querySelector('#picture-text');
                const buttons = document.querySelectorAll('#views button.link');
                for (let i = 0; i < times; i++) {
                    const began = performance.now();
                    buttons[i].click();
                    while (!text.textContent.startsWith(buttons[i].textContent + ':'))
                        await new Promise(done => setTimeout(done, 1));
                    await new Promise(done => requestAnimationFrame(() => setTimeout(done, 0)));
                    found.push((performance.now() - began) / 1e3);
                }
                return found;
            }""",
            TIMES,
        )
        told("pressing a view until its residuals are drawn", pressed)
    server.close()


class Crowded(Dashboard):
    """Shows many candidates and views whatever the session has."""

    def __init__(self, hub: Hub, crowd: Shown) -> None:
        self._crowd = crowd
        super().__init__(hub)

    def _told(self, step: Step | End, shown: Shown, count: int) -> None:
        crowd = self._crowd
        super()._told(step, replace(shown, views=crowd.views, considered=crowd.considered), count)


class Spent(NamedTuple):
    """Seconds that a session took: on the wall, and of the processor by the loop's thread and by all."""

    wall: float
    loop: float
    program: float


def spent(prepared: Prepared, folder: Path, dashboard: Dashboard | None) -> Spent:
    """Run a session as `drive` does."""
    session, store = begin(prepared, folder / "s")
    if dashboard is not None:
        dashboard.prepare(prepared, store)
    began = (time.perf_counter(), time.thread_time(), time.process_time())
    step: Step | End | None = None
    while not isinstance(step, End):
        step = session.next()
        if dashboard is not None:
            dashboard.decided(step, session)
            dashboard.waits(waits=False)
            dashboard.hub.next_command(0)
        if isinstance(step, Step):
            session.take(step)
    ended = (time.perf_counter(), time.thread_time(), time.process_time())
    store.close()
    return Spent(*(after - before for before, after in zip(began, ended, strict=True)))


def alone() -> Spent:
    """Run a session that nobody looks at."""
    with tempfile.TemporaryDirectory() as folder:
        return spent(prepare(RENDERED), Path(folder), None)


def watched(crowd: Shown) -> Spent:
    """Run a session whose page is looked at."""
    hub = Hub()
    dashboard = Crowded(hub, crowd)
    server = Server(hub, pictures=dashboard)
    watcher = subprocess.Popen([sys.executable, str(ROOT / "tools" / "watch_page.py"), server.address])
    while json.loads(hub.document("people"))["data"]["watchers"] == 0:
        time.sleep(0.05)
    with tempfile.TemporaryDirectory() as folder:
        found = spent(prepare(RENDERED, observer=dashboard), Path(folder), dashboard)
    server.close()
    watcher.wait()
    return found


def loop(pairs: int) -> None:
    """Compare sessions with a page that is looked at, and without one, in pairs."""
    crowd = crowded()
    alone()  # the first has much to import
    more: list[list[float]] = []
    for pair in range(pairs):
        if pair % 2:
            with_page, without = watched(crowd), alone()
        else:
            without, with_page = alone(), watched(crowd)
        others = (with_page.program - with_page.loop) - (without.program - without.loop)
        ratios = [100 * (one / other - 1) for one, other in zip(with_page, without, strict=True)]
        more.append([*ratios, 100 * others / without.program])
        print(f"pair {pair + 1}: " + ", ".join(f"{value:.1f} %" for value in more[-1]), flush=True)
    wall, own, program, others = (statistics.median(column) for column in zip(*more, strict=True))
    print(f"{pairs} pairs, the session took {wall:.1f} % longer by the clock on the wall (median)")
    print(f"processor time: the loop's thread {own:.1f} % more, the whole program {program:.1f} % more")
    print(f"threads of the page alone: {others:.1f} % of the program's processor time without them")


def main() -> None:
    """Measure both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=["interactions", "loop"])
    parser.add_argument("--pairs", type=int, default=10)
    asked = parser.parse_args()
    if asked.only != "loop":
        interactions()
    if asked.only != "interactions":
        loop(asked.pairs)


if __name__ == "__main__":
    main()
