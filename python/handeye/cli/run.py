"""`handeye run`: drive the arm from view to view until the accuracy asked for is reached."""

import inspect
import sys
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.options import Common, Seed
from handeye.cli.output import check_new_folder
from handeye.cli.page import Live, Page
from handeye.cli.run_answer import judged_by, run_answer
from handeye.cli.run_options import Lens, Limits, Rig, Simulated, TimeoutOptions
from handeye.cli.run_rig import cell_of, check_rig, resume_rig, run_rig
from handeye.cli.work import WorkOptions, check_touch, height_of
from handeye.datasets import read_camera, read_target
from handeye.estimation import Estimate
from handeye.notations import SHOWN
from handeye.planning.collisions import Body
from handeye.planning.constraints import ViewLimits
from handeye.robots import open_arm
from handeye.robots.manual import describe
from handeye.robots.protocol import Goal
from handeye.session.closing import closing
from handeye.session.configuration import begin, go_on, prepare
from handeye.session.deciding import START_VIEWS
from handeye.session.drivers import REPLAY, Person
from handeye.session.entry import Entry
from handeye.session.journal import read_settings
from handeye.session.loop import End, Session
from handeye.session.observer import Observer
from handeye.session.prepared import Prepared
from handeye.session.settings import SIMULATED, Configuration
from handeye.session.starting import preview
from handeye.session.store import SessionStore
from handeye.types import Mounting
from handeye.types.calibration import ModelName
from handeye.types.units import MM_PER_M

if TYPE_CHECKING:
    from rich.console import Console

Corner = tuple[float, float, float]
DEFAULT_ARM = "epson_c4l"
# What may be asked of a session that goes on.
KEPT_WITH_RESUME = ("session", "resume", "confirm", "page", "common")


def run(
    *,
    session: Path | None = None,
    robot: str | None = None,
    driver: str = SIMULATED,
    images: str | None = None,
    target: Path | None = None,
    camera: Path | None = None,
    mounting: Mounting | None = None,
    accuracy_mm: float = 0.5,
    accuracy_deg: float = 0.05,
    touch_mm: float | None = None,
    height_mm: tuple[float, float] | None = None,
    max_views: int = 20,
    seed: Seed = 0,
    model: ModelName = ModelName.AUTO,
    policy: str = "next_best_view",
    refine: Annotated[bool, Parameter(negative="--no-refine")] = True,
    resume: bool = False,
    anyway: bool = False,
    dry_run: bool = False,
    confirm: Annotated[bool | None, Parameter(negative="--no-confirm", show_default=False)] = None,
    limits: Limits = Limits(),  # noqa: B008 - frozen, like those below
    work: WorkOptions = WorkOptions(),  # noqa: B008
    timeouts: TimeoutOptions = TimeoutOptions(),  # noqa: B008
    unknown: Lens = Lens(),  # noqa: B008
    several: Rig = Rig(),  # noqa: B008
    simulated: Simulated = Simulated(),  # noqa: B008
    page: Page = Page(),  # noqa: B008
    common: Common = Common(),  # noqa: B008
) -> Answer:
    """Drive the arm from view to view until the accuracy asked for is reached.

    Three small turns about where the arm stands, then always to the view that teaches most. Without options
    everything is simulated. Every attempt is written into the session before the arm moves again; Ctrl-C
    stops the arm, and --resume goes on where it was. A session is a recording: solve, plan and validate take
    it. At the end a report on one page is written into it, report.html.

    Parameters
    ----------
    session
        Folder to write; a new one, or with --resume the one to go on with.
    robot
        Description of the arm: a shipped arm (epson_c4l, ur5e, lbr_iiwa_14), a URDF or an MJCF file. Needed
        for a real arm; a simulated one is epson_c4l without it, and a replay does without.
    driver
        What moves it: simulated, manual (a person; manual:kuka for another notation), replay:FOLDER (nothing;
        the views of a recording are the candidates), or a driver of another package with its address.
    images
        Where pictures come from: folder:PATH, opencv:0, or another package's; simulated and replay need none.
    target
        Target in TOML or JSON; the simulated one is a chessboard.
    camera
        Calibrated camera in TOML, JSON or ROS's camera_info .yaml. Without one the views teach the lens too.
    mounting
        Where the camera sits; in the hand, if nothing is said.
    accuracy_mm
        Radius within which the camera's position shall lie with 95 % probability.
    accuracy_deg
        The same for its rotation.
    touch_mm
        Instead of both: stop when a touch lands within so much with 95 % probability, wherever in the box of
        work, and choose views for it.
    height_mm
        Height of the middle of the target in the frame that it is fixed to (base, or flange with the camera
        beside the robot), and how well it is known: for an arm that turns about one axis only, such as SCARA
        and gantry, which cannot tell it.
    max_views
        Stop at so many views in any case.
    seed
        Of every choice by chance, and of the simulated cell.
    model
        auto: the data say how noisy robot and camera are. paper: robot and camera are taken as exact.
    policy
        How the next view is chosen: next_best_view, gain_per_second (the gain over the time that motion and
        view take), random or max_distance.
    refine
        Climb from the best candidates to better ones near them; without it the best that was drawn is taken.
    resume
        Go on with a session; everything else is taken from it.
    anyway
        Go on where the accuracy is out of reach. Else a run ends where, from five views on, even 40 would not
        come near it, and says what they would come to.
    dry_run
        Show what would be done first; nothing moves and nothing is written.
    confirm
        Ask before every motion; the default on a real arm.
    """
    options = locals().copy()
    check_touch(touch_mm)
    if resume:
        if session is None:
            raise UsageError("--resume needs --session", hint="give the folder of the session to go on with")
        _check_resumed(options)
        return _resumed(session, confirm, page, as_json=common.json)
    replays = driver.partition(":")[0] == REPLAY
    if replays and (camera, target, mounting) != (None, None, None):
        raise UsageError(
            "a replay has --camera, --target and --mounting from its recording",
            hint="handeye import makes a recording with others",
        )
    if replays:
        driver = f"{REPLAY}:{Path(driver.partition(':')[2]).resolve()}"
    elif robot is None and driver == SIMULATED and not several.rig:
        robot = DEFAULT_ARM
    given = (camera, target, mounting, images) != (None, None, None, None)
    robot = None if robot is None else _described(robot)
    if images is None:
        # Each camera of a rig has its own.
        images = REPLAY if replays else SIMULATED if several.rig_file is None else "rig"
    described = several.described()
    configuration = Configuration(
        robot=robot,
        driver=driver,
        images=images,
        mounting=mounting or Mounting.EYE_IN_HAND,
        accuracy_mm=accuracy_mm,
        accuracy_deg=accuracy_deg,
        most_views=max_views,
        seed=seed,
        model=model,
        policy=policy,
        refine=refine,
        speed_rad_s=float(np.deg2rad(limits.speed_deg_s)),
        workspace_m=_box(limits.workspace_mm),
        floor_m=limits.floor_mm / MM_PER_M,
        collisions=limits.collisions,
        limits=ViewLimits(
            (limits.distance_mm[0] / MM_PER_M, limits.distance_mm[1] / MM_PER_M),
            float(np.deg2rad(limits.tilt_deg)),
            limits.margin_px,
        ),
        timeouts=timeouts.timeouts(driver, images),
        camera_known=not (unknown.uncalibrated and driver == SIMULATED),
        lens=unknown.lens,
        accuracy_px=unknown.accuracy_px,
        simulation=simulated.simulation(),
        touch_mm=touch_mm,
        work=work.work(),
        height=height_of(height_mm, model),
        rig=several.settings(described),
        anyway=anyway,
    )
    _check(configuration, given=given, dry_run=dry_run)
    if not dry_run:
        if session is None:
            hint = "name a folder to write, or look first with --dry-run"
            raise UsageError("--session is missing", hint=hint)
        check_new_folder(session)
    front = _Front(page if not dry_run else Page(), configuration, confirm, as_json=common.json)
    if session is not None and configuration.rig is not None:
        rig = cell_of(
            configuration,
            None if described is None else described.recording,
            person=front.person,
            confirm=front.confirm,
            observer=front.observer,
        )
        return run_rig(session, rig, front.live)
    prepared = prepare(
        configuration,
        camera=None if camera is None else read_camera(camera),
        target=None if target is None else read_target(target),
        person=front.person,
        confirm=front.confirm,
        observer=front.observer,
    )
    with closing(prepared.cell):
        if dry_run or session is None:
            return _plan(prepared)
        end = _driven(*begin(prepared, session), prepared, front)
    return run_answer(session, configuration, prepared, end)


class _Front:
    """Who looks on and whom to ask: a page in the browser, or the terminal."""

    def __init__(
        self, page: Page, configuration: Configuration, confirm: bool | None, *, as_json: bool
    ) -> None:
        self.live = Live(page, configuration) if page.ui else None
        if self.live is not None:
            self.person, self.confirm = self.live.person, self.live.confirm
            self.observer: Observer = self.live.observer
        else:
            self.person = _person()
            self.confirm = _confirm(confirm, configuration, self.person)
            self.observer = Observer() if as_json else _Progress()


def _driven(loop: Session, store: SessionStore, prepared: Prepared, front: _Front) -> End:
    """Run a session to its end, tell it what was true, and let others open it."""
    try:
        end = loop.run() if front.live is None else front.live.run(loop, store, prepared)
        if prepared.truth is not None:
            store.reveal(prepared.truth)
    finally:
        store.close()
    return end


def _resumed(session: Path, confirm: bool | None, page: Page, *, as_json: bool) -> Answer:
    configuration = Configuration.from_dict(read_settings(session).asked.get("configuration"))
    front = _Front(page, configuration, confirm, as_json=as_json)
    if configuration.rig is not None:
        return resume_rig(session, front.confirm, front.observer, front.person, front.live)
    loop, store, prepared = go_on(
        session, person=front.person, confirm=front.confirm, observer=front.observer
    )
    with closing(prepared.cell):
        if store.notice is not None:
            front.person.tell(f"warning: {store.notice}")
        end = _driven(loop, store, prepared, front)
    return run_answer(session, configuration, prepared, end)


def _check_resumed(options: Mapping[str, object]) -> None:
    """Refuse options that a session that goes on has from its beginning."""
    usual = inspect.signature(run).parameters
    for name, value in options.items():
        if name not in KEPT_WITH_RESUME and value != usual[name].default:
            raise UsageError(
                f"--resume has everything from the session, and {_named(name, value)} was given too",
                hint="leave it out, or begin a new session; the page (--ui) asks a session for more",
            )


def _named(name: str, value: object) -> str:
    """Return an option as it is written, or the first of a group that is stated."""
    if not is_dataclass(value):
        return "--" + name.replace("_", "-")
    usual = type(value)()
    return next(
        "--" + field.name.replace("_", "-")
        for field in fields(value)
        if getattr(value, field.name) != getattr(usual, field.name)
    )


def _check(configuration: Configuration, *, given: bool, dry_run: bool) -> None:
    """Refuse options that do not go together."""
    if configuration.rig is not None:
        check_rig(configuration, given=given, dry_run=dry_run)
    if (configuration.driver == SIMULATED) != (configuration.images == SIMULATED):
        raise UsageError("--driver and --images are either both simulated or both not")


def _described(robot: str) -> str:
    """Return the name of an arm, or the whole path of its file: a session may be resumed from elsewhere."""
    return str(Path(robot).resolve()) if Path(robot).suffix else robot


def _box(
    workspace_mm: tuple[float, float, float, float, float, float] | None,
) -> tuple[Corner, Corner] | None:
    if workspace_mm is None:
        return None
    x0, y0, z0, x1, y1, z1 = (value / MM_PER_M for value in workspace_mm)
    return (x0, y0, z0), (x1, y1, z1)


def _person() -> Person:
    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    def ask(question: str) -> str:
        print(question, end="", file=sys.stderr, flush=True)
        line = sys.stdin.readline()
        if not line:
            raise EOFError
        return line

    return Person(ask, tell)


def _confirm(wanted: bool | None, configuration: Configuration, person: Person) -> Any:  # noqa: ANN401
    """Return what asks before a motion; by default on real arms, but not where a person moves it anyway."""
    if wanted is None:
        wanted = not (configuration.is_simulated or configuration.by_hand or configuration.is_replay)
    if not wanted:
        return None

    sliding = () if configuration.robot is None else open_arm(configuration.robot).sliding

    def confirm(goal: Goal) -> bool:
        person.tell(describe(goal, SHOWN[:1], sliding))
        try:
            return person.ask("move there? [y/N] ").strip().lower() in {"y", "yes"}
        except EOFError:
            return False

    return confirm


class _Progress(Observer):
    """Says on stderr what each attempt brought."""

    def taken(self, entry: Entry, estimate: Estimate | None) -> None:
        """Say it."""
        known = ""
        if estimate is not None:
            now = estimate.within_95
            known = f"  (before: within {now.translation_mm:.2f} mm, {now.rotation_deg:.3f} deg)"
        what = "ok" if entry.brought is not None else f"{entry.failure}: {entry.detail[:100]}"
        seconds = sum(entry.timings_s.values())
        print(
            f"{entry.label:<11} {entry.phase:<6}{seconds:5.1f} s  {what}{known}", file=sys.stderr, flush=True
        )


def _plan(prepared: Prepared) -> Answer:
    space, start, wish = prepared.cell.workspace, prepared.start, prepared.configuration
    if space is None or start is None:
        raise UsageError("--dry-run shows motions, and here are none")
    goals = [
        Goal(f"view_{i:02d}.1", pose, tuple(joints.tolist()), prepared.configuration.speed_rad_s)
        for i, (pose, joints) in enumerate(
            preview(start, Body(prepared.arm, space, solids=prepared.cell.solids), START_VIEWS), start=1
        )
    ]
    data: dict[str, Any] = {
        "dry_run": True,
        "arm": prepared.arm.name,
        "workspace_mm": [(MM_PER_M * space.lower_m).tolist(), (MM_PER_M * space.upper_m).tolist()],
        "speed_deg_s": float(np.rad2deg(wish.speed_rad_s)),
        "collisions_judged": judged_by(prepared),
        "accuracy_mm": wish.accuracy_mm,
        "accuracy_deg": wish.accuracy_deg,
        "most_views": wish.most_views,
        "first_goals": [
            {
                "label": goal.label,
                "T_base_flange": goal.T_base_flange.to_list(),
                "joints_deg": np.rad2deg(goal.joints_rad or ()).tolist(),
            }
            for goal in goals
        ],
    }

    def show(console: "Console") -> None:
        low, high = (" ".join(f"{v:.0f}" for v in corner) for corner in data["workspace_mm"])
        console.print(
            f"{prepared.arm.name}: no motion leaves the box from ({low}) to ({high}) mm or is faster than "
            f"{data['speed_deg_s']:.0f} deg/s. {START_VIEWS} views around where the arm stands, turned at "
            "most as here, less where there is less room in the first picture; then the views that teach "
            f"most, until the camera is known to {wish.accuracy_mm} mm and {wish.accuracy_deg} deg with 95 % "
            f"probability, at most {wish.most_views} views.\n"
        )
        for goal in goals:
            # Nobody has told which posture it is: joints of another one would be a trap.
            known = goal if start.posture_known else replace(goal, joints_rad=None)
            console.print(describe(known, SHOWN, prepared.arm.sliding), soft_wrap=True)

    return Answer(data, show)
