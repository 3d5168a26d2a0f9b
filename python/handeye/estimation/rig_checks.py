"""What is asked of a rig before it is estimated: whether all is tied to the arm, and mistakes in views."""

from handeye.codes import Code
from handeye.errors import HandeyeError, InputError
from handeye.estimation.faults import Examination, examine
from handeye.estimation.rig_measurements import Pair, RigMeasurements
from handeye.types.rig import Body

FEWEST_STATIONS = 3


def check_tied(measurements: RigMeasurements) -> None:
    """Raise where a camera or target is not tied to the arm by what was seen.

    Raises
    ------
    InputError
        The message names it, and what would tie it.
    """
    if len(measurements.stations) < FEWEST_STATIONS:
        rejected = "".join(
            f"; {camera}, {name}: {why}"
            for (camera, _), measured in measurements.pairs.items()
            for name, why in measured.rejected.items()
        )
        raise InputError(
            f"{len(measurements.stations)} usable stations, at least {FEWEST_STATIONS} are needed{rejected}",
            code=Code.TOO_FEW_VIEWS,
            hint="take more stations, with the flange turned about at least two axes between them",
        )
    known: set[tuple[str, str]] = set()
    for (camera, target), measured in measurements.pairs.items():
        if measurements.moves(camera, target) and len(measured) >= FEWEST_STATIONS:
            known |= {("camera", camera), ("target", target)}
    for _ in measurements.pairs:
        for (camera, target), measured in measurements.pairs.items():
            ends = {("camera", camera), ("target", target)}
            if len(measured) and ends & known:
                known |= ends
    for camera in measurements.cameras:
        if ("camera", camera) not in known:
            other = Body.BASE if measurements.cameras[camera].body is Body.FLANGE else Body.FLANGE
            raise InputError(
                f"camera {camera}: nothing ties it to the arm or to another camera",
                code=Code.NOT_TIED,
                hint=f"let it see a target on the {other.value} at {FEWEST_STATIONS} stations or more, or "
                "one that another camera sees too",
            )
    for target in measurements.targets:
        if ("target", target) not in known:
            raise InputError(
                f"target {target}: no camera saw it",
                code=Code.NOT_TIED,
                hint="leave it out, or let a camera see it",
            )


def examine_rig(measurements: RigMeasurements) -> dict[Pair, Examination]:
    """Look for mistakes in what each camera saw of each target that the arm moves against it.

    Raises
    ------
    InputError
        All views of a pair share a mistake; the message names the camera.
    """
    found: dict[Pair, Examination] = {}
    for (camera, target), measured in measurements.pairs.items():
        if not measurements.moves(camera, target) or len(measured) < FEWEST_STATIONS:
            found[camera, target] = Examination(measured)
            continue
        try:
            found[camera, target] = examine(measured)
        except HandeyeError as error:
            if len(measurements.pairs) == 1:
                raise
            where = f"camera {camera}, target {target}"
            raise type(error)(f"{where}: {error.message}", code=error.code, hint=error.hint) from error
    return found
