"""Whole views that do not belong: the set of views with the highest evidence.

A view that belongs has the predictive density of the weighing; a mistaken one has that density widened by an
error of unknown size, each size as likely on a logarithmic scale, times the probability of a mistake. The set
of views that maximises the product is searched from a core that agrees, view by view, so that bad views
cannot mask each other (forward search, Atkinson and Riani 2000), and compared with all views as they are.
"""

from dataclasses import dataclass

import numpy as np

from handeye.estimation.mistakes.consensus import Consensus
from handeye.estimation.mistakes.noise_grid import BoolArray, NoiseGrid
from handeye.estimation.mistakes.sightings import Sightings
from handeye.estimation.mistakes.weighing import LOG_2PI, Fit, Prediction, Weighing
from handeye.types.arrays import FloatArray, IndexArray

# Probability that a view is mistaken, before looking.
LOG_MISTAKE = float(np.log(1e-3))
# Sizes of a mistake: translation, and the lever that turns it into a rotation.
MISTAKE_SIZES_M = np.geomspace(1e-3, 1.0, 7)
MISTAKE_LEVERS_M = np.array([0.1, 0.4, 1.6])
LARGEST_MISTAKE_RAD = 1.5
# The error of an arm changes with its posture: here and there a pose is off by more than the others, and no
# mistake.
ODD_SHARE = 0.1
ODD_TRANSLATION_M = 0.7e-3
ODD_ROTATION_RAD = np.deg2rad(0.07)
# A view whose density outweighs that of a mistake by this factor (a logarithm) joins without waiting its
# turn.
CLEAR = 5.0
# Where the best of the others is worse than this, adding them one by one leads nowhere.
HOPELESS = 20.0
MOST_EXCHANGES = 10
FEWEST_VIEWS = 3


@dataclass(frozen=True, eq=False)
class Selection:
    """The views that belong together.

    Parameters
    ----------
    weighing
        The views linearised at the answer.
    fit
        Of the members.
    prediction
        What the members say of every view.
    log_odds
        (K,) logarithm of the odds that each view is mistaken and not only odd, given the members.
    log_evidence
        Of the members, and of the others as mistakes.
    """

    weighing: Weighing
    fit: Fit
    prediction: Prediction
    log_odds: FloatArray
    log_evidence: float

    @property
    def members(self) -> BoolArray:
        """(K,) which views belong."""
        return self.fit.members


def mistake_log_density(weighing: Weighing, prediction: Prediction) -> FloatArray:
    """(K,) density of the twists if the robot's pose were wrong, its prior probability included."""
    deviation, covariance = weighing.at_flange(prediction)
    sizes, levers = (axis.ravel() for axis in np.meshgrid(MISTAKE_SIZES_M, MISTAKE_LEVERS_M))
    turns = np.minimum(sizes / levers, LARGEST_MISTAKE_RAD)
    widened = covariance[:, np.newaxis] + np.zeros((len(sizes), 6, 6))
    for i in range(6):
        widened[..., i, i] += np.square(sizes if i < 3 else turns)
    solved = np.linalg.solve(widened, deviation[:, np.newaxis, :, np.newaxis])[..., 0]
    distance = np.einsum("ki,kmi->km", deviation, solved)
    log_each = -0.5 * (np.maximum(distance, 0.0) + np.linalg.slogdet(widened)[1] + 6 * LOG_2PI)
    return LOG_MISTAKE + np.logaddexp.reduce(log_each, axis=1) - np.log(len(sizes))


def member_log_density(weighing: Weighing, prediction: Prediction) -> FloatArray:
    """(K,) density of the twists if the views belong: as predicted, or odd as an arm may be."""
    deviation, covariance = weighing.at_flange(prediction)
    odd = covariance + np.diag([ODD_TRANSLATION_M**2] * 3 + [ODD_ROTATION_RAD**2] * 3)
    distance = np.einsum("ki,ki->k", deviation, np.linalg.solve(odd, deviation[..., np.newaxis])[..., 0])
    log_odd = -0.5 * (np.maximum(distance, 0.0) + np.linalg.slogdet(odd)[1] + 6 * LOG_2PI)
    return np.logaddexp(np.log1p(-ODD_SHARE) + prediction.log_density, np.log(ODD_SHARE) + log_odd)


def select(sightings: Sightings, consensus: Consensus, grid: NoiseGrid) -> Selection:
    """Find the views that belong together, starting from a consensus."""
    weighing = Weighing(sightings, consensus.X, consensus.Y, grid)
    first = _search(weighing, _core(consensus))
    # Once more, linearised at the answer, with the levels of noise that are left.
    at = first.weighing.estimate(first.fit)
    return _search(Weighing(sightings, *at, first.weighing.grid), first.members)


def _core(consensus: Consensus) -> BoolArray:
    count = len(consensus.distances_m)
    members = np.zeros(count, dtype=bool)
    members[np.argsort(consensus.distances_m)[: max(FEWEST_VIEWS, count // 2 + 1)]] = True
    return members


def _search(weighing: Weighing, start: BoolArray) -> Selection:
    """Add views in the order in which they agree; keep the best set on the way; then exchange."""
    everyone = np.ones(len(start), dtype=bool)
    weighing = weighing.narrowed([weighing.fit(everyone), weighing.fit(start)])
    best = current = weigh(weighing, start)
    while not current.members.all():
        outside = np.flatnonzero(~current.members)
        odds = current.log_odds[outside]
        if odds.min() > HOPELESS:
            break
        joining = outside[odds < -CLEAR] if (odds < -CLEAR).any() else outside[[np.argmin(odds)]]
        members = current.members.copy()
        members[joining] = True
        current = weigh(weighing, members)
        if current.log_evidence > best.log_evidence:
            best = current
    if not current.members.all():  # Views that seem far off may all be: the arm is just no better.
        best = max(best, weigh(weighing, everyone), key=lambda s: s.log_evidence)
    best = _exchange(weighing, best)
    odd = ~best.members & (best.log_odds <= 0)
    if odd.any():  # Only odd: it takes part, as an arm's noise includes such poses.
        best = weigh(weighing, best.members | odd)
    return best


def weigh(weighing: Weighing, members: BoolArray) -> Selection:
    """Weigh one set of members, the others taken as mistakes."""
    fit = weighing.fit(members)
    prediction = weighing.predict(fit)
    mistaken = mistake_log_density(weighing, prediction)
    log_evidence = fit.log_evidence + float(mistaken[~members].sum())
    odds = mistaken - member_log_density(weighing, prediction)
    return Selection(weighing, fit, prediction, odds, log_evidence)


def weigh_pairs(
    selection: Selection, images: IndexArray, motions: IndexArray, poses: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Weigh other pairs against the members: the image of `images[n]`, read as `poses[n]`, at `motions[n]`.

    Returns the logarithm of the odds that a pair is mistaken (N,) and of its density (N,).
    """
    weighing = selection.weighing
    inside = np.flatnonzero(selection.members)
    tried = weighing.sightings.paired(np.concatenate([inside, images]), np.concatenate([inside, motions]))
    tried = tried.with_poses(np.concatenate([tried.poses[: len(inside)], poses]))
    extended = Weighing(tried, weighing.X, weighing.Y, weighing.grid)
    prediction = extended.predict(extended.fit(np.arange(len(tried)) < len(inside)))
    odds = mistake_log_density(extended, prediction) - member_log_density(extended, prediction)
    return odds[len(inside) :], prediction.log_density[len(inside) :]


def _exchange(weighing: Weighing, best: Selection) -> Selection:
    """Move single views in or out while that raises the evidence."""
    for _ in range(MOST_EXCHANGES):
        # Members that would be better out, outsiders that would be better in.
        gain = np.where(best.members, best.log_odds, -best.log_odds)
        if best.members.sum() <= FEWEST_VIEWS:
            gain = np.where(best.members, -np.inf, gain)
        worst = int(np.argmax(gain))
        if gain[worst] <= 0:
            break
        members = best.members.copy()
        members[worst] = not members[worst]
        changed = weigh(weighing, members)
        if changed.log_evidence <= best.log_evidence:
            break
        best = changed
    return best
