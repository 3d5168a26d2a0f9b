"""Boards that look the same turned: cameras that count from different ends are brought to agree.

Labels that are turned alike in all views of one camera only move the board, and nothing is wrong with them.
Where two cameras see one board they must mean the same points.
"""

from dataclasses import replace

import numpy as np

from handeye.estimation.faults.relabel import Relabeling, turns
from handeye.estimation.initialize import MIN_VIEWS, pose_start
from handeye.estimation.measurements import Measurements
from handeye.estimation.rig_measurements import Pair, RigMeasurements
from handeye.types.pose import Pose


def agree_on_labels(measurements: RigMeasurements) -> RigMeasurements:
    """Return the measurements with all cameras meaning the same points of every board."""
    X: dict[str, Pose] = {}
    Y: dict[str, Pose] = {}
    changed: dict[Pair, Measurements] = {}
    ambiguous = {
        target: same
        for target, one in measurements.targets.items()
        if len(same := [turn for turn in turns(one.target) if turn.looks_the_same]) > 1
        and sum(name == target for _, name in measurements.pairs) > 1
    }
    if not ambiguous:
        return measurements
    moving = [
        pair
        for pair, measured in measurements.pairs.items()
        if measurements.moves(*pair) and len(measured) >= MIN_VIEWS
    ]
    for camera, target in sorted(moving, key=lambda pair: -len(measurements.pairs[pair])):
        measured = measurements.pairs[camera, target]
        start = pose_start(measured)
        X.setdefault(camera, start.X)
        if target in Y and target in ambiguous:
            own = start.Y
            best = min(ambiguous[target], key=lambda turn: _angle(Y[target], own, turn))
            if best is not ambiguous[target][0]:
                changed[camera, target] = _read(measured, [best] * len(measured))
        Y.setdefault(target, start.Y)
    for (camera, target), measured in measurements.pairs.items():
        if measurements.moves(camera, target) or target not in ambiguous:
            continue
        if camera not in X or target not in Y:
            continue
        chain = X[camera] @ Y[target]
        chosen = [
            min(ambiguous[target], key=lambda turn: _angle(chain, pose.T_camera_target, turn))
            for pose in measured.poses
        ]
        if any(turn is not ambiguous[target][0] for turn in chosen):
            changed[camera, target] = _read(measured, chosen)
    return measurements.with_pairs(changed)


def _angle(expected: Pose, found: Pose, turn: Relabeling) -> float:
    return float(np.abs((expected.inverse() @ found @ Pose(turn.factor)).rotation_angle_rad))


def _read(measured: Measurements, chosen: list[Relabeling]) -> Measurements:
    return replace(
        measured,
        views=tuple(turn.applied(view) for turn, view in zip(chosen, measured.views, strict=True)),
        poses=tuple(turn.applied_to_pose(pose) for turn, pose in zip(chosen, measured.poses, strict=True)),
    )
