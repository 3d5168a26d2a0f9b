"""Which candidate to take next: one file per policy."""

from handeye.errors import InputError
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
    """Return the policy of a name.

    Raises
    ------
    InputError
        No such policy.
    """
    policy = POLICIES.get(name)
    if policy is None:
        raise InputError(f"policy {name!r}, expected one of {', '.join(POLICIES)}", code="unknown_policy")
    return policy()
