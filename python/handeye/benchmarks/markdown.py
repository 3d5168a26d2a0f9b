"""The results of the benchmarks as a page of tables."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

ABOUT = (
    "Written by `handeye bench`. Processor times of calls from Python on one core, medians with quartiles; "
    "methods take turns in one run, so that ratios hold where the machine is busy with other things too."
)


def markdown(document: Mapping[str, Any]) -> str:
    """Return one page of Markdown that holds what the JSON object holds, rounded."""
    machine = document["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in document["versions"].items())
    units = ", ".join(machine["vector_units"]) or "none beyond the base"
    facts = [
        f"processor: {machine['processor']}, {machine['cores']} cores, vector units: {units}",
        f"system: {machine['system']}",
        f"load when the run began: {_number(machine['load'])}",
        f"versions: {versions}; {machine['compiler'] or 'no C++ compiler'}",
        f"seed {document['seed']}, about {document['budget_s']} s for each method at each size",
    ]
    parts = ["# Benchmarks", ABOUT, "\n".join(f"- {fact}" for fact in facts)]
    for name, part in _PARTS.items():
        if name in document:
            parts += part(document[name])
    return "\n\n".join(parts) + "\n"


def _solve(found: Mapping[str, Any]) -> list[str]:
    sizes = found["sizes"].values()
    heads = [f"{size['views']} views x {size['points']}" for size in sizes]
    names = list(dict.fromkeys(name for size in sizes for name in size["methods"]))
    return [
        "## Solve with covariance",
        "Microseconds for one calibration, and how many times that of this package.",
        _table(
            ["method", *heads],
            ([name, *(_times(size["methods"].get(name)) for size in sizes)] for name in names),
        ),
        "Quartiles of the times, and by how much the squared error exceeds that of the optimum, relatively.",
        _table(
            ["method", *heads],
            ([name, *(_spread(size["methods"].get(name)) for size in sizes)] for name in names),
        ),
        *_notes(found),
    ]


def _score(found: Mapping[str, Any]) -> list[str]:
    cases = found["cases"].values()
    heads = [f"{case['lens']}, {case['points']} points" for case in cases]
    names = list(dict.fromkeys(name for case in cases for name in case["methods"]))
    count = max(case["candidates"] for case in cases)
    return [
        "## Score candidates",
        f"Nanoseconds per candidate of {count} given as 4 x 4 poses, and times that of this package.",
        _table(
            ["method", *heads],
            ([name, *(_times(case["methods"].get(name), 1e3) for case in cases)] for name in names),
        ),
        "Quartiles, and the largest difference of a gain from this package's in nats.",
        _table(
            ["method", *heads],
            ([name, *(_spread(case["methods"].get(name), 1e3) for case in cases)] for name in names),
        ),
        *_notes(found),
    ]


def _default(found: Mapping[str, Any]) -> list[str]:
    rows = [
        [name.replace("_", " "), *(_number(case[f"{what}_us"] / 1e3) for what in ("median", "low", "high"))]
        for name, case in found["cases"].items()
    ]
    return [
        "## The default model",
        (
            "Milliseconds, median and quartiles. Estimates are of simulated cells with all errors at once, "
            "of one camera unless said; solving is all that `handeye solve` does with the shipped "
            "recording after its corners are found."
        ),
        _table(["what", "median", "low", "high"], rows),
    ]


def _step(found: Mapping[str, Any]) -> list[str]:
    cases = found["cases"]
    stages = list(next(iter(cases.values()))["stages"])
    rows = [
        [
            name.replace("_", " "),
            *(_number(case["stages"][name]["median_us"] / 1e3) for case in cases.values()),
        ]
        for name in stages
    ]
    rows.append(["**sum**", *(_number(case["total_ms"]) for case in cases.values())])
    without = (_number(case["total_without_certificate_ms"]) for case in cases.values())
    rows.append(["sum without the certificate", *without])
    rows.append(["parameters", *(str(case["parameters"]) for case in cases.values())])
    views, count = (next(iter(cases.values()))[what] for what in ("views", "candidates"))
    return [
        "## A planning step",
        f"Milliseconds; {views} views of 88 points, {count} candidates from joint positions.",
        _table(["stage", *cases], rows),
    ]


def _loop(found: Mapping[str, Any]) -> list[str]:
    width, height = found["image_px"]
    rows = [
        [name, _number(time["median_ms"]), f"{_number(time['low_ms'])} to {_number(time['high_ms'])}"]
        for name, time in found["stages"].items()
    ]
    rows.append(["**sum without robot and camera**", _number(found["total_ms"]), ""])
    what = (
        f"Milliseconds, medians with quartiles over {found['steps']} planned steps of a simulated "
        f"{found['arm']}: rendered pictures of {width} x {height} pixels, {found['target']} of "
        f"{found['points']} points, links judged by capsules. Each stage without those inside it."
    )
    return [
        "## A step of the closed loop",
        what,
        _table(["stage", "median", "quartiles"], rows),
    ]


def _memory(found: Mapping[str, Any]) -> list[str]:
    said = (
        f"A process that scores {found['candidates']} candidates of {found['points']} points peaks at "
        f"{found['peak_mb']:.0f} MB, of which the candidates are {found['candidates_mb']:.0f} MB and the "
        f"interpreter with its libraries {found['before_mb']:.0f} MB."
    )
    return ["## Memory", said]


def _scaling(found: Mapping[str, Any]) -> list[str]:
    rows = [
        [
            name.replace("_", " "),
            law["what"],
            ", ".join(str(size) for size in law["sizes"]),
            ", ".join(_number(time) for time in law["times_us"]),
            f"{law['exponent']:.3f}",
        ]
        for name, law in found["laws"].items()
    ]
    threads = found["threads"]
    speed = ", ".join(f"{count}: {times:.2f}" for count, times in threads["speed_up"].items())
    offered = f"{threads['candidates']} candidates of {threads['points']} points"
    return [
        "## Growth of cost",
        "Fastest times in microseconds; the exponent is the slope in logarithms.",
        _table(["against", "at", "sizes", "times", "exponent"], rows),
        f"{offered}, times as fast by the clock for each number of threads: {speed}.",
    ]


_PARTS: dict[str, Callable[[Mapping[str, Any]], list[str]]] = {
    "solve": _solve,
    "default": _default,
    "score": _score,
    "step": _step,
    "loop": _loop,
    "memory": _memory,
    "scaling": _scaling,
}


def _notes(found: Mapping[str, Any]) -> list[str]:
    notes = [f"- {name}: {what}" for name, what in found["what"].items() if name not in found["skipped"]]
    notes += [f"- {name} was left out: {why}" for name, why in found["skipped"].items()]
    return ["\n".join(notes)]


def _times(row: Mapping[str, Any] | None, scale: float = 1.0) -> str:
    if row is None:
        return ""
    return f"{_number(row['median_us'] * scale)} ({_number(row['times_handeye'])} x)"


def _spread(row: Mapping[str, Any] | None, scale: float = 1.0) -> str:
    if row is None:
        return ""
    difference = row.get("excess_cost", row.get("largest_difference"))
    told = "" if difference is None else f"; {difference:.0e}"
    return f"{_number(row['low_us'] * scale)} to {_number(row['high_us'] * scale)}{told}"


def _number(value: float | None) -> str:
    """Three digits that count."""
    if value is None:
        return "unknown"
    if abs(value) >= 100:
        return f"{value:,.0f}"
    return f"{value:.1f}" if abs(value) >= 10 else f"{value:.2f}"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
