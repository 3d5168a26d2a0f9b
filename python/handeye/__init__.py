"""Hand-eye calibration: which view to take next, when to stop, and how far its answer can be trusted.

>>> import handeye
>>> opened = handeye.open_folder("my_folder")            # pictures and poses, or a recording
>>> calibration = handeye.solve(opened.recording)
>>> calibration.results["T_flange_camera"]

From views to an answer: `open_folder` (with `SourceOptions` for what the files leave open) reads pictures
and poses into a `Recording` of `View`s with a `Camera` and a `Target`; `handeye.solve` finds the answer, and
`plan` which view to take next; `open_rig` and `solve_rig` do the same for several cameras and boards at once.
`detect` finds a target in one picture. `read_recording`, `write_recording`, `read_camera` and `read_target`
are for files of ours and others; a `Pose` is a transform, `Mounting` says where the camera sits, and
everything that goes wrong is a `HandeyeError` with a code and a hint.

The rooms below have more: `handeye.estimation`, `handeye.planning`, `handeye.session` (driving an arm),
`handeye.export`, `handeye.testing`. On the command line: `handeye --help`; in the browser: `handeye ui`.

What is named here is imported when it is first used, so `import handeye` itself costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from handeye.datasets import read_camera, read_recording, read_target, write_recording
    from handeye.detection import detect
    from handeye.errors import HandeyeError
    from handeye.estimation import solve, solve_rig
    from handeye.importing import SourceOptions, open_folder, open_rig
    from handeye.planning import plan
    from handeye.types import Camera, Mounting, Pose, Recording, Target, View

    __version__: str

_PLACES = {
    "Camera": "types",
    "HandeyeError": "errors",
    "Mounting": "types",
    "Pose": "types",
    "Recording": "types",
    "SourceOptions": "importing",
    "Target": "types",
    "View": "types",
    "detect": "detection",
    "open_folder": "importing",
    "open_rig": "importing",
    "plan": "planning",
    "read_camera": "datasets",
    "read_recording": "datasets",
    "read_target": "datasets",
    "solve": "estimation",
    "solve_rig": "estimation",
    "write_recording": "datasets",
}

__all__ = [
    "Camera",
    "HandeyeError",
    "Mounting",
    "Pose",
    "Recording",
    "SourceOptions",
    "Target",
    "View",
    "__version__",
    "detect",
    "open_folder",
    "open_rig",
    "plan",
    "read_camera",
    "read_recording",
    "read_target",
    "solve",
    "solve_rig",
    "write_recording",
]


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version  # noqa: PLC0415 - rarely asked for

        value: object = version("handeye")
    elif name in _PLACES:
        value = getattr(import_module(f"handeye.{_PLACES[name]}"), name)
    else:
        raise AttributeError(f"module 'handeye' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
