"""An arm: its joints, where its flange is, how that moves, and which joint positions reach a pose."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError, SolveError
from handeye.types.arrays import BoolArray, FloatArray, finite_array
from handeye.types.pose import Pose

MAX_JOINTS = 16


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint that moves.

    Parameters
    ----------
    name
        As in the description of the arm.
    placement
        Its frame at position zero in the frame of the joint before it, or in the base.
    axis
        (3,) direction of its axis in its own frame.
    sliding
        Whether it slides along its axis (metres) rather than turns about it (radians).
    lower, upper
        Limits of its position; infinite if there are none.
    velocity
        Largest speed per second; infinite if unknown.

    Examples
    --------
    >>> from handeye.types import Pose
    >>> Joint("shoulder", Pose.identity(), lower=-2.0, upper=2.0).sliding
    False
    """

    name: str
    placement: Pose
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    sliding: bool = False
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf


@dataclass(frozen=True, eq=False)
class Arm:
    """A serial arm of n joints that move.

    Parameters
    ----------
    name
        What it is.
    joints
        Base first.
    T_last_flange
        The flange in the frame of the last joint.
    base, flange
        Names of the frames at its ends.
    described
        Fingerprint of its description, where its limits were narrowed since.

    Raises
    ------
    InputError
        No joint or more than 16, two of one name, an axis without direction, limits in the wrong order.

    Examples
    --------
    >>> arm.forward(np.zeros(len(arm))).shape  # metres
    (4, 4)
    >>> arm.within_limits(np.zeros(len(arm)))
    True
    """

    name: str
    joints: tuple[Joint, ...]
    T_last_flange: Pose = field(default_factory=Pose.identity)
    base: str = "base"
    flange: str = "flange"
    described: str | None = None

    def __post_init__(self) -> None:
        names = self.joint_names
        if not 1 <= len(names) <= MAX_JOINTS:
            raise InputError(
                f"arm {self.name}: {len(names)} joints that move, expected 1 to {MAX_JOINTS}",
                code=Code.UNUSABLE_ARM,
            )
        if len(set(names)) < len(names):
            raise InputError(f"arm {self.name}: two joints of one name", code=Code.UNUSABLE_ARM)
        for joint in self.joints:
            if not joint.velocity > 0:
                raise InputError(
                    f"arm {self.name}: joint {joint.name}: a largest speed of {joint.velocity}",
                    code=Code.UNUSABLE_ARM,
                )
        self._chain  # noqa: B018 - checks what the core checks

    def __getstate__(self) -> dict[str, object]:
        """Leave the core's copy behind: it is made again where the arm is unpacked."""
        return {key: value for key, value in self.__dict__.items() if key != "_chain"}

    @cached_property
    def _chain(self) -> _core.Chain:
        return _core.Chain(
            np.array([joint.placement.matrix for joint in self.joints]),
            np.array([joint.axis for joint in self.joints], dtype=float),
            [joint.sliding for joint in self.joints],
            self.limits,
            self.T_last_flange.matrix,
        )

    def __len__(self) -> int:
        return len(self.joints)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, base first."""
        return tuple(joint.name for joint in self.joints)

    @property
    def sliding(self) -> tuple[bool, ...]:
        """Whether each joint slides."""
        return tuple(joint.sliding for joint in self.joints)

    @property
    def limits(self) -> FloatArray:
        """(n, 2) lower and upper limits, radians or metres."""
        return np.array([[joint.lower, joint.upper] for joint in self.joints], dtype=float)

    @property
    def velocities(self) -> FloatArray:
        """(n,) largest speeds, radians or metres per second; infinite where unknown."""
        return np.array([joint.velocity for joint in self.joints], dtype=float)

    @property
    def fingerprint(self) -> str:
        """Checksum of everything that motions follow from: where the joints are, how far and fast they go.

        Of an arm that was `limited`, that of its description.
        """
        if self.described is not None:
            return self.described
        digest = hashlib.blake2b(digest_size=16)
        for joint in self.joints:
            digest.update(repr((joint.name, joint.axis, joint.sliding)).encode())
            digest.update(repr((joint.lower, joint.upper, joint.velocity)).encode())
            digest.update(joint.placement.matrix.tobytes())
        digest.update(self.T_last_flange.matrix.tobytes())
        return digest.hexdigest()

    @property
    def reach_m(self) -> float:
        """A length that the flange is at most away from the first joint, sliding joints apart."""
        offsets = [joint.placement.translation for joint in self.joints[1:]]
        return float(sum(np.linalg.norm(o) for o in [*offsets, self.T_last_flange.translation]))

    def limited(self, limits: ArrayLike) -> "Arm":
        """Return the arm within its own limits and others (n, 2), lower and upper, radians or metres.

        Raises
        ------
        InputError
            Not two numbers for each joint, or ranges that leave a joint no way.

        Examples
        --------
        >>> arm.limited(0.5 * arm.limits).within_limits(0.9 * arm.limits[:, 1])
        False
        """
        theirs = np.asarray(limits, dtype=float)
        if theirs.shape != (len(self), 2):
            raise InputError(
                f"arm {self.name}: joint limits of shape {theirs.shape}, expected ({len(self)}, 2)",
                code=Code.WRONG_SHAPE,
            )
        lower = np.maximum(self.limits[:, 0], theirs[:, 0])
        upper = np.minimum(self.limits[:, 1], theirs[:, 1])
        for name, low, high, other in zip(self.joint_names, lower, upper, theirs, strict=True):
            if not low < high:
                raise InputError(
                    f"arm {self.name}: no position of joint {name} is within its own limits and within "
                    f"{other[0]:.4g} to {other[1]:.4g}",
                    code=Code.UNUSABLE_ARM,
                )
        return replace(
            self,
            joints=tuple(
                replace(joint, lower=float(low), upper=float(high))
                for joint, low, high in zip(self.joints, lower, upper, strict=True)
            ),
            described=self.fingerprint,
        )

    def with_flange(self, T_flange_tool: Pose, name: str = "tool") -> "Arm":
        """Return the arm with another frame at its end, `T_flange_tool` away from the flange of this one."""
        return replace(self, T_last_flange=self.T_last_flange @ T_flange_tool, flange=name, described=None)

    def forward(self, joints: ArrayLike) -> FloatArray:
        """(..., 4, 4) `T_base_flange` at joint positions (..., n).

        Raises
        ------
        InputError
            Another number of joints, or a position that is not finite.
        """
        flat, shape = self._positions(joints)
        return self._chain.forward(flat).reshape(*shape, 4, 4)

    def frames(self, joints: ArrayLike) -> FloatArray:
        """(..., n + 2, 4, 4) poses in the base at joint positions (..., n): the base itself, joints, flange.

        Raises
        ------
        InputError
            As `forward`.
        """
        flat, shape = self._positions(joints)
        return self._chain.frames(flat).reshape(*shape, len(self) + 2, 4, 4)

    def jacobian(self, joints: ArrayLike, frame: str = "flange") -> FloatArray:
        """(..., 6, n) twists `[rho; phi]` of the flange per joint at positions (..., n).

        ``T(q + dq) = T(q) exp(J dq)`` for the frame "flange", ``exp(J dq) T(q)`` for "base".

        Raises
        ------
        InputError
            Another number of joints, a position that is not finite, or another frame.
        """
        flat, shape = self._positions(joints)
        return self._chain.jacobians(flat, frame).reshape(*shape, 6, len(self))

    def displacements(
        self, joints: ArrayLike, which: Sequence[int], twists: ArrayLike, frame: str = "flange"
    ) -> FloatArray:
        """(..., 6, m) twists of the flange where joints sit displaced on the link before them, at (..., n).

        Way w displaces joint ``which[w]`` by ``twists[w]`` (m, 6), metres and radians in the joint's own
        frame before it moves; frames as of `jacobian`.

        Raises
        ------
        InputError
            As `jacobian`.
        """
        flat, shape = self._positions(joints)
        found = self._chain.displacements(flat, frame, list(which), twists)
        return found.reshape(*shape, 6, len(which))

    def inverse(
        self, T_base_flange: Pose, start: ArrayLike | None = None, *, attempts: int = 100
    ) -> FloatArray:
        """(n,) joint positions within the limits that reach a pose, from a posture (n,) near which to stay.

        Without a start from the middle of the limits. Where the way from the start does not lead to the
        pose, others are tried: the answer is then a posture of its own.

        Raises
        ------
        SolveError
            None was found; the message says how near the arm comes.
        """
        first = self.middle if start is None else finite_array(start, (len(self),), "start")
        found, reached, off = self._chain.inverse(
            T_base_flange.matrix[np.newaxis], first[np.newaxis], attempts=attempts
        )
        if not reached[0]:
            metres, radians = off[0]
            raise SolveError(
                f"arm {self.name} does not reach the pose within its joint limits: it comes within "
                f"{metres * 1e3:.1f} mm and {np.rad2deg(radians):.2f} deg",
                code=Code.OUT_OF_REACH,
                hint="choose a pose nearer to the base, or another orientation",
            )
        return found[0]

    def inverse_all(
        self, T_base_flange: ArrayLike, start: ArrayLike | None = None, *, attempts: int = 100
    ) -> tuple[FloatArray, BoolArray]:
        """(N, n) joint positions that reach poses (N, 4, 4), and which (N,) are reached.

        From one posture (n,) for all or one for each (N, n); rows of poses that are not reached hold the
        nearest posture found.

        Raises
        ------
        InputError
            Not rigid, or a wrong shape.
        """
        goals = finite_array(T_base_flange, (None, 4, 4), "T_base_flange")
        first = np.broadcast_to(
            self.middle if start is None else np.asarray(start, float), (len(goals), len(self))
        )
        found, reached, _ = self._chain.inverse(goals, first, attempts=attempts)
        return found, np.array(reached, dtype=bool)

    def postures(self, T_base_flange: Pose, *, attempts: int = 100) -> FloatArray:
        """(S, n) all different joint positions found that reach a pose; none if it is out of reach."""
        return self._chain.postures(T_base_flange.matrix, attempts=attempts)

    @property
    def middle(self) -> FloatArray:
        """(n,) a posture a little off the middle of the limits, at which many arms are stretched."""
        low, high = self.limits.T
        bounded = np.isfinite(low) & np.isfinite(high)
        middle = np.where(bounded, 0.5 * (np.where(bounded, low, 0) + np.where(bounded, high, 0)), 0.0)
        return np.clip(middle + 0.1, low, high)

    def within_limits(self, joints: ArrayLike) -> bool:
        """Tell whether all positions (..., n) lie within the limits."""
        flat, _ = self._positions(joints)
        low, high = self.limits.T
        return bool(np.all((flat >= low) & (flat <= high)))

    def _positions(self, joints: ArrayLike) -> tuple[FloatArray, tuple[int, ...]]:
        array = np.asarray(joints, dtype=float)
        if array.ndim < 1 or array.shape[-1] != len(self):
            raise InputError(
                f"arm {self.name}: joint positions of shape {array.shape}, expected (..., {len(self)}): "
                + ", ".join(self.joint_names),
                code=Code.WRONG_SHAPE,
            )
        return array.reshape(-1, len(self)), array.shape[:-1]


def denavit_hartenberg(
    name: str, rows: Sequence[tuple[float, float, float, float]], limits: ArrayLike, velocities: ArrayLike
) -> Arm:
    """Return an arm from standard parameters (Denavit and Hartenberg 1955): a (m), d (m), alpha, offset.

    Joint i: ``T = Rz(q + offset) Tz(d) Tx(a) Rx(alpha)``; all joints turn.

    Parameters
    ----------
    name
        What the arm is called.
    rows
        (n, 4) of the joints, base first: a and d in metres, alpha and offset in radians.
    limits
        (n, 2) lowest and highest position, radians.
    velocities
        (n,) largest speeds, radians per second.

    Raises
    ------
    InputError
        As `Arm`; or limits and speeds that are not one for each joint.

    Examples
    --------
    >>> two = denavit_hartenberg("planar", [(0.3, 0, 0, 0), (0.2, 0, 0, 0)], [(-3, 3)] * 2, [1.0, 1.0])
    >>> two.reach_m
    0.5
    """
    before = Pose.identity()
    joints: list[Joint] = []
    bounds = finite_array(limits, (len(rows), 2), "limits")
    speeds = finite_array(velocities, (len(rows),), "velocities")
    for i, (a, d, alpha, offset) in enumerate(rows):
        turned = before @ Pose.exp([0, 0, 0, 0, 0, offset])
        joints.append(
            Joint(
                f"joint_{i + 1}",
                turned,
                lower=float(bounds[i, 0]),
                upper=float(bounds[i, 1]),
                velocity=float(speeds[i]),
            )
        )
        before = Pose.exp([a, 0, d, 0, 0, 0]) @ Pose.exp([0, 0, 0, alpha, 0, 0])
    return Arm(name, tuple(joints), before)
