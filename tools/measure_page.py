"""Measure the page: how fast it answers with many candidates, and how much it slows a session.

    .venv/bin/python tools/measure_page.py

Prints, for 5,000 candidates and 50 views, the time from a key press to the scene drawn again, and from the
press of a view to its residuals on the page (median and largest of 20). Then how long the steps of the loop
take in a simulated session with rendered pictures, without a page and with such a crowded one that is open:
in turns, by the clock on the wall, with no time spent on motions. Needs chromium.
"""

import argparse
import statistics
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from browsers import browser  # noqa: E402
from handeye.planning import Pool  # noqa: E402
from handeye.planning.candidates import Candidate  # noqa: E402
from handeye.robots import open_arm  # noqa: E402
from handeye.robots.protocol import Reading  # noqa: E402
from handeye.session import End, Observer  # noqa: E402
from handeye.session.configuration import begin, prepare  # noqa: E402
from handeye.session.deciding import Considered, Step  # noqa: E402
from handeye.session.settings import Configuration, Simulation  # noqa: E402
from handeye.types import Pose, View  # noqa: E402
from handeye.ui import Dashboard, Hub, Server  # noqa: E402
from handeye.ui.documents import Shown  # noqa: E402
from handeye.ui.still import Still  # noqa: E402

CANDIDATES, VIEWS, TIMES = 5000, 50, 20
STEPS, TURNS = 12, 5
QUICK = Configuration(
    "ur5e", accuracy_mm=None, accuracy_deg=None, most_views=8, simulation=Simulation(points_only=0.1)
)


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


def session_seconds(folder: Path, dashboard: Dashboard | None) -> tuple[list[float], float]:
    """Run a session as `drive` does.

    Return how long each step of the loop took by the clock on the wall, and the processor time of all.
    """
    observer = Observer() if dashboard is None else dashboard
    asked = replace(QUICK, most_views=STEPS, simulation=Simulation())
    prepared = prepare(asked, observer=observer)
    session, store = begin(prepared, folder / "s")
    if dashboard is not None:
        dashboard.prepare(prepared, store)
    seconds: list[float] = []
    spent = time.process_time()
    step: Step | End | None = None
    while not isinstance(step, End):
        began = time.perf_counter()
        step = session.next()
        if dashboard is not None:
            dashboard.decided(step, session)
            dashboard.waits(waits=False)
        if isinstance(step, Step):
            session.take(step)
        seconds.append(time.perf_counter() - began)
    spent = time.process_time() - spent
    store.close()
    return seconds, spent


def loop() -> None:
    """Compare the steps of the loop with a page that is open, and without one, in turns."""
    hub = Hub()
    dashboard = Crowded(hub, crowded())
    server = Server(hub, pictures=dashboard)
    alone, watched = list[float](), list[float]()
    processor = {False: 0.0, True: 0.0}
    with tempfile.TemporaryDirectory() as name, browser(Path(name)) as opened:
        for turn in range(TURNS):
            for times, shown in ((alone, None), (watched, dashboard)):
                window = None if shown is None else opened(server.address)
                with tempfile.TemporaryDirectory() as folder:
                    if window is not None:
                        window.page.wait_for_timeout(1000)
                    found, spent = session_seconds(Path(folder), shown)
                    if turn:  # the first has much to import
                        times.extend(found)
                        processor[window is not None] += spent
                if window is not None:
                    window.page.close()
    server.close()
    told("a step of the loop alone", alone)
    told(f"with a page of {CANDIDATES} candidates and {VIEWS} views", watched)
    more = [sum(watched[i :: STEPS + 1]) / sum(alone[i :: STEPS + 1]) for i in range(STEPS + 1)]
    median = 100 * (statistics.median(more) - 1)
    more_spent = 100 * (processor[True] / processor[False] - 1)
    print(f"processor time of the program, server and all: {more_spent:.1f} % more")
    print(f"slower by {100 * (sum(watched) / sum(alone) - 1):.1f} %, the median step by {median:.1f} %")


def main() -> None:
    """Measure both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=["interactions", "loop"])
    only = parser.parse_args().only
    if only != "loop":
        interactions()
    if only != "interactions":
        loop()


if __name__ == "__main__":
    main()
