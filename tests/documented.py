"""What the examples in docstrings may speak of: a small simulated cell and a rig, made once."""

import importlib
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from handeye.datasets import write_recording
from handeye.estimation import AutoEstimator, Measurements, RigMeasurements, estimate_rig, solve
from handeye.export import Result
from handeye.robots import open_arm
from handeye.simulation.cells import CellOptions, ErrorKind, simulate, simulated_arm
from handeye.simulation.rigs import simulate_rig
from handeye.types import Pose


@cache
def _made() -> dict[str, Any]:
    recording = simulate(ErrorKind.WHITE_FLANGE, 3, CellOptions(views=(9, 9)))
    measurements = Measurements.of_recording(recording)
    rig = simulate_rig(ErrorKind.WHITE_FLANGE, 2)
    return {
        "np": np,
        "Path": Path,
        "Pose": Pose,
        "recording": recording,
        "camera": recording.camera,
        "board": recording.target,
        "measurements": measurements,
        "estimate": AutoEstimator()(measurements),
        "result": Result.of(solve(recording), recording.name),
        "arm": simulated_arm(),
        "open_arm": open_arm,
        "rig": rig,
        "rig_estimate": estimate_rig(RigMeasurements.of(rig)),
    }


def names(module: ModuleType, folder: Path) -> dict[str, Any]:
    """Return the names of an example: the public ones of its room, and the cell, its recording in `folder`."""
    if not folder.exists():
        write_recording(_made()["recording"], folder)
    public = {name: getattr(module, name) for name in getattr(module, "__all__", ())}
    return {**vars(importlib.import_module("handeye")), **_made(), "folder": folder, **public}
