"""The shortest way to a plan: a recording, poses that the robot can reach, and out comes their order."""

from collections.abc import Sequence

from handeye.estimation import Measurements, make_estimator
from handeye.estimation.initialize import check_views
from handeye.planning.candidates import Pool
from handeye.planning.planner import Planner, PlannerOptions
from handeye.planning.ranking import Ranking, rank
from handeye.types.calibration import ModelName
from handeye.types.pose import Pose
from handeye.types.recording import Recording


def plan(
    recording: Recording,
    candidates: Pool | Sequence[Pose],
    *,
    model: ModelName = ModelName.AUTO,
    top: int | None = None,
) -> Ranking:
    """Rank poses by what a view from each would teach, by the decrease of entropy.

    Parameters
    ----------
    recording
        Views that are taken already, at least three.
    candidates
        `T_base_flange` of poses that the robot can reach. Those from which the camera would not see the whole
        target are listed as infeasible.
    model
        Assumptions about robot and camera.
    top
        Rank only so many.

    Raises
    ------
    InputError
        Fewer than three usable views.
    DegenerateError
        The views do not determine where the target is.

    Examples
    --------
    >>> import handeye
    >>> from handeye.datasets.shipped import shipped_recording
    >>> recording = handeye.open_folder(shipped_recording()).recording
    >>> left = [view.T_base_flange for view in recording.views[5:]]
    >>> ranking = plan(recording.with_views(recording.views[:5]), left)
    >>> ranking.prospects[0].gain > ranking.prospects[-1].gain > 0
    True
    """
    measurements = Measurements.of_recording(recording)
    check_views(measurements)
    pool = candidates if isinstance(candidates, Pool) else Pool.of_poses(candidates)
    options = PlannerOptions()
    planner = Planner(measurements, pool, make_estimator(model), options)
    return rank(planner.estimate, planner.pool, options.criterion, gains=planner.gains(), top=top)
