"""Public cells and data: what can be held to account without them, and with stand-ins for what is optional."""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from handeye import _core
from handeye.datasets import read_recording
from handeye.datasets.shipped import shipped_recording
from handeye.errors import InputError
from handeye.importing.streams import clock_lag
from handeye.simulation.cells import ErrorKind, simulate
from handeye.simulation.mujoco_pictures import MujocoPictures
from handeye.studies import kinhec, rendered_cell
from handeye.studies.data import load_sets
from handeye.studies.halves import study_halves
from handeye.studies.public_picture import draw_errors, groups_of
from handeye.studies.scale import study_scale
from handeye.studies.table1_parts import study_real_parts, study_table1_parts
from handeye.types import Camera, Chessboard, Mounting

POLICIES = ("next best view", "random", "max distance")
ERRORS = ("translation_mm", "rotation_deg")


def test_the_cameras_of_the_cell_stand_where_they_were_published() -> None:
    wrist, narrow, wide = rendered_cell.cameras()
    assert [one.mounting for one in (wrist, narrow, wide)] == [
        Mounting.EYE_IN_HAND, Mounting.EYE_TO_HAND, Mounting.EYE_TO_HAND,
    ]  # fmt: skip
    base = rendered_cell.T_WORLD_BASE
    np.testing.assert_allclose(narrow.X.inverse().translation + base, [0.917266, 1.074437, 1.861509])
    np.testing.assert_allclose(wide.X.inverse().translation + base, [-0.111275, 0.793605, 1.684685])
    # Both look down and towards each other's side, the x axis of the picture level with the floor.
    for one, sideways in ((narrow, -1), (wide, 1)):
        rotation = one.X.inverse().rotation
        assert rotation[2, 2] < -0.25
        assert rotation[0, 2] * sideways > 0.5
        assert abs(rotation[2, 0]) < 0.02
    # Vertical fields of view: the upper border of the picture is half of it away from the axis.
    for one, field in ((wrist, 58.0), (narrow, 40.0), (wide, 54.0)):
        assert np.rad2deg(2 * np.arctan(360 / one.camera.parameters[1])) == pytest.approx(field)


def test_pools_of_the_cell_are_reachable_and_in_sight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rendered_cell, "POOL", 8)
    for one in rendered_cell.cameras():
        pool = rendered_cell.draw_pool(one, np.random.default_rng(0))
        assert len(pool) == 8
        for candidate in pool.candidates:
            seen = (one.X @ one.mounting.chain(candidate.T_base_flange) @ one.Y).matrix
            points = one.target.points @ seen[:3, :3].T + seen[:3, 3]
            pixels, visible = _core.project(one.camera.lens, one.camera.parameters, points)
            assert visible.all()
            assert np.all((pixels > 15) & (pixels < np.array([1265, 705])))


def test_a_renderer_is_asked_for_by_name_and_only_takes_its_cameras() -> None:
    target, skewed = Chessboard(5, 7, 0.03), np.array([900.0, 900, 639.5, 359.5, 0.1, 0, 0, 0, 0])
    if "mujoco" not in sys.modules:
        try:
            import mujoco  # noqa: F401  # pyright: ignore[reportMissingImports, reportUnusedImport]
        except ImportError:
            with pytest.raises(InputError, match="mujoco is not installed"):
                MujocoPictures(target, Camera("brown_conrady_5", skewed, 1280, 720))
            return
    with pytest.raises(InputError, match="centred pinholes"):
        MujocoPictures(target, Camera("brown_conrady_5", skewed, 1280, 720))


class Stream:
    """A sequence as KinHEC has it: poses of the flange and of the target, with truth."""

    def __init__(self, row: dict[str, Any]) -> None:
        random = np.random.default_rng(row["number"])
        self.eye_in_hand = row["number"] % 2 == 0
        self.synchronous = True
        self.X, self.Y = _core.se3_exp(random.uniform(-0.5, 0.5, (2, 6)))
        self.flange = _core.se3_exp(random.uniform(-1, 1, (20, 6)) * np.repeat([0.4, 1.2], 3))
        noise = _core.se3_exp(random.normal(size=(20, 6)) * np.repeat([5e-4, 1e-3], 3))
        self.other = np.linalg.inv(self.Y) @ self.flange @ self.X @ noise


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """A package `kinhec` with one solver, whose benchmark gives poses and measures."""
    rows = [{"track": "pnp", "number": k, "sequence_id": f"pnp-{k}"} for k in range(4)]
    table = SimpleNamespace(iterrows=lambda: enumerate(SimpleNamespace(to_dict=row.copy) for row in rows))
    io, benchmark = ModuleType("kinhec.io"), ModuleType("kinhec.benchmark")
    io.__dict__.update(load_manifest=lambda *_: table, _load_from_row=lambda _, row: Stream(row))
    solvers: dict[str, Any] = {
        "shah": lambda data, _: {"X": data[0][0], "Y": data[0][0]}  # an answer that is far off
    }

    def evaluate_sequence(sequence: Stream, names: list[str], rng: object) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = []
        for name in names:
            answer = solvers[name]((sequence.flange, sequence.other, None, None), rng)
            off = np.linalg.inv(sequence.X) @ answer["X"]
            mm = 1e3 * float(np.linalg.norm(off[:3, 3]))
            standing = np.abs(answer["Y"] - sequence.Y).max()
            found.append(
                {"track": "pnp", "sequence_id": id(sequence), "solver": name, "ok": True}
                | {"X_trans_err_mm": mm, "X_rot_err_deg": 0.0, "standing": standing}
            )
        return found

    benchmark.__dict__.update(SOLVERS=solvers, evaluate_sequence=evaluate_sequence)
    package = ModuleType("kinhec")
    for name, module in (("kinhec", package), ("kinhec.io", io), ("kinhec.benchmark", benchmark)):
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(kinhec.importlib.metadata, "version", lambda _: "1.1.0")
    return benchmark


def test_kinhec_gets_our_row_in_both_mountings_and_is_left_as_it_was(
    stand_in: ModuleType, tmp_path: Path
) -> None:
    (tmp_path / "sequences.parquet").touch()
    found = kinhec.study_kinhec(tmp_path, tracks=["pnp"])
    assert list(stand_in.SOLVERS) == ["shah"]
    ours = [row for row in found.rows if row["solver"] == kinhec.OURS]
    assert len(ours) == 4
    for row in ours:
        assert row["X_trans_err_mm"] < 2
        assert row["standing"] < 5e-3
    track = found.to_dict()["tracks"]["pnp"]
    assert track["solvers"]["handeye"]["translation_mm"] < track["solvers"]["shah"]["translation_mm"]
    assert track["region_holds"] is None or 0 <= track["region_holds"] <= 1
    with pytest.raises(InputError, match=r"no sequences\.parquet"):
        kinhec.study_kinhec(tmp_path / "nothing")


def test_halves_of_a_folder_agree_by_every_method() -> None:
    found = study_halves(read_recording(shipped_recording()).recording)
    assert found["methods"]["handeye"]["translation_mm"] < 5
    assert all(
        one["translation_mm"] is None or one["translation_mm"] > 0 for one in found["methods"].values()
    )
    few = simulate(ErrorKind.PIXEL_ONLY, 1)
    with pytest.raises(InputError, match="7 usable views"):
        study_halves(few.with_views(few.views[:7]))


def test_scale_gives_the_same_answers_in_every_way() -> None:
    document = study_scale(trials=80, processes=2, cluster=False).to_dict()
    assert {name: way["trials"] for name, way in document["ways"].items()} == {
        "one_process": 40,
        "processes": 80,
    }
    assert set(document["ways"]) == {"one_process", "processes"}
    assert all(way["same_to_the_bit"] for way in document["ways"].values())
    assert document["resume"]["same_to_the_bit"] is True
    assert [part["trials"] for part in document["growth"]] == [10, 20, 40]
    with pytest.raises(InputError, match="10 trials"):
        study_scale(trials=10)


def test_table_1_is_taken_apart(data_folder: Path) -> None:
    recordings = load_sets(data_folder, ["CS_synthetic_1"])
    document = study_table1_parts(data_folder, recordings, trials=2).to_dict()
    assert set(document["rows"]) == {"printed", "opencv_corners", "our_corners", "default"}
    assert document["factor_of_corners"] > 2
    assert document["factor_of_camera"] > 2
    # Sets without truth are judged by views held out; any set will do.
    real = study_real_parts(data_folder, recordings, trials=1)["CS_synthetic_1"]
    assert set(real) == {"opencv_corners", "our_corners", "default"}
    for row in real.values():
        assert set(row) == {"next_best_view", "random", "max_distance", "halves"}
    assert real["default"]["halves"]["translation_mm"] < real["opencv_corners"]["halves"]["translation_mm"]
    titles = list(groups_of("sets", {**document, "real": {"CS_synthetic_1": real}}))
    assert titles == [*(f"Table I, {name}" for name in POLICIES), "CS_synthetic_1, views held out"]


def test_every_part_is_drawn_whatever_it_has_rows_of() -> None:
    row, nothing = {"translation_mm": 1.0, "rotation_deg": 0.1}, dict.fromkeys(ERRORS)
    cell = groups_of("cell", {arm: {"wrist": row, "wide": row} for arm in ("exact", "realistic")})
    assert {title: list(rows) for title, rows in cell.items()} == {
        "wrist camera": ["exact arm", "realistic arm"],
        "wide camera": ["exact arm", "realistic arm"],
    }
    tracks = groups_of("kinhec", {"tracks": {"pnp": {"solvers": {"shah": row, "handeye": nothing}}}})
    assert list(tracks) == ["KinHEC pnp"]
    for groups in (cell, tracks, groups_of("folder", {"name": "mine", "methods": {"shah": row}})):
        figure = draw_errors(groups)
        assert len(figure.axes) == 2 * len(groups)
        drawn = sum(len(axis.lines) for axis in figure.axes)
        assert drawn == 2 * sum(found is row for rows in groups.values() for found in rows.values())


def test_the_clock_of_a_sequence_is_found() -> None:
    random = np.random.default_rng(3)
    times = np.arange(0, 6, 0.02)
    phase = random.uniform(0, 6, 6)
    twists = np.array([0.2 * np.sin((0.5 + 0.3 * np.arange(6)) * t + phase) for t in times])
    flange = _core.se3_exp(twists * np.repeat([1.0, 3.0], 3))
    X, Y = _core.se3_exp(random.uniform(-0.5, 0.5, (2, 6)))
    seen = np.linalg.inv(flange @ X) @ Y
    seen[40] = np.nan  # not in sight
    camera = SimpleNamespace(t=times + 0.053, T_cam_target_meas=seen)
    robot = SimpleNamespace(t=times, T_base_ee_meas=flange)
    sequence = SimpleNamespace(camera=camera, robot=robot, eye_in_hand=True)
    assert clock_lag(kinhec.streams_of(sequence)) == pytest.approx(0.053, abs=2e-3)
