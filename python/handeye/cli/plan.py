"""`handeye plan`: which view to take next, from those recorded or from poses in a file."""

from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter

from handeye import _core
from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_output, write_json
from handeye.cli.page import Page, serve, show_views
from handeye.cli.plan_answer import Planned, plan_data, show_plan
from handeye.cli.plan_rig import plan_rig
from handeye.cli.plan_together import check_together, choose_together
from handeye.cli.source import Source, mindful_of
from handeye.cli.work import WorkOptions, check_touch, height_of
from handeye.codes import Code
from handeye.datasets import read_poses
from handeye.errors import InputError
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.estimation.estimate import answering
from handeye.estimation.initialize import check_views
from handeye.estimation.work import Work, touch_where_possible
from handeye.importing import Opened, is_rig
from handeye.planning import Candidate, Planner, PlannerOptions, Pool, rank
from handeye.planning.prediction import Sight
from handeye.planning.touch import touch_criterion
from handeye.robots import ArmKinematics
from handeye.session.deciding import Considered
from handeye.types.calibration import ModelName
from handeye.types.units import MM_PER_M

if TYPE_CHECKING:
    pass

# Views that count as taken where nothing is said, and candidates that the text shows.
FIRST = 3
SHOWN = 10


class Criterion(StrEnum):
    """Names of the core's criteria, which has the formulas."""

    ENTROPY = "entropy"
    ENTROPY_HANDEYE = "entropy_handeye"
    TRACE = "trace"
    EIGENVALUE_SUM = "eigenvalue_sum"
    MIN_EIGENVALUE = "min_eigenvalue"
    TOOL_POINT = "tool_point"
    TOUCH = "touch"


def plan(
    folder: Path,
    /,
    *,
    used: Annotated[tuple[str, ...] | None, Parameter(consume_multiple=True)] = None,
    first: int | None = None,
    candidates: Path | None = None,
    criterion: Criterion | None = None,
    tool_point_mm: tuple[float, float, float] | None = None,
    touch_mm: float | None = None,
    height_mm: tuple[float, float] | None = None,
    model: ModelName = ModelName.AUTO,
    top: int | None = None,
    together: int | None = None,
    speed_deg_s: float = 30.0,
    margin_px: float = 0.0,
    fewest: int | None = None,
    output: Path | None = None,
    source: Source = Source(),  # noqa: B008 - frozen
    arm: ArmSource = ArmSource(),  # noqa: B008 - frozen
    work: WorkOptions = WorkOptions(),  # noqa: B008 - frozen
    page: Page = Page(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Rank the views to take next, each with the accuracy predicted after it.

    Some views of the folder count as taken; candidates are its other views, or the robot poses of a CSV file.
    A candidate from a file must show the whole target by the current estimate; those that do not are listed
    with the reason. No robot is moved.

    Parameters
    ----------
    folder
        Folder with the views.
    used
        Names of the views that count as taken; all others are candidates.
    first
        The first so many views count as taken. Without this and --used: the first three, or with --candidates
        all.
    candidates
        CSV of robot poses T_base_flange: header x,y,z,qx,qy,qz,qw (metres; name too), or 16 numbers a line.
    criterion
        What a view is worth. entropy: all that is learnt (the paper's). entropy_handeye: of the hand-eye
        alone. trace, eigenvalue_sum, min_eigenvalue: a millimetre weighs like a milliradian. tool_point: the
        deviation of one point. touch: how far off the tool lands where it works. Without it touch if
        --touch-mm is given, entropy otherwise.
    tool_point_mm
        That point, in the camera frame: x y z.
    touch_mm
        Say whether a touch lands within so much with 95 % probability already, wherever in the box of work.
    height_mm
        Height of the middle of the target in the frame that it is fixed to (base, or flange with the camera
        beside the robot), and how well it is known: for an arm that turns about one axis only, such as SCARA
        and gantry, which cannot tell it.
    model
        auto: the data say how noisy robot and camera are. paper: robot and camera are taken as exact.
    top
        Rank only so many candidates; without it the text shows ten.
    together
        Also choose so many views at once, and the order in which the arm travels least from where the last
        view was taken.
    speed_deg_s
        No joint moves faster; for that order.
    margin_px
        Distance from the border of the image that a candidate from a file must keep.
    fewest
        Points of the target that a candidate from a file must show, if not all.
    output
        Also write the JSON object to this file.
    """
    check_output(output)
    _check(used, first, top)
    if not 0 < speed_deg_s < float("inf"):
        raise UsageError(f"--speed-deg-s {speed_deg_s}, expected above zero")
    check_touch(touch_mm)
    if criterion is None:
        criterion = Criterion.ENTROPY if touch_mm is None else Criterion.TOUCH
    check_together(together, criterion)
    _check_point(criterion, tool_point_mm)
    table = None if candidates is None else read_poses(candidates, source.stated())
    if source.only is None and is_rig(folder):
        _check_rig(criterion, alone=together is not None or page.ui or model is ModelName.PAPER)
        rig = source.open_rig(folder)
        views = [station.views[0].view for station in rig.recording.stations]
        return plan_rig(
            rig,
            table,
            output,
            used=used,
            first=first,
            top=top,
            sight=Sight(margin_px=margin_px, fewest=fewest),
            kinematics=arm.kinematics(views, model),
            work=work.work() if criterion is Criterion.TOUCH else None,
            touch_mm=touch_mm,
        )
    opened = (source if table is None else source.of_a_recording(folder)).open(folder, arm.described())
    measurements = Measurements.of_recording(opened.recording)
    check_views(measurements)
    taken = _taken(measurements, used, first, with_file=table is not None)
    if table is None:
        left = [view for view in measurements.views if view.name not in taken]
        pool, sight = Pool.of_views(left), Sight(known=True)
    else:
        named = zip(table.names, table.poses, strict=True)
        pool = Pool(tuple(Candidate(name, pose) for name, pose in named))
        sight = Sight(margin_px=margin_px, fewest=fewest)
    names = [view.name for view in measurements.views]
    warnings = (*opened.warnings, *(() if table is None else table.warnings))
    with mindful_of(warnings):
        start = measurements.select([names.index(name) for name in taken])
        kinematics = arm.kinematics(opened.recording.views, model)
        estimate = make_estimator(model, kinematics, height=height_of(height_mm, model))(start)
        here = work.work()
        known = touch_where_possible(estimate, start, here)
        worth = _criterion(criterion, tool_point_mm, estimate, start, here)
        options = PlannerOptions(criterion=worth, sight=sight)
        planner = Planner(start, pool, answering(estimate), options)
        ranking = rank(planner.estimate, planner.pool, worth, sight, gains=planner.gains(), top=top)
        batch = None
        if together is not None:
            batch = choose_together(
                together,
                planner.estimate,
                planner.pool,
                sight,
                start.views[-1],
                criterion=criterion,
                tool_point_m=None if tool_point_mm is None else [v / MM_PER_M for v in tool_point_mm],
                kinematics=kinematics,
                speed_rad_s=float(np.deg2rad(speed_deg_s)),
            )
    # The planner leaves out what is taken; a person may wonder where it is.
    again = {name: "a view of this name is taken already" for name in taken if name in _names(pool)}
    ranking = replace(ranking, infeasible=ranking.infeasible | again)
    found = Planned(
        opened.recording.name,
        criterion.value if estimate.determined else worth.name,
        taken,
        tuple(str(warning) for warning in warnings),
        planner.estimate,
        known,
        touch_mm,
        ranking,
        batch,
    )
    data = plan_data(found)
    if output is not None:
        write_json(output, data)
    after = None if not page.ui else partial(_page, page, opened, start, found, pool, kinematics, arm.robot)
    return Answer(data, lambda console: show_plan(console, found, top or SHOWN), after)


def _page(
    page: Page,
    opened: Opened,
    taken: Measurements,
    found: Planned,
    pool: Pool,
    kinematics: ArmKinematics | None,
    description: str | None,
) -> None:
    ranking, estimate = found.ranking, found.estimate
    out = [c for c in pool.candidates if c.name in ranking.infeasible and c.name not in found.used]
    considered = Considered(
        Pool(tuple(prospect.candidate for prospect in ranking.prospects)),
        np.array([prospect.gain for prospect in ranking.prospects]),
        np.array([candidate.T_base_flange.matrix for candidate in out]).reshape(-1, 4, 4),
        tuple(ranking.infeasible[candidate.name] for candidate in out),
    )
    best = ranking.prospects[0].candidate.name if ranking.prospects else None
    shown = show_views(
        page,
        opened,
        taken,
        estimate,
        arm=None if kinematics is None else kinematics.arm,
        description=description,
        considered=considered,
        chosen=best,
    )
    serve(shown)


def _names(pool: Pool) -> set[str]:
    return {candidate.name for candidate in pool.candidates}


def _criterion(
    name: Criterion,
    tool_point_mm: tuple[float, float, float] | None,
    estimate: Estimate,
    measurements: Measurements,
    work: Work,
) -> _core.Criterion:
    if name is Criterion.TOUCH:
        # Views that leave something open are to be cured first.
        if not estimate.determined:
            return _core.Criterion(Criterion.ENTROPY.value)
        return touch_criterion(estimate, measurements, work)
    if tool_point_mm is None:
        return _core.Criterion(name.value)
    return _core.Criterion(name.value, tool_points=np.array([tool_point_mm]) / MM_PER_M)


def _check_rig(criterion: Criterion, *, alone: bool) -> None:
    if alone:
        raise UsageError("--together, --ui and --model paper take one camera")
    if criterion not in {Criterion.ENTROPY, Criterion.TOUCH}:
        raise UsageError(
            f"--criterion {criterion.value} takes one camera",
            hint="several are asked for their poses, or with --touch-mm for what they are used for",
        )


def _check_point(criterion: Criterion, tool_point_mm: tuple[float, float, float] | None) -> None:
    if (criterion is Criterion.TOOL_POINT) != (tool_point_mm is not None):
        raise UsageError("--criterion tool_point and --tool-point-mm go together")


def _check(used: tuple[str, ...] | None, first: int | None, top: int | None) -> None:
    if used is not None and first is not None:
        raise UsageError("--used and --first exclude each other")
    if top is not None and top < 1:
        raise UsageError(f"--top {top}, expected at least 1")


def _taken(
    measurements: Measurements, used: tuple[str, ...] | None, first: int | None, *, with_file: bool
) -> tuple[str, ...]:
    """Return the names of the views that count as taken.

    Raises
    ------
    InputError
        A name that the folder does not have or whose view cannot be used, or nothing is left to rank.
    """
    names = [view.name for view in measurements.views]
    if used is None:
        count = len(names) if with_file else FIRST
        taken = tuple(names[: count if first is None else max(first, 0)])
    else:
        taken = tuple(dict.fromkeys(used))
    for name in taken:
        if name not in names:
            why = measurements.rejected.get(name)
            raise InputError(
                f"view {name!r}: {'not in the folder' if why is None else why}",
                code=Code.UNKNOWN_VIEW if why is None else Code.UNUSABLE_VIEW,
                hint=f"the views are {', '.join(names[:20])}{' ...' if len(names) > 20 else ''}",
            )
    if not with_file and len(taken) == len(names):
        raise InputError(
            f"all {len(names)} usable views count as taken, nothing is left to rank",
            code=Code.NO_CANDIDATES,
            hint="let fewer count as taken with --first or --used, or give poses with --candidates",
        )
    return taken
