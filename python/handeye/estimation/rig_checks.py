"""What is asked of a rig before it is estimated: whether all is tied to the arm, and mistakes in views."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from handeye.codes import Code
from handeye.errors import HandeyeError, InputError, SolveError
from handeye.estimation.cell_fit import CellFit
from handeye.estimation.faults import Examination, examine
from handeye.estimation.faults.explanation import (
    BEARABLE_ALONE,
    PINHOLE_PARAMETERS,
    camera_is_bearable,
    scale_is_bearable,
)
from handeye.estimation.measurements import Measurements
from handeye.estimation.rig_measurements import Pair, RigMeasurements
from handeye.types.rig import Body

FEWEST_STATIONS = 3
ELSEWHERE = "the arm stood elsewhere, as other cameras saw"


def check_tied(measurements: RigMeasurements) -> None:
    """Raise where a camera or target is not tied to the arm by what was seen.

    Raises
    ------
    InputError
        The message names it, and what would tie it.
    """
    if len(measurements.stations) < FEWEST_STATIONS:
        rejected = "".join(
            f"; {camera}, {name}: {why}"
            for (camera, _), measured in measurements.pairs.items()
            for name, why in measured.rejected.items()
        )
        raise InputError(
            f"{len(measurements.stations)} usable stations, at least {FEWEST_STATIONS} are needed{rejected}",
            code=Code.TOO_FEW_VIEWS,
            hint="take more stations, with the flange turned about at least two axes between them",
        )
    known: set[tuple[str, str]] = set()
    for (camera, target), measured in measurements.pairs.items():
        if measurements.moves(camera, target) and len(measured) >= FEWEST_STATIONS:
            known |= {("camera", camera), ("target", target)}
    for _ in measurements.pairs:
        for (camera, target), measured in measurements.pairs.items():
            ends = {("camera", camera), ("target", target)}
            if len(measured) and ends & known:
                known |= ends
    for camera in measurements.cameras:
        if ("camera", camera) not in known:
            other = Body.BASE if measurements.cameras[camera].body is Body.FLANGE else Body.FLANGE
            raise InputError(
                f"camera {camera}: nothing ties it to the arm or to another camera",
                code=Code.NOT_TIED,
                hint=f"let it see a target on the {other.value} at {FEWEST_STATIONS} stations or more, or "
                "one that another camera sees too",
            )
    for target in measurements.targets:
        if ("target", target) not in known:
            raise InputError(
                f"target {target}: no camera saw it",
                code=Code.NOT_TIED,
                hint="leave it out, or let a camera see it",
            )


def check_constants(fit: CellFit) -> None:
    """Raise where a camera or board would have to be as none that is stated can be.

    Raises
    ------
    SolveError
        The message names it.
    """
    advice = "check the motions, and the files of camera and target"
    for name in fit.cameras:
        prior = fit.priors[name]
        shift = fit.theta[fit.rows_of_camera(name)] - prior.mean
        if not camera_is_bearable(shift, prior, BEARABLE_ALONE):
            raise SolveError(
                f"the views contradict one another: focal length or centre of camera {name} would be off by "
                f"{np.abs(shift[np.array(prior.free) < PINHOLE_PARAMETERS]).max():.0f} px",
                hint=advice,
            )
    for name in fit.measurements.targets:
        scale = float(fit.theta[fit.row_of_board(name)])
        if not scale_is_bearable(scale, BEARABLE_ALONE):
            size = "larger" if scale > 0 else "smaller"
            raise SolveError(
                f"the views contradict one another: target {name} would be {100 * abs(scale):.0f} % {size} "
                "than stated",
                hint=advice,
            )


def examine_rig(
    measurements: RigMeasurements, *, by_joints: bool = False, fewest: int = FEWEST_STATIONS
) -> dict[Pair, Examination]:
    """Look for mistakes in what each camera saw of each target that the arm moves against it.

    Stations at which the arm stood elsewhere by what several pairs say are left out of all of them: few views
    of a pair cannot tell which of them is wrong.

    Parameters
    ----------
    measurements
        Of all cameras and targets.
    by_joints
        As for `examine`.
    fewest
        Pairs of fewer views are not examined.

    Raises
    ------
    InputError
        All views of a pair share a mistake; the message names the camera.
    """
    found: dict[Pair, Examination] = {}
    failed: dict[Pair, HandeyeError] = {}
    for pair, measured in measurements.pairs.items():
        if not measurements.moves(*pair) or len(measured) < fewest:
            found[pair] = Examination(measured)
            continue
        try:
            found[pair] = examine(measured, by_joints=by_joints)
        except HandeyeError as error:
            failed[pair] = error
    left_out = astray((measurements.pairs[pair], one.measurements) for pair, one in found.items())
    for pair, one in found.items():
        gone = left_out & {view.name for view in one.measurements.views}
        if gone and measurements.moves(*pair):
            found[pair] = replace(one, measurements=one.measurements.without(gone, ELSEWHERE))
    for pair, error in failed.items():
        found[pair] = _without(left_out, measurements, pair, error, by_joints=by_joints)
    return {pair: found[pair] for pair in measurements.pairs}


def astray(examined: Iterable[tuple[Measurements, Measurements]]) -> frozenset[str]:
    """Return stations whose views were left out of several pairs: there the arm stood elsewhere.

    Parameters
    ----------
    examined
        Of every pair what was measured, and what is left of it.

    Examples
    --------
    >>> some, two = measurements.select([0, 1]), measurements.select([1])
    >>> astray([(some, two), (some, two)]) == {some.views[0].name}
    True
    """
    left_out = Counter(
        name
        for measured, left in examined
        for name in {view.name for view in measured.views} - {view.name for view in left.views}
    )
    return frozenset(name for name, pairs in left_out.items() if pairs > 1)


def _without(
    left_out: frozenset[str],
    measurements: RigMeasurements,
    pair: Pair,
    error: HandeyeError,
    *,
    by_joints: bool,
) -> Examination:
    """Examine a pair whose views contradict one another without some stations."""
    measured = measurements.pairs[pair]
    rest = measured.without(left_out, ELSEWHERE)
    try:
        if len(rest) == len(measured):
            raise error
        return examine(rest, by_joints=by_joints) if len(rest) >= FEWEST_STATIONS else Examination(rest)
    except HandeyeError as failure:
        if len(measurements.pairs) == 1:
            raise
        where = f"camera {pair[0]}, target {pair[1]}"
        raise type(failure)(f"{where}: {failure.message}", code=failure.code, hint=failure.hint) from failure
