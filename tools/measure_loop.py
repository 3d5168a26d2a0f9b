"""Run simulated cells to the accuracy asked for, and count how often the truth is inside it.

.venv/bin/python tools/measure_loop.py --cells 24 --output out/loop.jsonl
.venv/bin/python tools/measure_loop.py --faults --cells 20 --output out/faults.jsonl
.venv/bin/python tools/measure_loop.py --views 8 --no-refine --cells 12 --output out/eight_as_drawn.jsonl

One line per cell is appended to the output, cells that are there already are not run again: a long
measurement can be made in parts. At the end the file is summed up. Points are projected with noise.
"""

import argparse
import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from handeye.robots.simulated import ArmErrors
from handeye.session.configuration import begin, prepare
from handeye.session.deciding import EndReason
from handeye.session.faults import FaultRates
from handeye.session.settings import Configuration, Simulation
from handeye.session.simulated import usual_errors
from handeye.types import Mounting

MODELLED = ("none", "white_flange", "white_base", "encoder", "joint_offsets")
MIXTURES = {"mixture": 1.0, "mixture_2": 2.0}
KINDS = (*MODELLED, "links", *MIXTURES)
ARMS = ("epson_c4l", "ur5e")
FAULTS = tuple(FaultRates.__dataclass_fields__)
ASKED_MM, ASKED_DEG = 0.5, 0.05


def scaled(factor: float) -> ArmErrors:
    """Return the errors of an arm in good order times a factor."""
    return ArmErrors(**{name: factor * value for name, value in vars(usual_errors()).items()})


def cell(kind: str, number: int) -> Configuration:
    """Return a run; arm, mounting, levels and noise depend on kind and number alone."""
    random = np.random.default_rng([17, KINDS.index(kind), number])

    def level(low: float, high: float) -> float:
        return float(low * (high / low) ** random.uniform())

    noise = level(0.05, 0.2)
    metres, radians = level(0.05e-3, 0.5e-3), float(np.deg2rad(level(0.005, 0.05)))
    errors = {
        "none": ArmErrors(),
        "white_flange": ArmErrors(flange_sigma_m=metres, flange_sigma_rad=radians),
        "white_base": ArmErrors(base_sigma_m=metres, base_sigma_rad=radians),
        "encoder": ArmErrors(encoder_sigma_rad=float(np.deg2rad(level(0.003, 0.03)))),
        "joint_offsets": ArmErrors(offset_sigma_rad=radians),
        "links": ArmErrors(length_sigma_m=metres, twist_sigma_rad=radians),
        **{name: scaled(factor) for name, factor in MIXTURES.items()},
    }[kind]
    return Configuration(
        ARMS[number % 2],
        mounting=Mounting.EYE_TO_HAND if number % 4 >= 2 else Mounting.EYE_IN_HAND,
        accuracy_mm=ASKED_MM,
        accuracy_deg=ASKED_DEG,
        most_views=40,
        seed=1000 * KINDS.index(kind) + number,
        simulation=Simulation(errors, points_only=noise),
    )


def disturbed(number: int, rate: float | None = None) -> tuple[str, Configuration]:
    """Return a run with one kind of fault at a tenth to three tenths of the attempts, or at a rate."""
    fault = FAULTS[number % len(FAULTS)]
    random = np.random.default_rng([19, number])
    drawn = float(random.uniform(0.1, 0.3))
    rates = FaultRates(**{fault: drawn if rate is None else rate})
    quiet = cell(MODELLED[number % len(MODELLED)], 500 + number)
    return fault, replace(
        quiet,
        failures_in_a_row=20,
        simulation=replace(quiet.simulation, faults=rates),
    )


def run(configuration: Configuration) -> dict[str, Any]:
    """Run a cell to its end; return what came of it."""
    began = time.monotonic()
    prepared = prepare(configuration)
    with tempfile.TemporaryDirectory() as folder:
        session, store = begin(prepared, Path(folder) / "session")
        try:
            end = session.run()
            decisions = [entry.decision for entry in store.entries]
        finally:
            store.close()
    line: dict[str, Any] = {"end": end.reason.value, "views": end.views, "attempts": end.attempts}
    line["gains"] = [decision["predicted_gain"] for decision in decisions if "predicted_gain" in decision]
    if end.calibration is not None and end.reach is not None:
        off = (end.calibration.X @ prepared.truth.X.inverse()).log()
        line |= {
            "mm": 1e3 * float(np.linalg.norm(off[:3])),
            "deg": float(np.rad2deg(np.linalg.norm(off[3:]))),
            "promised_mm": end.reach.translation_mm,
            "promised_deg": end.reach.rotation_deg,
        }
    return line | {"seconds": time.monotonic() - began}


def main() -> int:
    """Run what is missing, sum up what is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--cells", type=int, default=24, help="number of cells of each kind, or of fault runs"
    )
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=MODELLED)
    parser.add_argument("--faults", action="store_true", help="runs with faults")
    parser.add_argument("--rate", type=float, help="share of the attempts that a fault befalls")
    parser.add_argument(
        "--beside", type=int, default=40, help="fault runs that have an undisturbed one beside"
    )
    parser.add_argument(
        "--no-refine", action="store_true", help="take the best candidate drawn, climb to no better one"
    )
    parser.add_argument("--views", type=int, help="take so many views whatever is reached")
    parser.add_argument("--policy", default="next_best_view", help="what chooses the views")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument("--output", type=Path, required=True)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    lines = _lines(options.output)
    done = {(line["kind"], line["number"]) for line in lines}
    names = ["faults"] if options.faults else options.kinds
    began = time.monotonic()
    with options.output.open("a") as file:
        for number in range(options.cells):
            for kind in names:
                if (kind, number) in done or time.monotonic() - began > options.seconds:
                    continue
                line: dict[str, Any] = {"kind": kind, "number": number}
                if kind == "faults":
                    fault, configuration = disturbed(number, options.rate)
                    line |= {"fault": fault} | run(configuration)
                    if number < options.beside:
                        calm = replace(configuration.simulation, faults=None)
                        line["undisturbed"] = run(replace(configuration, simulation=calm))
                else:
                    configuration = replace(
                        cell(kind, number), refine=not options.no_refine, policy=options.policy
                    )
                    if options.views is not None:
                        configuration = replace(configuration, accuracy_mm=None, most_views=options.views)
                    line |= run(configuration)
                file.write(json.dumps(line) + "\n")
                file.flush()
                lines.append(line)
    _sum_up(lines)
    return 0


def _lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def _inside(line: Mapping[str, Any]) -> bool:
    return line.get("mm", np.inf) <= ASKED_MM and line.get("deg", np.inf) <= ASKED_DEG


def _sum_up(lines: list[dict[str, Any]]) -> None:
    reached = EndReason.ACCURACY_REACHED.value
    for kind in dict.fromkeys(line["kind"] for line in lines):
        some = [line for line in lines if line["kind"] == kind]
        ended = [line for line in some if line["end"] == reached]
        views, failed = np.mean([e["views"] for e in some]), sum(e["attempts"] - e["views"] for e in some)
        print(
            f"{kind}: {len(some)} runs, {len(ended)} ended with the accuracy reached, "
            f"{sum(map(_inside, ended))} of these inside by the truth, {views:.1f} views, "
            f"{failed} failed attempts, longest {max(e['seconds'] for e in some):.0f} s"
        )
        errors, reached_mm = ([line[key] for line in some if key in line] for key in ("mm", "promised_mm"))
        inside = sum(line["mm"] <= line["promised_mm"] for line in some if "mm" in line)
        print(f"  mean error {np.mean(errors):.3f} mm, inside the stated radius {inside} of {len(errors)}")
        first = [line["gains"][0] for line in some if line.get("gains")]
        if errors and first:
            print(
                f"  median error {np.median(errors):.3f} mm, median radius stated "
                f"{np.median(reached_mm):.3f} mm, mean gain of the first planned view {np.mean(first):.2f}"
            )
        if kind == "faults":
            calm = [line["undisturbed"] for line in some if "mm" in line.get("undisturbed", {})]
            mean, beside = (np.mean([line["mm"] for line in part]) for part in (ended, calm))
            others = Counter(line["end"] for line in some if line["end"] != reached)
            print(f"  mean error {mean:.3f} mm; of {len(calm)} undisturbed {beside:.3f} mm,", end=" ")
            print(f"{sum(map(_inside, calm))} of these inside; other ends: {dict(others)}")
        for line in ended:
            if not _inside(line):
                print(
                    "  outside:",
                    {k: line[k] for k in ("number", "mm", "deg", "promised_mm", "promised_deg", "views")},
                )


if __name__ == "__main__":
    sys.exit(main())
