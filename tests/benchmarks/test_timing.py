"""Turns and statistics of times; no time is asserted."""

from handeye.benchmarks.timing import FEWEST_RUNS, Timing, interleave


def test_quartiles_and_units() -> None:
    timing = Timing.of([4e-3, 1e-3, 2e-3, 3e-3, 5e-3])
    assert (timing.low_s, timing.median_s, timing.high_s, timing.fastest_s) == (2e-3, 3e-3, 4e-3, 1e-3)
    told = timing.to_dict(per=10)
    assert abs(told["median_us"] - 300) < 1e-9
    assert told["runs"] == 5


def test_methods_take_turns_and_are_warmed_up() -> None:
    calls: list[str] = []
    timings = interleave({name: lambda name=name: calls.append(name) for name in "ab"}, budget_s=0.05)
    assert calls[:2] == ["a", "b"]
    turns = [one for one, before in zip(calls[2:], calls[1:], strict=False) if one != before]
    assert turns[:4] in (["a", "b", "a", "b"], ["b", "a", "b", "a"])
    assert calls.count("a") == timings["a"].runs + 1


def test_a_slow_method_runs_all_the_same() -> None:
    timings = interleave({"slow": lambda: sum(range(1_000_000))}, budget_s=0.0)
    assert timings["slow"].runs >= FEWEST_RUNS
