"""Nothing is said of views without a mistake, whatever the arm, the board and the number of views."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cells import Cell
from handeye.estimation import Measurements
from handeye.estimation.faults import examine
from handeye.types import Chessboard, CircleGrid, Mounting, Target

BOARDS: tuple[Target, ...] = (Chessboard(7, 9, 0.03), CircleGrid(4, 4, 0.05, 0.02), Chessboard(4, 5, 0.03))


@settings(max_examples=25, derandomize=True, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    mounting=st.sampled_from(list(Mounting)),
    board=st.sampled_from(BOARDS),
    count=st.integers(3, 14),
    sigma_px=st.floats(0.005, 0.4),
    robot_m=st.floats(0.0, 1e-3),
    robot_rad=st.floats(0.0, 8e-4),
)
def test_random_clean_views_are_left_alone(
    *,
    seed: int,
    mounting: Mounting,
    board: Target,
    count: int,
    sigma_px: float,
    robot_m: float,
    robot_rad: float,
) -> None:
    cell = Cell(np.random.default_rng(seed), mounting, board)
    views = cell.views(
        [cell.robot_pose(cell.look()) for _ in range(count)],
        sigma_px=sigma_px,
        robot_sigma=np.array([robot_m] * 3 + [robot_rad] * 3),
    )
    measurements = Measurements.of(mounting, cell.camera, board, views)
    examination = examine(measurements)
    assert examination.findings == ()
    assert examination.measurements.views == measurements.views
