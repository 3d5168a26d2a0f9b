"""Whole views that do not belong: the set of views with the highest evidence.

A view that belongs has the density that the others predict (`agreement`); a mistaken one has that density
widened by an error of unknown size, each size as likely on a logarithmic scale, times the probability of a
mistake. The set of views that maximises the product is searched from a core that agrees, view by view, so
that bad views cannot mask each other (forward search, Atkinson and Riani 2000), and compared with all views
as they are.
"""

import contextlib
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.errors import HandeyeError
from handeye.estimation.faults.agreement import Agreement, BoolArray, SetFit
from handeye.estimation.faults.consensus import Consensus
from handeye.estimation.faults.stations import Stations
from handeye.types.arrays import FloatArray, IndexArray

# Probability that a view is mistaken, before looking.
LOG_MISTAKE = float(np.log(1e-3))
# Sizes of a mistake: translation, up to a metre or what is farther off (a decimal point lost), and the lever
# that turns it into a rotation.
SMALLEST_MISTAKE_M, LARGEST_MISTAKE_M, MISTAKE_SIZES = 1e-3, 1.0, 7
MISTAKE_LEVERS_M = np.array([0.1, 0.4, 1.6])
LARGEST_MISTAKE_RAD = 1.5
# The error of an arm changes with its posture: here and there a pose is off by more than the others, and no
# mistake. By so much, or by so many times the noise of the arm as the members show it.
ODD_SHARE = 0.1
ODD_TRANSLATION_M = 0.7e-3
ODD_ROTATION_RAD = np.deg2rad(0.07)
ODD_RATIO = 2.0
# A view whose density outweighs that of a mistake by this factor (a logarithm) joins without waiting its
# turn.
CLEAR = 5.0
# Where the best of the others is worse than this, adding them one by one leads nowhere.
HOPELESS = 20.0
MOST_EXCHANGES = 10
# Metres or radians: X and Y that moved by less need not be linearised at again.
NEAR = 1e-4
FEWEST_VIEWS = 3


@dataclass(frozen=True, eq=False)
class Selection:
    """The views that belong together.

    Parameters
    ----------
    agreement
        The views linearised at the answer.
    fit
        Of the members, and what they say of every view.
    log_odds
        (K,) logarithm of the odds that each view is mistaken and not only odd, given the members.
    log_evidence
        Of the members, and of the others as mistakes.
    """

    agreement: Agreement
    fit: SetFit
    log_odds: FloatArray
    log_evidence: float

    @property
    def members(self) -> BoolArray:
        """(K,) which views belong."""
        return self.fit.members


def mistake_log_density(agreement: Agreement, fit: SetFit) -> FloatArray:
    """(K,) density of the twists if the robot's pose were wrong, its prior probability included."""
    deviation, covariance = agreement.at_flange(fit)
    farthest = np.maximum(np.linalg.norm(deviation[:, :3], axis=1), LARGEST_MISTAKE_M)
    steps: FloatArray = np.linspace(0.0, 1.0, MISTAKE_SIZES)
    sizes: FloatArray = (
        SMALLEST_MISTAKE_M * (farthest / SMALLEST_MISTAKE_M)[:, np.newaxis, np.newaxis] ** steps
    )
    turns = np.minimum(sizes / MISTAKE_LEVERS_M[:, np.newaxis], LARGEST_MISTAKE_RAD)
    both = np.stack([np.broadcast_to(sizes, turns.shape), turns], axis=-1).reshape(len(deviation), -1, 2)
    variances = np.square(np.repeat(both, 3, axis=2))
    log_each = _core.log_densities(deviation, covariance, variances)
    return LOG_MISTAKE + np.logaddexp.reduce(log_each, axis=1) - np.log(log_each.shape[1])


def member_log_density(agreement: Agreement, fit: SetFit) -> FloatArray:
    """(K,) density of the twists if the views belong: as predicted, or odd as an arm may be."""
    deviation, covariance = agreement.at_flange(fit)
    translation, rotation = agreement.robot_levels(fit)
    largest = (max(ODD_TRANSLATION_M, ODD_RATIO * translation), max(ODD_ROTATION_RAD, ODD_RATIO * rotation))
    odd = np.square(np.repeat(largest, 3))
    log_odd = _core.log_densities(deviation, covariance, np.broadcast_to(odd, (len(deviation), 1, 6)))
    return np.logaddexp(np.log1p(-ODD_SHARE) + fit.log_density, np.log(ODD_SHARE) + log_odd[:, 0])


def select(stations: Stations, consensus: Consensus) -> Selection:
    """Find the views that belong together, starting from a consensus.

    Raises
    ------
    SolveError
        The views are as far apart as no noise explains.
    """
    first = _search(Agreement(stations, consensus.X, consensus.Y), _core_of(consensus))
    # Once more, linearised at the answer.
    again = Agreement(stations, first.fit.X, first.fit.Y)
    if _is_near(first.agreement, first.fit):
        return first
    return _search(again, first.members)


def _is_near(agreement: Agreement, fit: SetFit) -> bool:
    """Tell whether a fit moved X and Y so little that linearising again changes nothing."""
    shift = max(float(np.abs(fit.X - agreement.X)[:3].max()), float(np.abs(fit.Y - agreement.Y)[:3].max()))
    return shift < NEAR


def _core_of(consensus: Consensus) -> BoolArray:
    count = len(consensus.distances_m)
    members = np.zeros(count, dtype=bool)
    members[np.argsort(consensus.distances_m)[: max(FEWEST_VIEWS, count // 2 + 1)]] = True
    return members


def _search(agreement: Agreement, start: BoolArray) -> Selection:
    """Add views in the order in which they agree; keep the best set on the way; then exchange."""
    everyone = np.ones(len(start), dtype=bool)
    best = current = weigh(agreement, start)
    while not current.members.all():
        outside = np.flatnonzero(~current.members)
        odds = current.log_odds[outside]
        if odds.min() > HOPELESS:
            break
        joining = outside[odds < -CLEAR] if (odds < -CLEAR).any() else outside[[np.argmin(odds)]]
        members = current.members.copy()
        members[joining] = True
        current = weigh(agreement, members)
        if current.log_evidence > best.log_evidence:
            best = current
    if not current.members.all():  # Views that seem far off may all be: the arm is just no better.
        with contextlib.suppress(HandeyeError):
            best = max(best, weigh(agreement, everyone), key=lambda s: s.log_evidence)
    best = _exchange(agreement, best)
    odd = ~best.members & (best.log_odds <= 0)
    if odd.any():  # Only odd: it takes part, as an arm's noise includes such poses.
        best = weigh(agreement, best.members | odd)
    return best


def weigh(agreement: Agreement, members: BoolArray) -> Selection:
    """Fit one set of members, the others taken as mistakes."""
    fit = agreement.fit(members)
    mistaken = mistake_log_density(agreement, fit)
    log_evidence = fit.log_evidence + float(mistaken[~members].sum())
    return Selection(agreement, fit, mistaken - member_log_density(agreement, fit), log_evidence)


def weigh_pairs(
    selection: Selection, images: IndexArray, motions: IndexArray, poses: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Try other pairs against the members: the image of `images[n]`, read as `poses[n]`, at `motions[n]`.

    Returns the logarithm of the odds that a pair is mistaken (N,) and of its density (N,).
    """
    agreement = selection.agreement
    inside = np.flatnonzero(selection.members)
    tried = agreement.stations.paired(np.concatenate([inside, images]), np.concatenate([inside, motions]))
    tried = tried.with_poses(np.concatenate([tried.poses[: len(inside)], poses]))
    extended = Agreement(tried, agreement.X, agreement.Y)
    fit = extended.fit(np.arange(len(tried)) < len(inside))
    odds = mistake_log_density(extended, fit) - member_log_density(extended, fit)
    return odds[len(inside) :], fit.log_density[len(inside) :]


def _exchange(agreement: Agreement, best: Selection) -> Selection:
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
        changed = weigh(agreement, members)
        if changed.log_evidence <= best.log_evidence:
            break
        best = changed
    return best
