"""The loop of the paper's Algorithm 1 as ask, tell, verdict; the world stays outside."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.estimate import Estimate, Estimator
from handeye.estimation.measurements import Measurements
from handeye.planning.candidates import Candidate, Pool
from handeye.planning.policies import NextBestView, Policy, Situation
from handeye.planning.prediction import Sight, gains
from handeye.planning.stopping import State, Stop, StopRule, first_verdict
from handeye.planning.travel import Travel
from handeye.types.arrays import FloatArray
from handeye.types.view import View


@dataclass(frozen=True, eq=False)
class Proposal:
    """The next view to take.

    Parameters
    ----------
    candidate
        Where to go.
    predicted_gain
        Gain that the criterion predicts for it.
    gains
        (N,) gains of all candidates that were left, by `names`; NaN for infeasible ones.

    Examples
    --------
    >>> candidate = Candidate("left_high", recording.views[0].T_base_flange)
    >>> Proposal(candidate, 0.7, np.array([0.7]), ("left_high",)).candidate.name
    'left_high'
    """

    candidate: Candidate
    predicted_gain: float
    gains: FloatArray
    names: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a view brought.

    Parameters
    ----------
    estimate
        What is believed with it.
    predicted_gain
        Gain that was predicted for it; NaN for a view that was not proposed.
    realised_gain
        By how much the entropy of all parameters fell; NaN if it was not finite before.

    Examples
    --------
    >>> Verdict(estimate, predicted_gain=0.7, realised_gain=0.6).realised_gain
    0.6
    """

    estimate: Estimate
    predicted_gain: float
    realised_gain: float


@dataclass(frozen=True)
class PlannerOptions:
    """How to choose and when to stop.

    Parameters
    ----------
    policy
        Chooses among the feasible candidates.
    criterion
        What a view is worth.
    stop_rules
        Asked in this order before every proposal.
    sight
        What a candidate must show of the target.
    seed
        Of the planner's own chance.
    young_sigma_m
        While the standard deviation of the camera's position lies between these two, gains are averaged over
        sigma points of X and Y; beyond the second nothing can be predicted, below the first nothing changes.
        None to take the estimate at its word.
    travel
        Where the arm stands and how fast it is, for policies that weigh time; None if that is not known.

    Examples
    --------
    >>> PlannerOptions(policy=make_policy("random"), seed=3).policy.name
    'random'
    """

    policy: Policy = field(default_factory=NextBestView)
    criterion: _core.Criterion = field(default_factory=lambda: _core.Criterion("entropy"))
    stop_rules: tuple[StopRule, ...] = ()
    sight: Sight = field(default_factory=Sight)
    seed: int = 0
    young_sigma_m: tuple[float, float] | None = None
    travel: Travel | None = None


class Planner:
    """Chooses views: `ask` proposes one or stops, the world measures it, `tell` takes it in.

    Parameters
    ----------
    measurements
        Views taken already, at least three.
    pool
        Candidates.
    estimator
        Turns measurements into an estimate.
    options
        Policy, criterion, stop rules, sight and seed.

    Raises
    ------
    InputError
        Fewer than three views.

    Examples
    --------
    >>> from handeye.estimation import AutoEstimator
    >>> planner = Planner(measurements.select(range(4)), Pool.of_views(recording.views[4:]), AutoEstimator())
    >>> planner.ask().predicted_gain > 0
    True
    """

    def __init__(
        self,
        measurements: Measurements,
        pool: Pool,
        estimator: Estimator,
        options: PlannerOptions | None = None,
    ) -> None:
        self._measurements = measurements
        self._pool = pool.without(view.name for view in measurements.views)
        self._estimator = estimator
        self._options = options or PlannerOptions()
        self._random = np.random.default_rng(self._options.seed)
        self._estimate = estimator(measurements)
        self._pending: Proposal | None = None
        self._gains: FloatArray | None = None

    @property
    def estimate(self) -> Estimate:
        """What is believed now."""
        return self._estimate

    @property
    def measurements(self) -> Measurements:
        """Views taken so far."""
        return self._measurements

    @property
    def pool(self) -> Pool:
        """Candidates left."""
        return self._pool

    def gains(self) -> FloatArray:
        """(N,) gain of each candidate left; NaN where too little of the target would be in sight."""
        if self._gains is None:
            self._gains = self._scored(self._pool)
        return self._gains

    def _scored(self, pool: Pool) -> FloatArray:
        if len(pool) == 0:
            return np.zeros(0)
        return gains(
            self._estimate,
            self._options.criterion,
            pool.motions(self._measurements.mounting),
            self._options.sight,
            joints=pool.joints,
            over_posterior=self._is_young(),
        )

    def _is_young(self) -> bool:
        limits = self._options.young_sigma_m
        if limits is None:
            return False
        sigma = float(np.sqrt(np.trace(self._estimate.hand_eye_covariance[:3, :3])))
        return limits[0] < sigma < limits[1]

    def ask(self) -> Proposal | Stop:
        """Propose the next view, or say why there is none to take."""
        gains = self.gains()
        state = State(self._measurements, self._estimate, gains)
        stop = first_verdict(self._options.stop_rules, state)
        if stop is not None:
            return stop
        travel, joints = self._options.travel, self._pool.joints
        seconds = None if travel is None or joints is None else travel.seconds(joints)
        situation = Situation(self._measurements.views, self._pool, gains, self._random, seconds)
        choice = self._options.policy.choose(situation)
        names = tuple(candidate.name for candidate in self._pool.candidates)
        chosen = self._pool.candidates[choice.index]
        self._pending = Proposal(chosen, float(gains[choice.index]), gains, names)
        return self._pending

    def tell(self, view: View) -> Verdict:
        """Take in a view, proposed or not.

        Raises
        ------
        InputError
            The view's name is taken, or the target's pose cannot be found in it; nothing has changed then.
        """
        if any(view.name == other.name for other in self._measurements.views):
            raise InputError(f"view {view.name}: already taken", code=Code.DUPLICATE_VIEW)
        measurements = self._measurements.with_views([view])
        if view.name in measurements.rejected:
            raise InputError(f"view {view.name}: {measurements.rejected[view.name]}", code=Code.UNUSABLE_VIEW)
        before = self._estimate
        estimate = self._estimator(measurements, before)
        proposal = self._pending
        predicted = (
            proposal.predicted_gain
            if proposal is not None and proposal.candidate.name == view.name
            else float("nan")
        )
        realised = before.entropy - estimate.entropy if np.isfinite(before.entropy) else float("nan")
        self._measurements, self._estimate, self._pending = measurements, estimate, None
        self._pool = self._pool.without([view.name])
        self._gains = None
        return Verdict(estimate, predicted, realised)

    def give_up(self, name: str) -> None:
        """Take a candidate out of the pool that could not be reached or did not show the target."""
        kept = [candidate.name != name for candidate in self._pool.candidates]
        self._gains = None if self._gains is None else self._gains[kept]
        self._pool = self._pool.without([name])
        self._pending = None

    def offer(self, candidates: Sequence[Candidate]) -> None:
        """Add candidates to those left.

        Raises
        ------
        InputError
            One has the name of another that is left.
        """
        pool = Pool((*self._pool.candidates, *candidates))
        if self._gains is not None:
            self._gains = np.concatenate([self._gains, self._scored(Pool(tuple(candidates)))])
        self._pool, self._pending = pool, None


def replay(planner: Planner, views: Sequence[View]) -> list[Proposal | Stop]:
    """Run the loop on recorded views until it stops; the planner's candidates carry the views' names.

    Parameters
    ----------
    planner
        Begun, its candidates by the names of the views.
    views
        Recorded views.

    Raises
    ------
    HandeyeError
        As the planner and its estimator.

    Examples
    --------
    >>> from handeye.estimation import AutoEstimator
    >>> options = PlannerOptions(stop_rules=(NumberOfViews(5),), sight=Sight(known=True))
    >>> pool = Pool.of_views(recording.views[4:])
    >>> planner = Planner(measurements.select(range(4)), pool, AutoEstimator(), options)
    >>> replay(planner, recording.views)[-1].reason.value
    'views_taken'
    """
    by_name = {view.name: view for view in views}
    history: list[Proposal | Stop] = []
    while True:
        answer = planner.ask()
        history.append(answer)
        if isinstance(answer, Stop):
            return history
        planner.tell(by_name[answer.candidate.name])
