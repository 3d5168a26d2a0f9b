"""Where the camera sits: one chain, two sets of names."""

from enum import StrEnum

from handeye.types.pose import Pose


class Mounting(StrEnum):
    """How the camera is mounted.

    Both mountings are the same chain ``T_camera_target = X @ A @ Y`` with X and Y unknown and constant, and
    A known from the robot for each view:

    ============  =================  ==================  ==================
    mounting      X                  A                   Y
    ============  =================  ==================  ==================
    eye in hand   `T_camera_flange`  `T_flange_base`     `T_base_target`
    eye to hand   `T_camera_base`    `T_base_flange`     `T_flange_target`
    ============  =================  ==================  ==================

    Examples
    --------
    >>> Mounting("eye_in_hand").result_names
    ('T_flange_camera', 'T_base_target')
    """

    EYE_IN_HAND = "eye_in_hand"
    EYE_TO_HAND = "eye_to_hand"

    def chain(self, T_base_flange: Pose) -> Pose:
        """Return A, the known middle of the chain, of a robot pose."""
        return T_base_flange.inverse() if self is Mounting.EYE_IN_HAND else T_base_flange

    @property
    def x_name(self) -> str:
        """Name of X, the side of the camera."""
        return "T_camera_flange" if self is Mounting.EYE_IN_HAND else "T_camera_base"

    @property
    def y_name(self) -> str:
        """Name of Y, the side of the target."""
        return "T_base_target" if self is Mounting.EYE_IN_HAND else "T_flange_target"

    @property
    def result_names(self) -> tuple[str, str]:
        """Names of the two transforms that people ask for: the inverse of X, and Y."""
        camera = "T_flange_camera" if self is Mounting.EYE_IN_HAND else "T_base_camera"
        return camera, self.y_name

    def results(self, X: Pose, Y: Pose) -> dict[str, Pose]:
        """Return what people ask for under its name: the pose of the camera (the inverse of X), and Y."""
        camera, target = self.result_names
        return {camera: X.inverse(), target: Y}
