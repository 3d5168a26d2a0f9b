"""Wordings that several commands share: transforms, lengths and accuracies for a person."""

from collections.abc import Iterable, Sequence

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from handeye.importing import Opened
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Unobservable
from handeye.types.units import MM_PER_M

MOUNTINGS = {Mounting.EYE_IN_HAND: "camera in the hand", Mounting.EYE_TO_HAND: "camera beside the robot"}


def pose_lines(pose: Pose) -> list[tuple[str, str]]:
    """Return the lines that describe a pose: position, quaternion, angles."""
    x, y, z = pose.translation * MM_PER_M
    quaternion = "  ".join(f"{value:9.6f}" for value in pose.quaternion_xyzw)
    roll, pitch, yaw = np.rad2deg(pose.roll_pitch_yaw_rad)
    return [
        ("x y z", f"{x:9.3f}  {y:9.3f}  {z:9.3f}  mm"),
        ("qx qy qz qw", f"{quaternion}"),
        ("roll pitch yaw", f"{roll:9.4f}  {pitch:9.4f}  {yaw:9.4f}  deg"),
    ]


def length_mm(metres: float) -> str:
    """Return a length in millimetres with three digits that count."""
    return f"{figures(metres * MM_PER_M)} mm"


def angle_deg(radians: float) -> str:
    """Return an angle in degrees with two digits that count."""
    return f"{figures(float(np.rad2deg(radians)), 2)} deg"


def figures(value: float, digits: int = 3) -> str:
    """Return a number with so many digits that count, without an exponent where that can be read."""
    if value == 0 or not np.isfinite(value) or not 1e-6 <= abs(value) < 1e6:
        return f"{value:.{digits}g}"
    decimals = max(digits - 1 - int(np.floor(np.log10(abs(value)))), 0)
    return f"{value:.{decimals}f}"


def both(translation_m: float, rotation_rad: float) -> str:
    """Return a pair of accuracies: 0.42 mm and 0.034 deg."""
    return f"{length_mm(translation_m)} and {angle_deg(rotation_rad)}"


def deviations_in(rotation: FloatArray, covariance: FloatArray) -> FloatArray:
    """(3,) standard deviations of a translation along the axes of the frame that `rotation` turns it to."""
    return np.sqrt(np.diag(rotation @ covariance[:3, :3] @ rotation.T))


def pairs(console: Console, rows: Iterable[tuple[str, str]], indent: int = 0) -> None:
    """Print names and values in two columns."""
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column()
    for name, value in rows:
        grid.add_row(" " * indent + name, Text(value))
    console.print(grid)


def heading(console: Console, text: str, note: str = "") -> None:
    """Print what follows is about."""
    line = Text(text, style="bold")
    if note:
        line.append(f"  {note}", style="not bold dim")
    console.print(line)


def notices(console: Console, title: str, lines: Iterable[str], style: str = "yellow") -> None:
    """Print a list of remarks under a title, nothing if there are none."""
    remarks = list(lines)
    if not remarks:
        return
    console.print(Text(title, style=f"bold {style}"))
    for remark in remarks:
        grid = Table.grid(padding=(0, 1))
        grid.add_row(" -", Text(remark))
        console.print(grid)


def open_directions(console: Console, unobservable: Sequence[Unobservable]) -> None:
    """Print what the views leave open, and what would cure it."""
    sentences = [*dict.fromkeys(direction.sentence for direction in unobservable)]
    cures = [f"cure: {cure}" for cure in dict.fromkeys(direction.cure for direction in unobservable)]
    notices(console, "Not determined by these views", [*sentences, *cures], "red")


def camera_line(opened: Opened) -> str:
    """Return one line about the camera and where it came from."""
    camera = opened.recording.camera
    origin = {
        "given": "as given",
        "files": "from the files",
        "calibrated": "calibrated from these images",
    }[opened.camera_origin]
    fx, fy = camera.parameters[:2]
    size = f"{camera.width_px} x {camera.height_px} px"
    return f"{camera.lens}, f {fx:.1f} and {fy:.1f} px, {size}, {origin}"
