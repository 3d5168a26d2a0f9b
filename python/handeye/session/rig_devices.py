"""A real rig that follows from what was asked for: its drivers, and where its arm stands."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace

from handeye.cameras.protocol import ImageSource
from handeye.cameras.several import SeveralCameras
from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots.protocol import Goal
from handeye.session.attempt import Eye
from handeye.session.calls import Calls
from handeye.session.closing import close
from handeye.session.drivers import Person, open_camera
from handeye.session.observer import Observer
from handeye.session.opening import NOBODY, described, opened_robot, real_cell, standing
from handeye.session.rig_prepared import RigPrepared
from handeye.session.settings import Configuration, RigSettings
from handeye.session.starting import Start
from handeye.types import Body, RigRecording


def prepare_rig(
    configuration: Configuration,
    recording: RigRecording,
    *,
    person: Person | None = None,
    confirm: Callable[[Goal], bool] | None = None,
    start: Start | None = None,
    observer: Observer | None = None,
) -> RigPrepared:
    """Open the drivers of an arm and of several cameras, and see where the arm stands; nothing moves.

    Parameters
    ----------
    configuration
        What is asked for; its `rig` names the driver of each camera.
    recording
        Cameras and targets, without a station.
    person, confirm, start, observer
        As for `handeye.session.configuration.prepare`.

    Raises
    ------
    InputError
        Something is missing or unknown.
    DeviceError
        A driver fails.
    """
    configuration.wish()  # refused now rather than once the arm has moved
    arm, solids, configuration = described(configuration)
    configuration.workspace()  # must be stated
    person = person or NOBODY
    robot_calls, camera_calls = Calls("robot"), Calls("camera")
    recording, images = _taking_part(configuration, recording)
    with ExitStack() as failed:
        arm, robot = opened_robot(configuration, arm, person, robot_calls, start, failed)
        sources: dict[str, ImageSource] = {}
        for name, spec in images.items():
            sources[name] = open_camera(spec, robot, person, configuration.timeouts.grab_s)
            failed.callback(close, camera_calls, sources[name])
        pairs = [
            (name, target)
            for name, camera in recording.cameras.items()
            for target, board in recording.targets.items()
            # What hangs on the flange beside a camera does not come before it.
            if not (camera.body is Body.FLANGE and board.body is Body.FLANGE)
        ]
        looks = {name: sum(1 for camera, _ in pairs if camera == name) for name in images}
        together = SeveralCameras(sources).eyes(looks)
        eyes = [
            Eye(
                (name, target),
                together[name],
                recording.cameras[name].camera,
                recording.targets[target].target,
                recording.moves(name, target),
            )
            for name, target in pairs
        ]
        cell = real_cell(configuration, arm, solids, robot, eyes[0], confirm)
        cell = replace(
            cell,
            observer=observer or Observer(),
            several=tuple(eyes),
            robot_calls=robot_calls,
            camera_calls=camera_calls,
        )
        if start is None:
            start = standing(cell, arm)
        failed.pop_all()
    return RigPrepared(configuration, cell, start, recording)


def _taking_part(
    configuration: Configuration, recording: RigRecording
) -> tuple[RigRecording, dict[str, str]]:
    """Return the rig as far as it takes part, and the drivers of its cameras.

    Raises
    ------
    InputError
        A camera that is not there or has no driver, or one that can see no target.
    """
    asked = configuration.rig or RigSettings()
    names = recording.cameras if asked.cameras is None else asked.cameras
    images = asked.images or {}
    for name in names:
        if name not in recording.cameras or name not in images:
            raise InputError(
                f"no camera {name[:60]!r} with a driver, expected some of {', '.join(images)}",
                code=Code.UNKNOWN_CAMERA,
            )
    cameras = {name: one for name, one in recording.cameras.items() if name in names}
    on_base = any(one.body is Body.BASE for one in recording.targets.values())
    blind = [name for name, one in cameras.items() if one.body is Body.FLANGE and not on_base]
    if blind:
        raise InputError(
            f"no target for camera {', '.join(blind)}: cameras and targets all hang on the flange",
            code=Code.NOT_TIED,
            hint='put a target beside the arm: on = "base"',
        )
    return replace(recording, cameras=cameras), {name: images[name] for name in cameras}
