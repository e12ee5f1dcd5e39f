"""A serial chain as the digital twin: dynamics, springs, detents and locks (HapticGiant, section VI-C)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..binding import bind, pointer
from ..models import Array, Robot
from ._kernels import ffi, lib
from .chain import CAUGHT, FREE, LOCKED
from .limits import Limits
from .serial import SerialChain

LEVEL = 0.1
"""A handle's axis with less of it in the horizontal plane points nowhere there."""
RELEASED = 0.5
"""A lock's key is let go of below this share of the position at which it unlocks."""
SHUT, AT_REST = 1e-3, 1e-2
"""A caught joint this near to its lower limit, and this slow, is locked [rad or m], [rad/s or m/s]."""


@dataclass(frozen=True, slots=True)
class Detent:
    """A place where a joint likes to stay.

    Attributes:
        joint: its index.
        at: the place [rad or m].
        torque: largest of what draws the joint there [N m or N]; width: how far away that is [rad or m].
    """

    joint: int
    at: float
    torque: float
    width: float

    def pull(self, q: float) -> float:
        """Torque at a position: that of a smooth well, torque x e^((1 - x^2) / 2) with x in widths."""
        x = (self.at - q) / self.width
        return float(self.torque * x * np.exp(0.5 - 0.5 * x * x))


@dataclass(frozen=True, slots=True)
class Lock:
    """A joint that another one, its key, unlocks, as a handle does a door.

    Attributes:
        joint, key: their indices.
        unlock: position of the key from which on the joint is free.
        relock: how far above its lower limit the joint is caught again, once the key is let go of.
    """

    joint: int
    key: int
    unlock: float
    relock: float


@dataclass(frozen=True, slots=True)
class Mechanism:
    """What drives the joints of a chain, one entry each, (n,) [rad or m, s, N m or N].

    Attributes:
        limits: of the joints.
        start: where they begin.
        inertia: what their drives add to the links'.
        damping: viscous.
        drive: constant torque.
        stiffness, rest: of springs, and where they are slack.
        detents, locks: of single joints.
    """

    limits: Limits
    start: Array
    inertia: Array
    damping: Array
    drive: Array
    stiffness: Array
    rest: Array
    detents: Sequence[Detent] = ()
    locks: Sequence[Lock] = ()


class ChainTwin:
    """A chain of n joints whose end is where the handle is when the machine engages; see ``Twin``.

    Its base is put where the end must be for that at the joints' start, upright, and turned with the
    horizontal direction in which the handle's axis points. How the end is gripped does not change later.

    Attributes:
        base: pose of the chain's base in B, (4, 4) [m].
        damping: of the joints, (n,).
        start: where the joints are put by ``reset``, (n,) [rad or m].
        partial: False: E has all its directions.
        driving: torques beside those of the mechanism, (n,) [N m or N]; None for none. Their owner writes
            and fades them before each ``update``.
    """

    def __init__(
        self, robot: Robot, end: str, mechanism: Mechanism, turned: Array, gravity: float = 0.0
    ) -> None:
        """The chain and its driven joints.

        Args:
            robot: links and joints, none branching off.
            end: frame that the handle follows.
            mechanism: of the same number of joints.
            turned: rotation of the base from level and from the handle's heading, (3, 3).
            gravity: that the chain's weight is felt with [m/s^2].

        Raises:
            ModelError: no serial chain, or no such frame.
        """
        self.limits, self.damping = mechanism.limits, mechanism.damping
        self.start = mechanism.start.copy()
        self.partial = False
        self.driving: Array | None = None
        n = robot.nv
        self._mechanism, self._turned = mechanism, turned
        self._chain = SerialChain(robot, [end])
        (frame,) = self._chain.frames
        self.J, self.drift, self.position, self.rotation = (
            *(frame.J, frame.drift),
            *(frame.position, frame.rotation),
        )
        self._first = _pose(robot.model.jointPlacements[1])
        self._tip = _pose(robot.model.frames[robot.frame(end)].placement)
        self.base = np.eye(4)
        self.q, self.qd = mechanism.start.copy(), np.zeros(n)
        self.M, self.force, self.twist = np.eye(n), np.zeros(n), np.zeros(6)
        self._chain.bind(self.q, self.qd)
        self._core = ffi.new(
            "chain_twin *", {"n": n, "chain": self._chain.pointer, "gravity": (0.0, 0.0, -gravity)}
        )
        bind(
            lib,
            self._core,
            **{name: getattr(mechanism, name) for name in ("inertia", "drive", "stiffness", "rest")},
            **{"damping": self.damping, "q": self.q, "qd": self.qd, "M": self.M, "force": self.force},
        )
        self._state = [pointer(array, "double", n) for array in (self.q, self.qd)]
        self._qdd: Array | None = None
        self._qdd_pointer: object = None
        self._lower = mechanism.limits.lower.tolist()
        self.held: NDArray[np.uint8] | None = np.zeros(n, np.uint8) if mechanism.locks else None
        self.reset(np.zeros(3), np.eye(3))

    def reset(self, position: Array, rotation: Array) -> None:
        """Rest at the start, with E at a pose."""
        self.q[:], self.qd[:] = self.start, 0.0
        self._grip(np.eye(4), np.eye(3))
        own = np.eye(4)
        own[:3, :3], own[:3, 3] = self.rotation, self.position
        base = np.eye(4)
        base[:3, :3] = heading(rotation) @ self._turned
        base[:3, 3] = position - base[:3, :3] @ own[:3, 3]
        self._grip(base, (base[:3, :3] @ own[:3, :3]).T @ rotation)
        if self.held is not None:
            self.held[:] = FREE
            self._lock(self.held, begin=True)

    def follow(self, position: Array, rotation: Array) -> None:
        """Nothing."""

    def update(self, wrench: Array, share: float = 1.0) -> None:
        """Inertia, and force = J^T w - D qd + share (driving torques - weight) - c; what the locks do."""
        force = self.force
        self._core.share = share
        np.matmul(wrench, self.J, out=force)
        lib.chain_twin_update(self._core)
        if self.driving is not None:
            force += self.driving
        for detent in self._mechanism.detents:
            force[detent.joint] += share * detent.pull(float(self.q[detent.joint]))
        if self.held is not None:
            self._lock(self.held)

    def integrate(self, qdd: Array, dt: float) -> None:
        """Advance the joints and where E is under constant acceleration."""
        if qdd is not self._qdd:  # bound once: it always comes in the same array
            self._qdd, self._qdd_pointer = qdd, pointer(qdd, "const double", len(self.q), name="qdd")
        lib.serial_advance(len(self.q), *self._state, self._qdd_pointer, dt)
        self.place()

    def place(self) -> None:
        """Pose, twist, Jacobian and drift of E at the joints as they are."""
        self._chain.update()
        np.matmul(self.J, self.qd, out=self.twist)

    def _grip(self, base: Array, turned: Array) -> None:
        """Put the base at a pose (4, 4), and turn E from the end of the chain (3, 3)."""
        self.base[:] = base
        self._chain.mount(base @ self._first)
        tip = self._tip.copy()
        tip[:3, :3] = tip[:3, :3] @ turned
        self._chain.fix(0, tip)
        self.place()

    def _lock(self, held: NDArray[np.uint8], begin: bool = False) -> None:
        for lock in self._mechanism.locks:
            i, key = lock.joint, float(self.q[lock.key])
            above = float(self.q[i]) - self._lower[i]
            if key >= lock.unlock:
                held[i] = FREE
            elif held[i] == FREE and above <= lock.relock and (begin or key < RELEASED * lock.unlock):
                held[i] = CAUGHT
            if held[i] == CAUGHT and above <= SHUT and abs(float(self.qd[i])) <= AT_REST:
                held[i] = LOCKED


def heading(rotation: Array) -> Array:
    """Rotation about the vertical, (3, 3), from B to where the axis of a handle (3, 3) points.

    Where the axis is upright, its x axis says so instead.
    """
    axis = rotation[:, 2] if hypot(rotation[0, 2], rotation[1, 2]) >= LEVEL else rotation[:, 0]
    R: Array = pin.utils.rotate("z", atan2(axis[1], axis[0]))
    return R


def _pose(placement: pin.SE3) -> Array:
    T: Array = placement.homogeneous
    return T
