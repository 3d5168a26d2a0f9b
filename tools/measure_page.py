"""Measure the page: how fast it answers with many candidates, and how much it slows a session.

    .venv/bin/python tools/measure_page.py

Prints, for 5,000 candidates and 50 views, the time from a key press to the scene drawn again, and from the
press of a view to its residuals on the page (median and largest of 20). Then the processor time of the same
simulated session, with pictures, without a page and with one that is watched. Needs chromium.
"""

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


def session_seconds(*, watched: bool) -> float:
    """Return the processor time of this process that a session takes, with the server if it is watched."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if not watched:
            return spent(Observer(), folder)
        hub = Hub()
        dashboard = Dashboard(hub)
        server = Server(hub, pictures=dashboard)
        with browser(folder) as opened:
            opened(server.address)
            seconds = spent(dashboard, folder)
        server.close()
        return seconds


def spent(observer: Observer, folder: Path) -> float:
    """Run a session as `drive` does; return the processor time."""
    prepared = prepare(replace(QUICK, simulation=Simulation()), observer=observer)
    session, store = begin(prepared, folder / "s")
    if isinstance(observer, Dashboard):
        observer.prepare(prepared, store)
    began = time.process_time()
    step: Step | End | None = None
    while not isinstance(step, End):
        step = session.next()
        if isinstance(observer, Dashboard):
            observer.decided(step, session)
        if isinstance(step, Step):
            session.take(step)
    seconds = time.process_time() - began
    store.close()
    return seconds


def main() -> None:
    """Measure both."""
    interactions()
    alone, watched = (min(session_seconds(watched=w) for _ in range(2)) for w in (False, True))
    views = QUICK.most_views
    print(f"a session of {views} views, processor time: {alone:.2f} s alone, {watched:.2f} s watched")


if __name__ == "__main__":
    main()
