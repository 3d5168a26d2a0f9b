"""The same poses in the many ways in which people write them, and what they would have to say about each."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from handeye.datasets import Statement
from handeye.notations import NOTATIONS, Direction, Notation, Unit, pose_text
from handeye.types import Pose

Texts = Callable[[Sequence[str], Sequence[Pose]], str]


@dataclass(frozen=True)
class Way:
    """A way of writing poses: the end of the file's name, what to say, and the text."""

    name: str
    suffix: str
    stated: Statement
    text: Texts


def said(name: str, unit: Unit | None = None, direction: Direction | None = None) -> Statement:
    return Statement(NOTATIONS[name], unit, direction)


def numbers(pose: Pose, notation: Notation, unit: Unit | None, decimals: int = 6) -> list[float]:
    return [round(value, decimals) + 0.0 for value in notation.numbers(pose, unit)]


def table(
    name: str, unit: Unit, header: str = "", separator: str = ",", decimals: int = 6, comma: bool = False
) -> Texts:
    """A row for each pose, behind its picture."""

    def text(names: Sequence[str], poses: Sequence[Pose]) -> str:
        rows = [header] if header else []
        for picture, pose in zip(names, poses, strict=True):
            values = [f"{value:.{decimals}f}" for value in NOTATIONS[name].numbers(pose, unit)]
            row = separator.join([picture, *values])
            rows.append(row.replace(".", ",").replace(",png", ".png") if comma else row)
        return "\n".join(rows) + "\n"

    return text


def lines(name: str, unit: Unit | None = None, separator: str = " ") -> Texts:
    """One pose a line as the maker writes it, in the order of the pictures."""

    def text(names: Sequence[str], poses: Sequence[Pose]) -> str:
        return "\n".join(pose_text(pose, NOTATIONS[name], unit) for pose in poses)

    return text


def blocks(rows: int, decimals: int, *, by_columns: bool = False) -> Texts:
    """A matrix in lines of four numbers, an empty line between two."""

    def text(names: Sequence[str], poses: Sequence[Pose]) -> str:
        parts = []
        for pose in poses:
            matrix = (pose.matrix.T if by_columns else pose.matrix)[:rows]
            parts.append("\n".join("  ".join(f"{v: .{decimals}f}" for v in row) for row in matrix))
        return "\n\n".join(parts)

    return text


def as_json(make: Callable[[Pose], object]) -> Texts:
    def text(names: Sequence[str], poses: Sequence[Pose]) -> str:
        entries = [{"image": n, "pose": make(p)} for n, p in zip(names, poses, strict=True)]
        return json.dumps({"poses": entries})

    return text


def by_name(make: Callable[[Pose], object]) -> Texts:
    return lambda names, poses: json.dumps({n: make(p) for n, p in zip(names, poses, strict=True)})


def yaml_parts(names: Sequence[str], poses: Sequence[Pose]) -> str:
    out = []
    for name, pose in zip(names, poses, strict=True):
        (x, y, z), (qx, qy, qz, qw) = pose.translation, pose.quaternion_xyzw
        out.append(
            f"- image: {name}\n  position: {{x: {x:.7f}, y: {y:.7f}, z: {z:.7f}}}\n"
            f"  orientation: {{x: {qx:.8f}, y: {qy:.8f}, z: {qz:.8f}, w: {qw:.8f}}}\n"
        )
    return "".join(out)


def inverse(make: Texts) -> Texts:
    return lambda names, poses: make(names, [pose.inverse() for pose in poses])


def krl(names: Sequence[str], poses: Sequence[Pose]) -> str:
    rows = [
        f"DECL E6POS XP{k}={pose_text(pose, NOTATIONS['kuka'])[:-1]},S 6,T 27,E1 0.0,E2 0.0}}"
        for k, pose in enumerate(poses, start=1)
    ]
    return "\r\n".join(["DEFDAT cell", *rows, "ENDDAT"])


def teach_pendant(names: Sequence[str], poses: Sequence[Pose]) -> str:
    out = []
    for k, pose in enumerate(poses, start=1):
        x, y, z, w, p, r = NOTATIONS["fanuc"].numbers(pose)
        out.append(
            f"P[{k}]{{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\tX = {x:9.3f}  mm,\tY = {y:9.3f}  mm,\t"
            f"Z = {z:9.3f}  mm,\n\tW = {w:9.3f} deg,\tP = {p:9.3f} deg,\tR = {r:9.3f} deg\n}};"
        )
    return "\n".join(out)


def robtargets(names: Sequence[str], poses: Sequence[Pose]) -> str:
    return "\n".join(
        f"CONST robtarget p{k}0:={pose_text(pose, NOTATIONS['abb'])[:-1]},[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];"
        for k, pose in enumerate(poses, start=1)
    )


def tum(names: Sequence[str], poses: Sequence[Pose]) -> str:
    rows = ["# timestamp tx ty tz qx qy qz qw"]
    for k, pose in enumerate(poses):
        values = NOTATIONS["tum"].numbers(pose)[1:]
        rows.append(" ".join([f"{1.7e9 + 0.37 * k:.3f}", *(f"{v:.7f}" for v in values)]))
    return "\n".join(rows)


MM, M = Unit.MM, Unit.M
KUKA_HEAD, UR_HEAD = "image,X,Y,Z,A,B,C", "image,X,Y,Z,RX,RY,RZ"
WAYS: tuple[Way, ...] = (
    Way("ur in mm with a header", ".csv", said("ur", MM), table("ur", MM, UR_HEAD, decimals=4)),
    Way("ur in m", ".csv", said("ur", M), table("ur", M)),
    Way("ur as p[...]", ".txt", said("ur", M), lines("ur")),
    Way("kuka with a header", ".csv", said("kuka"), table("kuka", MM, KUKA_HEAD, decimals=2)),
    Way("kuka in braces", ".txt", said("kuka"), lines("kuka")),
    Way("kuka as KRL", ".dat", said("kuka"), krl),
    Way("fanuc", ".txt", said("fanuc"), lines("fanuc")),
    Way("fanuc's listing", ".txt", said("fanuc"), teach_pendant),
    Way("abb", ".txt", said("abb"), lines("abb")),
    Way("abb's robtargets", ".txt", said("abb"), robtargets),
    Way("epson", ".txt", said("epson"), lines("epson")),
    Way("doosan", ".csv", said("doosan"), table("doosan", MM, KUKA_HEAD, decimals=3)),
    Way("staubli", ".csv", said("staubli"), table("staubli", MM, decimals=3)),
    Way("yaskawa", ".txt", said("yaskawa"), lines("yaskawa")),
    Way("mitsubishi", ".csv", said("mitsubishi"), table("mitsubishi", MM, KUKA_HEAD, decimals=3)),
    Way("nachi", ".csv", said("nachi"), table("nachi", MM, "name,X,Y,Z,r,p,y")),
    Way("denso", ".csv", said("denso"), table("denso", MM, UR_HEAD)),
    Way("xarm", ".json", said("xarm"), as_json(lambda p: numbers(p, NOTATIONS["xarm"], MM))),
    Way("kawasaki", ".csv", said("kawasaki"), table("kawasaki", MM, "image;X;Y;Z;O;A;T", ";", comma=True)),
    Way("franka", ".json", said("franka"), as_json(lambda p: numbers(p, NOTATIONS["franka"], M))),
    Way("tum", ".txt", said("tum"), tum),
    Way("quaternion, real part last", ".csv", said("quaternion_xyzw", M), table("quaternion_xyzw", M)),
    Way("quaternion, real part first", ".csv", said("quaternion_wxyz", MM), table("quaternion_wxyz", MM)),
    Way(
        "named quaternion",
        ".csv",
        said("quaternion_xyzw", M),
        table("quaternion_wxyz", M, "image,x,y,z,qw,qx,qy,qz"),
    ),
    Way("quaternion in parts", ".yaml", said("quaternion_xyzw", M), yaml_parts),
    Way("quaternion first", ".csv", said("wxyz_position", M), table("wxyz_position", M)),
    Way("rotation vector in degrees", ".csv", said("rotation_vector_deg", MM), table("rotation_vector_deg", MM)),
    Way("matrices by rows", ".csv", said("matrix", M), table("matrix", M)),
    Way("matrices of four decimals", ".csv", said("matrix", M), table("matrix", M, decimals=4)),
    Way("matrices by columns", ".csv", said("matrix_columns", MM), table("matrix_columns", MM)),
    Way("blocks of 4 x 4", ".txt", said("matrix", M), blocks(4, 6)),
    Way("blocks of 3 x 4", ".txt", said("matrix", M), blocks(3, 5)),
    Way("blocks by columns", ".txt", said("matrix_columns", M), blocks(4, 6, by_columns=True)),
    Way("nested lists", ".json", said("matrix", M), by_name(lambda p: p.to_list())),
    Way("rotation, then position", ".csv", said("rotation_position", M), table("rotation_position", M)),
    Way("roll, pitch, yaw in radians", ".csv", said("euler_xyz_fixed_rad", M), table("euler_xyz_fixed_rad", M)),
    Way("zxz moving", ".csv", said("euler_zxz_moving_deg", MM), table("euler_zxz_moving_deg", MM)),
    Way("yxz fixed", ".csv", said("euler_yxz_fixed_deg", MM), table("euler_yxz_fixed_deg", MM)),
    Way("tabs and decimal commas", ".txt", said("kuka"), table("kuka", MM, KUKA_HEAD.replace(",", "\t"), "\t", comma=True)),
    Way(
        "base in flange",
        ".csv",
        said("quaternion_xyzw", M, Direction.BASE_IN_FLANGE),
        inverse(table("quaternion_xyzw", M)),
    ),
)  # fmt: skip


def some_poses(count: int, seed: int) -> list[Pose]:
    """Poses of a flange above a table, looking down, turned about all axes."""
    rng = np.random.default_rng(seed)
    down = Pose.exp([0, 0, 0, np.pi, 0, 0])
    poses = []
    for _ in range(count):
        there = Pose.exp([*rng.uniform([0.3, -0.3, 0.3], [0.7, 0.3, 0.7]), 0, 0, 0])
        turn = Pose.exp([0, 0, 0, *rng.uniform(-0.5, 0.5, 2), rng.uniform(-1.5, 1.5)])
        poses.append(there @ down @ turn)
    return poses
