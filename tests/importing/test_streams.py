"""Two streams of poses with times, in the files of others: matched, clocks set, and solved."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cells import random_pose
from commands import Handeye
from handeye.datasets import PosePairs
from handeye.errors import InputError
from handeye.importing import SourceOptions, open_any, solve_poses
from handeye.types import Mounting, Pose

X, Y = Pose.exp([0.03, -0.06, 0.09, 0.1, 0.2, 1.5]), Pose.exp([0.6, -0.2, 0.03, 3.0, 0.1, 0.2])
Streams = tuple[list[float], list[Pose], list[float], list[Pose]]


def moving(lag_s: float = 0.0, mounting: Mounting = Mounting.EYE_IN_HAND, seed: int = 1) -> Streams:
    """A hand that swings about its axes for twelve seconds; the camera is slower, and its clock is off."""
    random = np.random.default_rng(seed)
    home = random_pose(random, 0.5, 2)
    size = np.array([0.1, 0.1, 0.1, 0.4, 0.4, 0.6])
    rate, phase = random.uniform(0.5, 1.5, 6), random.uniform(0, 6, 6)

    def pose(time: float) -> Pose:
        return home @ Pose.exp(size * np.sin(rate * time + phase))

    times, seen_at = np.arange(0, 12, 0.02).tolist(), np.arange(1.5, 10.5, 0.1).tolist()
    seen = [
        Pose.exp(random.normal(size=6) * 2e-4) @ X @ mounting.chain(pose(t)) @ Y for t in seen_at
    ]  # fmt: skip
    return times, [pose(t) for t in times], [t + lag_s for t in seen_at], seen


def line(time: float, pose: Pose, separator: str) -> str:
    return separator.join(f"{v:.9f}" for v in [time, *pose.translation, *pose.quaternion_xyzw])


def ethz(folder: Path, streams: Streams) -> None:
    """As `numpy.savetxt` of csv_io.py writes it: a comma and a space."""
    times, poses, seen_at, seen = streams
    (folder / "poses_B_H.csv").write_text(
        "\n".join(line(t, p, ", ") for t, p in zip(times, poses, strict=True))
    )
    rows = (line(t, p.inverse(), ", ") for t, p in zip(seen_at, seen, strict=True))
    (folder / "poses_W_E.csv").write_text("\n".join(rows))


def tum(folder: Path, streams: Streams, *, turned: bool = False) -> None:
    """As `to_tum` of kinhec writes it."""
    times, poses, seen_at, seen = streams
    head = "# timestamp tx ty tz qx qy qz qw\n"
    rows = "\n".join(line(t, p, " ") for t, p in zip(times, poses, strict=True))
    (folder / "x-0_robot.tum").write_text(head + rows)
    rows = "\n".join(line(t, p.inverse() if turned else p, " ") for t, p in zip(seen_at, seen, strict=True))
    (folder / "x-0_camera.tum").write_text(head + rows)


def kinhec(folder: Path, streams: Streams, configuration: str = "eye_in_hand") -> None:
    """As `to_csv` of kinhec writes it, by pandas: NaN is empty, quaternions have the real part first."""
    times, poses, seen_at, seen = streams
    part = ("px", "py", "pz", "qw", "qx", "qy", "qz")

    def numbers(pose: Pose) -> list[str]:
        x, y, z, w = pose.quaternion_xyzw
        return [repr(float(v)) for v in [*pose.translation, w, x, y, z]]

    head = ["t", "q1_meas", "q1_gt", *(f"base_ee_{kind}_{c}" for kind in ("gt", "meas") for c in part)]
    rows = [
        [repr(t), "0.1", "0.1", *numbers(Pose.identity()), *numbers(p)]
        for t, p in zip(times, poses, strict=True)
    ]
    (folder / "x-0_robot.csv").write_text("\n".join(",".join(row) for row in [head, *rows]))
    head = [
        "t",
        "t_gt",
        *(f"{kind}_{c}" for kind in ("base_ee_gt", "cam_target_gt", "cam_target_meas") for c in part),
    ]
    head += ["visible", "outlier", "n_points", "depth_m", "view_angle_deg", "reproj_rmse_px"]
    rows = []
    for k, (t, p) in enumerate(zip(seen_at, seen, strict=True)):
        found = [""] * 7 if k % 10 == 3 else numbers(p)
        rows.append(
            [
                repr(t),
                repr(t),
                *numbers(Pose.identity()) * 2,
                *found,
                str(k % 10 != 3),
                "False",
                "88",
                "0.6",
                "3",
                "",
            ]
        )
    (folder / "x-0_camera.csv").write_text("\n".join(",".join(row) for row in [head, *rows]))
    (folder / "x-0_groundtruth.json").write_text(json.dumps({"configuration": configuration}))


WRITERS: dict[str, Callable[[Path, Streams], None]] = {"ethz": ethz, "tum": tum, "kinhec": kinhec}


def pairs(folder: Path, mounting: Mounting | None = Mounting.EYE_IN_HAND) -> PosePairs:
    found = open_any(folder, SourceOptions(mounting=mounting))
    assert isinstance(found, PosePairs)
    return found


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("lag_s", [0.0, 0.083, -0.4])
def test_streams_are_matched_and_solved(name: str, lag_s: float, tmp_path: Path) -> None:
    WRITERS[name](tmp_path, moving(lag_s))
    found = pairs(tmp_path)
    assert found.layout == name
    said = [warning.message for warning in found.warnings if warning.code == "lag"]
    if lag_s:
        (message,) = said
        assert float(message.split("stamped ")[1].split(" ms")[0]) == pytest.approx(1e3 * abs(lag_s), abs=3)
        assert ("later" in message) == (lag_s > 0)
    solved = solve_poses(found)
    off = 1e3 * float(np.linalg.norm((X @ solved.X.inverse()).log()[:3]))
    assert off < min(2.0, solved.within_95.translation_mm)


def test_the_camera_in_the_target_is_turned_round(tmp_path: Path) -> None:
    tum(tmp_path, moving(), turned=True)
    found = pairs(tmp_path)
    assert [warning.code for warning in found.warnings] == ["poses_inverted"]
    assert np.linalg.norm((X @ solve_poses(found).X.inverse()).log()[:3]) < 2e-3


def test_kinhec_says_where_the_camera_sits(tmp_path: Path) -> None:
    kinhec(tmp_path, moving(mounting=Mounting.EYE_TO_HAND), "eye_to_hand")
    assert pairs(tmp_path, None).mounting is Mounting.EYE_TO_HAND
    (tmp_path / "x-0_groundtruth.json").write_text("[" * 100_000)
    with pytest.raises(InputError, match="do not say where the camera sits"):
        pairs(tmp_path, None)


def test_one_command(tmp_path: Path, handeye: Handeye) -> None:
    ethz(tmp_path, moving(0.05))
    answer = handeye.json("solve", tmp_path, "--mounting", "eye_in_hand")
    assert np.abs(np.array(answer["T_flange_camera"]) - X.inverse().matrix).max() < 2e-3


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda s: s.replace("\n", ",\n", 1), "line 1: 9 values, expected 8"),
        (lambda s: s.replace("0.", "0x", 1), "line 1"),
        (lambda s: "9" * 100_000 + s, "line 1"),
        (lambda s: "# nothing\n", "no poses in it"),
        (lambda s: "\n".join(["0,0,0,0,0,0,0,0"] * 5), "fewer than two poses"),
        (lambda s: s + "\n1e309, 0,0,0,0,0,0,1", "expected a finite number"),
        (lambda s: "\n".join(r if k % 3 else r.split(",")[0] + ", 0, 0, 0, 0, 0, 0, 7" for k, r in enumerate(s.splitlines())), None),
    ],
)  # fmt: skip
def test_damaged_files_are_named(change: Callable[[str], str], match: str | None, tmp_path: Path) -> None:
    ethz(tmp_path, moving())
    path = tmp_path / "poses_B_H.csv"
    path.write_text(change(path.read_text()))
    if match is None:  # quaternions that are none are left out
        assert len(pairs(tmp_path)) > 40
        return
    with pytest.raises(InputError, match=match):
        pairs(tmp_path)


def test_streams_of_different_days(tmp_path: Path) -> None:
    times, poses, seen_at, seen = moving()
    ethz(tmp_path, (times, poses, [t + 1e6 for t in seen_at], seen))
    with pytest.raises(InputError, match="0 poses of the target while the robot's are known"):
        pairs(tmp_path)


def certifiable(folder: Path, poses: list[tuple[Pose, Pose]], tag: int = 0) -> None:
    for part, index in (("A", 0), ("B", 1)):
        rows = []
        for pair in poses:
            x, y, z, w = pair[index].quaternion_xyzw
            rows.append(",".join(repr(float(v)) for v in [w, x, y, z, *pair[index].translation]))
        (folder / f"tag_{tag}_cam_2_{part}.csv").write_text("\n".join(rows) + "\n")


@pytest.mark.parametrize("mounting", Mounting)
def test_certifiable_pairs(mounting: Mounting, tmp_path: Path) -> None:
    _, poses, _, _ = moving()
    chosen = poses[::40]
    seen = [(pose, X @ mounting.chain(pose) @ Y) for pose in chosen]
    hand = [(a if mounting is Mounting.EYE_TO_HAND else a.inverse(), b) for a, b in seen]
    certifiable(tmp_path, hand)
    found = pairs(tmp_path, None if mounting is Mounting.EYE_TO_HAND else mounting)
    assert np.allclose(found.motions, [mounting.chain(pose).matrix for pose in chosen], atol=1e-9)
    assert np.linalg.norm((X @ solve_poses(found).X.inverse()).log()[:3]) < 1e-4
    certifiable(tmp_path, hand, tag=1)
    with pytest.raises(InputError, match="tag_0_cam_2, tag_1_cam_2, expected one tag"):
        pairs(tmp_path)
    assert len(pairs(tmp_path / "tag_1_cam_2_A.csv")) == len(hand)
    (tmp_path / "tag_1_cam_2_B.csv").write_text("1,0,0,0,0,0\n")
    with pytest.raises(InputError, match="line 1"):
        pairs(tmp_path / "tag_1_cam_2_A.csv")


@pytest.mark.parametrize("spoil", [lambda lines: lines[:1], lambda lines: ["s" + lines[0][1:], *lines[1:]]])
def test_a_table_without_rows_or_times(spoil: Callable[[list[str]], list[str]], tmp_path: Path) -> None:
    kinhec(tmp_path, moving())
    for name in ("x-0_camera.csv", "x-0_robot.csv"):
        whole = (tmp_path / name).read_text()
        (tmp_path / name).write_text("\n".join(spoil(whole.splitlines())))
        with pytest.raises(InputError, match=f"{name}: no (poses in it|column t)"):
            pairs(tmp_path)
        (tmp_path / name).write_text(whole)
