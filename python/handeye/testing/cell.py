"""A cell with a truth, behind the mocks of devices: an arm with errors, a camera, a board."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from handeye.cameras.protocol import Frame, Grey
from handeye.cameras.simulated import Optics
from handeye.codes import Code
from handeye.datasets.toml_text import toml_text
from handeye.errors import DeviceError
from handeye.estimation import Measurements, paper_estimate
from handeye.planning.stopping import State
from handeye.robots import Arm, open_arm
from handeye.robots.protocol import Goal
from handeye.robots.simulated import ArmErrors
from handeye.session.simulated import SimulationOptions, simulated_cell, usual_errors
from handeye.types import Mounting, Pose, View


class MockCell:
    """What a mock of a device moves and sees; one cell may stand behind a robot and several cameras.

    Parameters
    ----------
    arm
        Description of the arm, or the name of a shipped one.
    errors
        How the arm differs from its description; None for an arm in good order.
    seed
        Of errors, noise, and where camera and board are.
    mounting
        Where the camera sits.
    points_only
        Whether the camera gives points instead of pictures, which is quick; their noise is 0.1 px.

    Examples
    --------
    >>> cell = MockCell("ur5e", points_only=True)
    >>> len(cell.joints_rad), len(cell.goals())
    (6, 3)
    """

    def __init__(
        self,
        arm: str | Arm = "ur5e",
        *,
        errors: ArmErrors | None = None,
        seed: int = 0,
        mounting: Mounting = Mounting.EYE_IN_HAND,
        points_only: bool = False,
    ) -> None:
        self.arm = open_arm(arm) if isinstance(arm, str) else arm
        options = SimulationOptions(
            seed=seed,
            mounting=mounting,
            errors=usual_errors() if errors is None else errors,
            optics=Optics(points_only=0.1) if points_only else Optics(),
        )
        made = simulated_cell(self.arm, options)
        self.start_rad: tuple[float, ...] = made.start.joints_rad
        self.truth = made.truth
        self.mounting = mounting
        self.camera, self.target = made.cell.camera, made.cell.target
        self._source = made.cell.source
        self._hidden = made.hidden_arm
        self._motions = 0

    @property
    def joints_rad(self) -> tuple[float, ...]:
        """(n,) joints where the controller believes that the arm stands."""
        joints = self._hidden.read_pose().joints_rad
        return () if joints is None else joints

    @property
    def T_base_flange(self) -> Pose:
        """Where the controller believes that the flange is; where it truly is only the camera sees."""
        return self._hidden.read_pose().T_base_flange

    def stand(self, joints_rad: tuple[float, ...] | None) -> None:
        """Let the arm come to rest at joints (n,).

        Raises
        ------
        DeviceError
            There are none, or they are beyond the limits; `code` is `motion_refused`.
        """
        if joints_rad is None:
            raise DeviceError("nobody has found joints that reach this pose", code=Code.MOTION_REFUSED)
        self._motions += 1
        goal = Goal(f"motion_{self._motions}.1", Pose(self.arm.forward(joints_rad)), joints_rad)
        self._hidden.move_to(goal)

    def grab(self, label: str) -> Frame:
        """Return what the camera sees from where the arm truly stands."""
        return self._source.grab(label)

    def picture(self, label: str) -> Grey:
        """Return it as grey values (H, W).

        Raises
        ------
        DeviceError
            The camera of this cell gives points only.
        """
        image = self.grab(label).image
        if image is None:
            raise DeviceError("this camera gives points only", code=Code.NO_IMAGE)
        return image

    def write(self, folder: Path) -> tuple[Path, Path]:
        """Write the files of camera and target for `handeye run`; return both."""
        camera, target = folder / "camera.toml", folder / "target.toml"
        camera.write_text(toml_text({"camera": self.camera.to_dict()}))
        target.write_text(toml_text({"target": self.target.to_dict()}))
        return camera, target

    def goals(self, number: int = 3, turn_rad: float = 0.15, speed_rad_s: float = 0.5) -> list[Goal]:
        """Return goals around the start, each turned by so much at some joint."""
        random = np.random.default_rng(number)
        found = [Goal("view_01.1", Pose(self.arm.forward(self.start_rad)), self.start_rad, speed_rad_s)]
        while len(found) < number:
            joints = np.array(self.start_rad) + turn_rad * random.uniform(-1, 1, len(self.arm))
            joints[len(found) % len(self.arm)] = found[-1].joints_rad[len(found) % len(self.arm)] + turn_rad  # pyright: ignore[reportOptionalSubscript]
            if self.arm.within_limits(joints):
                pose = Pose(self.arm.forward(joints))
                found.append(Goal(f"view_{len(found) + 1:02d}.1", pose, tuple(joints.tolist()), speed_rad_s))
        return found

    def beyond(self) -> Goal:
        """Return a goal beyond the limits of the joints, without joints: nobody reaches it."""
        return Goal("far.1", Pose.exp([9.0, 0, 0, 0, 0, 0]))

    def views(self, number: int) -> list[View]:
        """Take views around the start, those that show the board.

        Raises
        ------
        DeviceError
            The camera of this cell gives pictures only.
        """
        random = np.random.default_rng(1)
        taken: list[View] = []
        while len(taken) < number:
            joints = np.array(self.start_rad) + random.uniform(-0.15, 0.15, len(self.arm))
            self.stand(tuple(joints.tolist()))
            name = f"view_{len(taken) + 1:02d}"
            points = self.grab(f"{name}.1").points
            if points is None:
                raise DeviceError("this camera gives pictures only", code=Code.NO_POINTS)
            if len(points.point_ids) == self.target.point_count:
                view = View(name, self.T_base_flange, points.point_ids, points.pixels)
                taken.append(replace(view, joints_rad=self.joints_rad))
        return taken

    def state(self, number: int) -> State:
        """Return what a stop rule is shown after so many views."""
        measurements = Measurements.of(self.mounting, self.camera, self.target, self.views(number))
        return State(measurements, paper_estimate(measurements), np.array([0.3, np.nan, 0.1]))
