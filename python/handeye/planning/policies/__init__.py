"""Which candidate to take next: one file per policy."""

from handeye.codes import Code
from handeye.errors import InputError
from handeye.extension import POLICIES as GROUP
from handeye.extension import announced
from handeye.planning.policies.base import Choice, Policy, Situation
from handeye.planning.policies.gain_per_second import GainPerSecond
from handeye.planning.policies.max_distance import MaxDistance
from handeye.planning.policies.next_best_view import NextBestView
from handeye.planning.policies.random import Random

POLICIES: dict[str, type[Policy]] = {
    policy.name: policy for policy in (NextBestView, Random, MaxDistance, GainPerSecond)
}

__all__ = [
    "POLICIES",
    "Choice",
    "GainPerSecond",
    "MaxDistance",
    "NextBestView",
    "Policy",
    "Random",
    "Situation",
    "make_policy",
]


def make_policy(name: str) -> Policy:
    """Return the policy of a name: one of ours, or one that a package announces in `handeye.policies`.

    Raises
    ------
    InputError
        No such policy, or what is announced cannot be loaded or is none.

    Examples
    --------
    >>> make_policy("max_distance").name
    'max_distance'
    """
    policy = POLICIES.get(name)
    if policy is not None:
        return policy()
    others = announced(GROUP)
    if name not in others:
        known = ", ".join([*POLICIES, *others])
        raise InputError(f"policy {name!r}, expected one of {known}", code=Code.UNKNOWN_POLICY)
    try:
        found = others[name].load()()
    except Exception as error:
        raise InputError(
            f"policy {name}: {type(error).__name__}: {error}", code=Code.UNKNOWN_POLICY
        ) from error
    if not isinstance(found, Policy):
        raise InputError(f"policy {name}: {type(found).__name__} is no Policy", code=Code.UNKNOWN_POLICY)
    return found
