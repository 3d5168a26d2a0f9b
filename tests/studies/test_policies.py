"""Policies in the same cells: lattices as described, paired noise, equal budgets; gains that correlate."""

from pathlib import Path

import numpy as np
import pytest

from handeye import _core
from handeye.compute.checkpoint import Checkpoint
from handeye.errors import InputError
from handeye.robots.simulated import ArmErrors
from handeye.studies.gains import QUANTITIES, GainScatter, reliability, study_gains
from handeye.studies.gains_picture import draw_gains
from handeye.studies.lattices import LATTICES
from handeye.studies.measured_cell import MeasuredCell, measured_cell
from handeye.studies.policies import OURS, POLICY_ROWS, study_policies
from handeye.types import Mounting

FIRST = np.array([[1.0, 0, 0, -0.1], [0, -1, 0, 0.05], [0, 0, -1, 0.6], [0, 0, 0, 1]])


@pytest.fixture(scope="module")
def cell() -> MeasuredCell:
    errors = ArmErrors(encoder_sigma_rad=1e-4, offset_sigma_rad=1e-4)
    return measured_cell(3, Mounting.EYE_TO_HAND, errors, pool_size=12, seed=2)


def test_lattices_have_the_moves_of_their_tools() -> None:
    random = np.random.default_rng(0)
    counts = {name: len(lattice(FIRST, random)) for name, lattice in LATTICES.items()}
    assert counts == {"easy_handeye_17": 17, "sentiac_44": 44, "serpentine": 25, "human": 40}
    for lattice in LATTICES.values():
        for view in lattice(FIRST, random):
            np.testing.assert_allclose(view[:3, :3] @ view[:3, :3].T, np.eye(3), atol=1e-12)
    turns = _core.se3_log(LATTICES["easy_handeye_17"](FIRST, random)[:12] @ np.linalg.inv(FIRST))
    assert sorted(np.rad2deg(np.linalg.norm(turns[:, 3:], axis=1)).round(1)) == [12.5] * 6 + [25.0] * 6
    # A camera that goes round the target, or looks at it, has it in the middle of the picture.
    for view in LATTICES["sentiac_44"](FIRST, random):
        np.testing.assert_allclose(view[:2, 3], 0, atol=1e-9)
    np.testing.assert_allclose(
        LATTICES["serpentine"](FIRST, random)[:, :3, 3], FIRST[:3, 3][None].repeat(25, 0)
    )


def test_noise_is_paired_by_step_and_redrawn_by_draw(cell: MeasuredCell) -> None:
    one, other = (view.joints_rad or () for view in cell.recording.views[:2])
    first = cell.measure(one, 4, "a")
    np.testing.assert_array_equal(first.pixels, cell.measure(one, 4, "b").pixels)
    assert np.abs(first.pixels - cell.measure(one, 5, "a").pixels).max() > 0.05
    assert np.abs(first.pixels - cell.measure(one, 4, "a", draw=1).pixels).max() > 0.05
    # The pixel noise of a step is the same wherever a policy goes.
    exact = measured_cell(3, Mounting.EYE_TO_HAND, ArmErrors(), pool_size=12, seed=2)
    noise: list[np.ndarray] = []
    for joints in (one, other):
        view = exact.measure(joints, 4, "a")
        chain = (exact.X @ Mounting.EYE_TO_HAND.chain(view.T_base_flange) @ exact.Y).matrix
        target, camera = exact.recording.target, exact.true_camera
        seen, _ = _core.project_features(camera.lens, camera.parameters, chain, target.points, target.radii_m)
        noise.append(view.pixels - seen)
    np.testing.assert_allclose(noise[0], noise[1], atol=1e-9)


def test_every_row_takes_its_budget_and_ours_is_compared_with_itself() -> None:
    document = study_policies(budgets=(5, 6), mountings=[Mounting.EYE_IN_HAND], trials=1, seed=4).to_dict()
    parts = document["mountings"]["eye_in_hand"]
    assert set(parts) == {"5", "6"}
    for budget, rows in parts.items():
        assert set(rows) == set(POLICY_ROWS)
        assert rows[OURS]["translation_mm"]["over_ours"] == pytest.approx(1)
        for policy, row in rows.items():
            assert row["views"] == float(budget), policy
            assert 1e-4 < row["translation_mm"]["mean"] < 20, policy
    assert parts["5"]["random"] != parts["6"]["random"]


def test_a_correlation_is_that_of_the_mean_over_the_draws() -> None:
    random = np.random.default_rng(5)
    gains = random.uniform(1, 4, 40)
    noise = random.normal(0, 6, (40, 400))
    found = dict.fromkeys(QUANTITIES, tuple(map(tuple, (gains[:, None] + noise).tolist())))
    predicted = {"entropy": tuple(gains), "entropy_handeye": tuple(-gains)}
    scatter = GainScatter(predicted, predicted, found)
    told = scatter.correlations("entropy", "log_error")
    assert told["expected"] > 0.9
    assert 0.05 < told["single"] < 0.3
    assert told["mean_gain"] == pytest.approx(told["expected"])
    assert scatter.correlations("entropy_handeye", "rmse_px")["expected"] < -0.9


def test_a_correlation_is_corrected_for_the_noise_that_is_left_in_the_means() -> None:
    random = np.random.default_rng(6)
    gains = random.uniform(1, 4, 400)
    # Half of what candidates bring is told by the gain; the start of a draw is common to all of them.
    brought = gains + random.normal(0, np.std(gains), 400)
    noise = random.normal(0, 8, (400, 50)) + random.normal(0, 40, 50)
    found = brought[:, None] + noise
    assert reliability(found) == pytest.approx(np.var(brought) / (np.var(brought) + 64 / 50), abs=0.1)
    scatter = GainScatter(
        {"entropy": tuple(gains)},
        {"entropy": tuple(-gains)},
        {"log_error": tuple(map(tuple, found.tolist()))},
    )
    told = scatter.correlations("entropy", "log_error")
    assert told["expected"] < 0.62
    assert told["corrected"] == pytest.approx(np.sqrt(0.5), abs=0.06)
    assert told["mean_gain"] == pytest.approx(-told["expected"])


def test_gains_are_paired_with_what_candidates_bring(tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path, 1)
    document = study_gains(trials=1, candidates=4, draws=2, arm="exact", workers=kept).to_dict()
    again = study_gains(trials=1, candidates=4, draws=2, arm="exact", workers=kept).to_dict()
    assert again == document
    assert (document["starts"], document["candidates"], document["draws"]) == (1, 4, 2)
    assert [len(start["expected"]) for start in document["points"]] == [4]
    draw_gains(document)
    for part in document["correlation"].values():
        assert all(-1 <= found["expected_median"] <= 1 for found in part.values())
    with pytest.raises(InputError, match="2 candidates"):
        study_gains(candidates=2)
