"""Every method a row: truth without noise, more error with more noise."""

from handeye import _core
from handeye.estimation.pose_costs import POSE_COSTS
from handeye.studies.methods import methods, study_methods


def test_every_method_finds_the_truth_without_noise_and_errs_with_it() -> None:
    document = study_methods(levels=(0.0, 1.0, 4.0), trials=2, seed=3).to_dict()
    assert [level["level"] for level in document["levels"]] == [0.0, 1.0, 4.0]
    assert set(document["mountings"]) == {"eye_in_hand", "eye_to_hand"}
    for rows in document["mountings"].values():
        assert set(rows) == set(methods())
        for name, (none, some, more) in rows.items():
            assert none["answered"] == some["answered"] == more["answered"] == 2, name
            # The camera of a cell is known from a calibration without noise: nothing is left but rounding.
            assert none["translation_mm"] < 1e-5, name
            assert none["rotation_deg"] < 1e-6, name
            assert some["translation_mm"] > 1e-3, name
            assert more["translation_mm"] > some["translation_mm"], name


def test_the_table_has_the_rows_that_the_field_names() -> None:
    rows = set(methods())
    assert {name for name, _, _ in _core.closed_form_methods()} <= rows
    assert set(POSE_COSTS) <= rows
    assert {"shiu_ahmad", "chen", "fassi_legnani", "liang_mao", "reprojection", "handeye"} <= rows
