"""Reading a transform back from the files that are exported, and from those of the tools that write them too.

A written transform counts once it was read back and compared: `checked_text`. `read_transform` tells the
format by what is in the file. Comments are skipped before anything is looked for, so nothing in them can be
taken for a number.
"""

import json
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from handeye.codes import Code
from handeye.datasets.documents import yaml_of
from handeye.datasets.easy_handeye2 import Transform as RosTransform
from handeye.datasets.reading import MIB, located, number, read_text
from handeye.errors import InputError, OutputError
from handeye.export.base import Exporter, rotation_of
from handeye.export.mount import Mount
from handeye.types import Pose
from handeye.types.plain import read_document

MAX_BYTES = MIB
# What is read back may differ by no more: metres, and entries of the rotation.
TOLERANCE = 1e-9
_XML_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_NUMBERS = ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")
_FRAMES = ("--frame-id", "--child-frame-id")


@dataclass(frozen=True)
class Transform:
    """A transform between two named frames: coordinates in the child to coordinates in the parent.

    Examples
    --------
    >>> from handeye.types import Pose
    >>> Transform("tool0", "camera", Pose.identity()).child
    'camera'
    """

    parent: str
    child: str
    T_parent_child: Pose


def read_transform(path: str | os.PathLike[str]) -> Transform:
    """Read a transform from a file in any format of `EXPORTERS`, or of easy_handeye for ROS 1.

    Raises
    ------
    InputError
        None of these formats, or numbers that are no rigid transform.

    Examples
    --------
    >>> _ = Path("camera.urdf").write_text(checked_text(EXPORTERS["urdf"], Mount(result, Frames("tool0"))))
    >>> read_transform("camera.urdf").parent
    'tool0'
    """
    file = Path(path)
    with located(str(file)):
        return transform_of(read_text(file, MAX_BYTES))


def transform_of(text: str) -> Transform:
    """Return the transform that a text holds.

    Raises
    ------
    InputError
        As `read_transform`.
    """
    for read in _READERS:
        found = read(text)
        if found is not None:
            return found
    raise InputError(
        "no transform in it, expected what handeye export writes: static_transform_publisher, a URDF joint, "
        "a launch file, easy_handeye, FileStorage or JSON",
        code=Code.UNKNOWN_FORMAT,
    )


def checked_text(exporter: Exporter, mount: Mount) -> str:
    """Return the text of an exporter after it was read back and compared.

    Parameters
    ----------
    exporter
        One of `EXPORTERS`.
    mount
        The answer, in named frames.

    Raises
    ------
    OutputError
        It does not read back to the same transform; that would be a mistake in handeye.

    Examples
    --------
    >>> checked_text(EXPORTERS["urdf"], Mount(result, Frames("tool0"))).count("<origin")
    1
    """
    text = exporter.text(mount)
    try:
        back = transform_of(text)
    except InputError as error:
        raise OutputError(f"{exporter.name}: not read back: {error.message}", code=Code.NOT_EXACT) from error
    deviation = float(np.abs(back.T_parent_child.matrix - mount.T_parent_child.matrix).max())
    if (back.parent, back.child) != (mount.parent, mount.child) or not deviation <= TOLERANCE:
        raise OutputError(
            f"{exporter.name}: read back as {back.parent} -> {back.child}, {deviation:.1e} off",
            code=Code.NOT_EXACT,
        )
    return text


def _command(text: str) -> Transform | None:
    """Read `static_transform_publisher` of ROS 2: a command line, or a launch file in Python."""
    body = "\n".join(line for line in text.splitlines() if not line.lstrip().startswith("#"))
    if "static_transform_publisher" not in body or _FRAMES[1] not in body:
        return None
    words = re.sub(r"[\"',\\\[\]()]", " ", body).split()
    values = {name: words[i + 1] for i, name in enumerate(words[:-1]) if name in {*_NUMBERS, *_FRAMES}}
    return _quaternion([values.get(name, "") for name in _NUMBERS], *(values.get(n, "") for n in _FRAMES))


def _node(text: str) -> Transform | None:
    """Read a node of a ROS 1 launch file: `args` with x y z qx qy qz qw parent child."""
    body = _XML_COMMENT.sub(" ", text)
    if "static_transform_publisher" not in body:
        return None
    match = re.search(r'\bargs="([^"<>]*)"', body)
    words = match.group(1).split() if match else []
    if len(words) != 9:
        raise InputError(f"args of {len(words)} words, expected 9", code=Code.WRONG_SHAPE)
    return _quaternion(words[:7], words[7], words[8])


def _joint(text: str) -> Transform | None:
    """Read the first fixed joint of a URDF."""
    body = _XML_COMMENT.sub(" ", text)
    if not re.search(r'<joint\b[^<>]*\btype="fixed"', body):
        return None
    parts = {
        name: re.search(rf'<{tag}\b[^<>]*\b{attribute}="([^"<>]*)"', body)
        for name, tag, attribute in (
            ("parent", "parent", "link"),
            ("child", "child", "link"),
            ("xyz", "origin", "xyz"),
            ("rpy", "origin", "rpy"),
        )
    }
    found = {name: match.group(1) for name, match in parts.items() if match}
    if len(found) < len(parts):
        raise InputError("a joint without parent, child or origin", code=Code.INVALID_FIELD)
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_of(np.array(_three(found["rpy"], "rpy")))
    matrix[:3, 3] = _three(found["xyz"], "xyz")
    return Transform(found["parent"], found["child"], Pose(matrix))


def _document(text: str) -> Transform | None:
    """Read easy_handeye of both ROS versions, FileStorage, and our JSON."""
    if text.lstrip().startswith("{"):
        try:
            document = cast("object", json.loads(text))
        except (ValueError, RecursionError):
            return None
    else:
        try:
            document = yaml_of(text, "the file")
        except InputError:
            return None
    if not isinstance(document, Mapping):
        return None
    table = cast("Mapping[str, object]", document)
    readers = (("quaternion_xyzw", _json), ("transform", _easy2), ("transformation", _easy1))
    for key, read in readers:
        if key in table:
            return read(table)
    return _storage(table) if {"parent_frame", "child_frame"} <= set(table) else None


def _json(table: Mapping[str, object]) -> Transform:
    values = [*cast("list[object]", table["translation_m"]), *cast("list[object]", table["quaternion_xyzw"])]
    return _quaternion([repr(v) for v in values], str(table["parent_frame"]), str(table["child_frame"]))


def _easy2(table: Mapping[str, object]) -> Transform:
    pose = read_document(table["transform"], RosTransform, "transform", lax=True).pose
    given = read_document(table.get("parameters"), dict[str, str], "parameters", lax=True)
    in_hand = given.get("calibration_type") == "eye_in_hand"
    parent = given.get("robot_effector_frame" if in_hand else "robot_base_frame", "")
    return Transform(parent, given.get("tracking_base_frame", ""), pose)


def _easy1(table: Mapping[str, object]) -> Transform:
    """Read `~/.ros/easy_handeye/NAME.yaml` (easy_handeye, `handeye_calibration.py`)."""
    values = read_document(table["transformation"], dict[str, str], "transformation", lax=True)
    given = read_document(table.get("parameters"), dict[str, str], "parameters", lax=True)
    in_hand = given.get("eye_on_hand", "").lower() == "true"
    parent = given.get("robot_effector_frame" if in_hand else "robot_base_frame", "")
    names = [name.removeprefix("--") for name in _NUMBERS]
    return _quaternion([values.get(n, "") for n in names], parent, given.get("tracking_base_frame", ""))


def _storage(table: Mapping[str, object]) -> Transform | None:
    name = next((k for k in table if re.fullmatch(r"T_(flange|base)_camera\w*", k)), None)
    matrix = table.get(name) if name else None
    if not isinstance(matrix, Mapping):
        return None
    data = cast("Mapping[str, object]", matrix).get("data")
    words = cast("list[object]", data) if isinstance(data, list) else []
    if len(words) != 16:
        raise InputError(f"{name}: {len(words)} numbers, expected 16", code=Code.WRONG_SHAPE)
    values = np.array([number(str(word), str(name)) for word in words]).reshape(4, 4)
    return Transform(str(table["parent_frame"]), str(table["child_frame"]), Pose(values))


def _quaternion(words: list[str], parent: str, child: str) -> Transform:
    values = [number(word, "the transform") for word in words]
    return Transform(parent, child, Pose.from_quaternion(values[:3], values[3:]))


def _three(text: str, what: str) -> list[float]:
    words = text.split()
    if len(words) != 3:
        raise InputError(f"{what}: {len(words)} numbers, expected 3", code=Code.WRONG_SHAPE)
    return [number(word, what) for word in words]


# Documents first: their strings may hold anything, also what looks like a command.
_READERS: tuple[Callable[[str], Transform | None], ...] = (_document, _command, _node, _joint)
