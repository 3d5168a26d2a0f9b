"""Groups of options of `handeye run`: limits of motion, time-outs, and what is wrong in a simulated cell."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter, validators

from handeye.cli.failures import UsageError
from handeye.datasets import RigDescription, read_rig_description
from handeye.session.attempt import Timeouts
from handeye.session.drivers import MANUAL
from handeye.session.faults import FaultRates
from handeye.session.settings import Collisions, RigSettings, Simulation
from handeye.session.simulated import usual_errors

NotNegative = Annotated[float, Parameter(validator=validators.Number(gte=0))]


@Parameter(name="*", group="Limits of motion and views")
@dataclass(frozen=True)
class Limits:
    """What no motion and no view may leave."""

    workspace_mm: tuple[float, float, float, float, float, float] | None = None
    """Box that the flange may move in, in the frame of the base: least x y z, largest x y z. Needed to move
    a real arm."""
    floor_mm: float = 0.0
    """Height of table or floor in that frame."""
    speed_deg_s: float = 30.0
    """No joint moves faster."""
    distance_mm: tuple[float, float] = (250.0, 900.0)
    """Nearest and farthest distance from camera to target."""
    tilt_deg: float = 45.0
    """Largest angle at which the target is seen."""
    margin_px: float = 20.0
    """Distance from the border of the image."""
    collisions: Collisions = Collisions.AUTO
    """How links are kept from touching one another: meshes (the shapes of the URDF, with the extra meshes),
    capsules, or auto for meshes where there are any."""


@Parameter(name="*", group="Time-outs")
@dataclass(frozen=True)
class TimeoutOptions:
    """How long a real robot and camera may take; nothing new is sent before the last call is back."""

    move_timeout_s: float | None = None
    """For one motion: 60 s, an hour where a person moves the arm."""
    read_timeout_s: float | None = None
    """For telling where it stands, and for stopping: 5 s, ten minutes where a person is asked."""
    camera_timeout_s: float | None = None
    """For one picture: 10 s, ten minutes from a folder or where a person moves the arm."""

    def timeouts(self, driver: str, images: str) -> Timeouts:
        """Return it as the library takes it."""
        by_hand = driver.partition(":")[0] == MANUAL
        # A person takes the time that a person takes.
        usual = Timeouts(move_s=3600.0, read_s=600.0, grab_s=600.0) if by_hand else Timeouts()
        if images.partition(":")[0] == "folder":
            usual = replace(usual, grab_s=600.0)
        stated = {
            "move_s": self.move_timeout_s,
            "read_s": self.read_timeout_s,
            "grab_s": self.camera_timeout_s,
        }
        return replace(usual, **{name: value for name, value in stated.items() if value is not None})


@Parameter(name="*", group="A camera that is not calibrated")
@dataclass(frozen=True)
class Lens:
    """Without --camera the views teach the lens too: how well, and which."""

    accuracy_px: float = 1.0
    """Pixels shall lie within so much of where they belong, root mean square over the image, with 95 %
    probability."""
    lens: Literal["brown_conrady_5", "kannala_brandt"] | None = None
    """Of which kind it is, kannala_brandt for a fisheye; by default the views tell."""
    uncalibrated: bool = False
    """Begin a simulated cell without its camera's calibration."""


@Parameter(name="*", group="Several cameras")
@dataclass(frozen=True)
class Rig:
    """Several cameras and boards at once; the accuracy, or --touch-mm, is asked for of every camera."""

    rig: bool = False
    """Drive a simulated rig: two cameras on the flange (left, right), two beside the arm (front, side) and
    two boards."""
    rig_file: Path | None = None
    """Drive a real rig with --robot and --driver: a TOML file with a table [[camera]] for each camera (name;
    on = "flange" or "base"; images, its driver as for --images; calibration, its file) and a table [[target]]
    for each board (name, on, board)."""
    cameras: Annotated[tuple[str, ...] | None, Parameter(consume_multiple=True)] = None
    """Those that take part; all by default."""
    camera_to_camera_mm: float | None = None
    """Ask for cameras of one body in each other too: radius of their position."""
    camera_to_camera_deg: float | None = None
    """The same for their rotation."""

    def settings(self, described: RigDescription | None) -> RigSettings | None:
        """Return it as the library takes it, with what the file says; None for one camera.

        Raises
        ------
        UsageError
            Options that need others.
        """
        if not (self.rig or self.rig_file):
            if self != Rig():
                raise UsageError("--cameras and --camera-to-camera need --rig or --rig-file")
            return None
        if self.rig and self.rig_file is not None:
            raise UsageError("--rig is a simulated rig, and --rig-file a real one: expected one of them")
        mm, deg = self.camera_to_camera_mm, self.camera_to_camera_deg
        if (mm is None) != (deg is None):
            raise UsageError("--camera-to-camera-mm and --camera-to-camera-deg go together")
        return RigSettings(
            self.cameras,
            None if mm is None or deg is None else (mm, deg),
            images=None if described is None else dict(described.images),
        )

    def described(self) -> RigDescription | None:
        """Return what the file says; None without one.

        Raises
        ------
        InputError
            It describes no rig.
        """
        return None if self.rig_file is None else read_rig_description(self.rig_file)


@Parameter(name="*", group="Simulated cell")
@dataclass(frozen=True)
class Simulated:
    """What is wrong in the simulated cell."""

    arm_errors: NotNegative = 1.0
    """Factor on the arm's usual errors; 0 is an exact arm."""
    blur_px: NotNegative = 0.6
    """Blur of the pictures."""
    pixel_noise: NotNegative = 2.0
    """Noise of the pictures, in grey values."""
    points_only: NotNegative | None = None
    """Project points with so much noise (px) instead of rendering and detecting: faster."""
    faults: NotNegative = 0.0
    """Share of attempts that each kind of fault of robot and camera befalls."""

    def simulation(self) -> Simulation:
        """Return it as the library takes it."""
        usual = usual_errors()
        scaled = type(usual)(**{name: value * self.arm_errors for name, value in vars(usual).items()})
        rates = None
        if self.faults > 0:
            rates = FaultRates(**dict.fromkeys(vars(FaultRates()), self.faults))
        return Simulation(
            scaled,
            rates,
            blur_px=self.blur_px,
            pixel_noise=self.pixel_noise,
            points_only=self.points_only,
        )
