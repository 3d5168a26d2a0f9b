"""What accuracy to expect, question by question: which board, how far, how many views, tilt, lens and arm.

Each question varies one thing of a good cell and leaves the others; its answer is `expect`, the prediction of
the planner. All cells have the same seeds, so choices differ by what was varied and not by what was drawn.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from handeye.compute.parallel import Progress, Workers
from handeye.planning.constraints import ViewLimits
from handeye.robots.simulated import ArmErrors
from handeye.session.settings import Configuration, Simulation
from handeye.session.simulated import ORDINARY, usual_errors
from handeye.studies.expectation import CELLS, expect
from handeye.types import Charuco, Chessboard, CircleGrid, Mounting, Target
from handeye.types.units import MM_PER_M

VIEWS = (6, 12)
_USUAL = ViewLimits()


@dataclass(frozen=True)
class AskedCell:
    """A cell in the words of somebody who asks; the values are those of a good one.

    Parameters
    ----------
    arm_errors
        Factor on the errors of an arm in good order; 0 is an exact arm.
    pixel_sigma
        Deviation of the points in the picture, px.
    distance_mm, tilt_deg
        Nearest and farthest distance from camera to target, and the largest angle at which it is seen.
    lens, focal_px
        One of `handeye.session.simulated.LENSES`, and another focal length of it.
    """

    robot: str = "epson_c4l"
    arm_errors: float = 1.0
    pixel_sigma: float = 0.05
    mounting: Mounting = Mounting.EYE_IN_HAND
    distance_mm: tuple[float, float] = (_USUAL.distance_m[0] * MM_PER_M, _USUAL.distance_m[1] * MM_PER_M)
    tilt_deg: float = float(np.rad2deg(_USUAL.tilt_rad))
    lens: str = ORDINARY
    focal_px: float | None = None

    def configuration(self) -> Configuration:
        """Return the cell as the loop takes it."""
        errors = {name: self.arm_errors * value for name, value in vars(usual_errors()).items()}
        nearest, farthest = (distance / MM_PER_M for distance in self.distance_mm)
        return Configuration(
            self.robot,
            mounting=self.mounting,
            limits=ViewLimits((nearest, farthest), float(np.deg2rad(self.tilt_deg))),
            simulation=Simulation(
                ArmErrors(**errors),
                points_only=self.pixel_sigma,
                lens=self.lens,
                focal_px=self.focal_px,
            ),
        )


class Question(StrEnum):
    """What is varied."""

    BOARD = "board"
    DISTANCE = "distance"
    VIEWS = "views"
    TILT = "tilt"
    LENS = "lens"
    ARM = "arm"


@dataclass(frozen=True)
class Choice:
    """One answer to a question: its name, the cell, and the target if it is not that of the good cell."""

    name: str
    cell: AskedCell = field(default_factory=AskedCell)
    target: Target | None = None


CHOICES: Mapping[Question, tuple[Choice, ...]] = {
    Question.BOARD: (
        Choice("squares 10 mm", target=Chessboard(7, 10, 0.01)),
        Choice("squares 20 mm"),
        Choice("squares 40 mm", target=Chessboard(7, 10, 0.04)),
        Choice("fewer, 40 mm", target=Chessboard(4, 5, 0.04)),
        Choice("ChArUco 20 mm", target=Charuco(7, 10, 0.02, 0.015, "DICT_5X5_100")),
        Choice("circles 20 mm", target=CircleGrid(7, 10, 0.02, 0.012)),
    ),
    Question.DISTANCE: tuple(
        Choice(f"{near} to {far} mm", AskedCell(distance_mm=(near, far)))
        for near, far in ((200, 350), (300, 500), (450, 650), (600, 900))
    ),
    Question.VIEWS: (Choice("a good cell"),),
    Question.TILT: tuple(
        Choice(f"up to {tilt} deg", AskedCell(tilt_deg=tilt)) for tilt in (10, 20, 30, 45, 60)
    ),
    Question.LENS: (
        Choice("tele, 2800 px", AskedCell(focal_px=2800.0)),
        Choice("ordinary, 1400 px", AskedCell()),
        Choice("ordinary, 1000 px", AskedCell(focal_px=1000.0)),
        Choice("wide, 780 px", AskedCell(lens="wide")),
        Choice("fisheye, 520 px", AskedCell(lens="fisheye")),
    ),
    Question.ARM: (
        Choice("exact", AskedCell(arm_errors=0.0)),
        Choice("in good order", AskedCell()),
        Choice("3 times worse", AskedCell(arm_errors=3.0)),
        Choice("10 times worse", AskedCell(arm_errors=10.0)),
        Choice("UR5e", AskedCell(robot="ur5e")),
    ),
}
MANY_VIEWS = (5, 6, 8, 10, 12, 16, 20, 30)


def study_questions(
    questions: Sequence[Question] = tuple(Question),
    *,
    cells: int = CELLS,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Return plain values for JSON: by question, its choices with what each makes of the accuracy.

    Parameters
    ----------
    questions
        Those to answer.
    cells
        Simulated cells of each choice.

    Raises
    ------
    InputError, SolveError
        As `expect`.
    """
    answers: dict[str, Any] = {}
    for question in map(Question, questions):
        views = MANY_VIEWS if question is Question.VIEWS else VIEWS
        answers[question.value] = [
            {
                "choice": choice.name,
                "levels": [
                    level.to_dict()
                    for level in expect(
                        choice.cell.configuration(),
                        views,
                        target=choice.target,
                        cells=cells,
                        workers=workers,
                        progress=progress,
                    ).levels
                ],
            }
            for choice in CHOICES[question]
        ]
    return {"study": "questions", "cells": cells, "questions": answers}
