"""Fingers: of a robot hand, which meet what it grasps, and of a person in a glove, which brakes hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..models import Array


@dataclass(frozen=True, slots=True)
class Servo:
    """A drive of a finger with its own position controller.

    Attributes:
        inertia: of the finger as the drive feels it [kg m^2].
        friction: viscous [N m s/rad].
        stiffness, damping: of its controller [N m/rad, N m s/rad].
        torque: that an ampere makes [N m/A].
        current: the most that it takes [A].
    """

    inertia: float = 1e-3
    friction: float = 5e-3
    stiffness: float = 2.0
    damping: float = 0.06
    torque: float = 0.5
    current: float = 0.9


@dataclass(frozen=True, slots=True)
class Grasped:
    """Something between the fingers.

    Attributes:
        at: where each drive meets it, (n,) [rad]; inf where it does not.
        stiffness, damping: of what is met [N m/rad, N m s/rad]; it pushes, and never pulls.
    """

    at: Array
    stiffness: float = 20.0
    damping: float = 0.05


class Fingers:
    """The fingers of a robot hand, one coordinate a drive; positive closes.

    Attributes:
        lower, upper: their hard stops, (n,) [rad].
        position, velocity: (n,) [rad, rad/s].
        current: of the motors, (n,) [A].
        grasped: what is between them, or None.
    """

    def __init__(self, lower: Array, upper: Array, servo: Servo) -> None:
        """They begin open, between hard stops (n,) [rad]."""
        self.lower, self.upper, self._servo = lower, upper, servo
        self.position = np.clip(np.zeros(len(lower)), lower, upper)
        self.velocity, self.current = np.zeros(len(lower)), np.zeros(len(lower))
        self.grasped: Grasped | None = None

    @property
    def contact(self) -> Array:
        """Torque of what is grasped, (n,), at most 0 [N m]."""
        if self.grasped is None:
            return np.zeros(len(self.position))
        deep = self.position - self.grasped.at
        pushed = self.grasped.stiffness * deep + self.grasped.damping * self.velocity
        return np.where(deep > 0.0, -np.maximum(pushed, 0.0), 0.0)

    @property
    def energy(self) -> float:
        """Of motion, and in what is grasped [J]."""
        moving = 0.5 * self._servo.inertia * float(self.velocity @ self.velocity)
        if self.grasped is None:
            return moving
        deep = np.maximum(self.position - self.grasped.at, 0.0)
        return moving + 0.5 * self.grasped.stiffness * float(deep @ deep)

    def step(self, target: Array, enabled: bool, dt: float) -> None:
        """Advance by dt [s] towards targets (n,) [rad]; without permission the motors have no current."""
        s = self._servo
        wanted = (s.stiffness * (target - self.position) - s.damping * self.velocity) / s.torque
        self.current[:] = np.clip(wanted, -s.current, s.current) if enabled else 0.0
        torque = s.torque * self.current + self.contact
        # friction at the speed after the step: however strong, it does not turn the motion round
        self.velocity += dt * torque / s.inertia
        self.velocity /= 1.0 + dt * s.friction / s.inertia
        self.position += dt * self.velocity
        stopped = (self.position < self.lower) | (self.position > self.upper)
        np.clip(self.position, self.lower, self.upper, out=self.position)
        self.velocity[stopped] = 0.0


CLOSED = np.array(
    # abduction, then the flexing joints from the palm on, of thumb, index, middle, ring and little finger
    [
        [0.3, 0.7, 0.8, 0.9],
        [0.1, 1.4, 1.7, 1.2],
        [0.0, 1.4, 1.7, 1.2],
        [-0.1, 1.4, 1.7, 1.2],
        [-0.2, 1.4, 1.7, 1.2],
    ]
)
"""Joint angles of a closed fist, (5, 4) [rad]; an open hand has 0. A rough picture of a person."""
REACTION_S = 0.05
"""Time constant with which a finger follows what its owner wants [s]."""
YIELD = 0.08
"""What is left of a wish to close beyond a closed brake: skin and string."""


class GlovedFingers:
    """The fingers of a person in a glove.

    Attributes:
        closed: how far each is, (5,), 0 open to 1 closed.
    """

    def __init__(self) -> None:
        self.closed = np.zeros(len(CLOSED))
        self._held = np.full(len(CLOSED), np.inf)

    @property
    def angle(self) -> Array:
        """Of the joints, finger by finger, (20,) [rad]."""
        angle: Array = (self.closed[:, None] * CLOSED).reshape(-1)
        return angle

    def step(self, wanted: Sequence[float], braked: Sequence[bool], dt: float) -> None:
        """Advance by dt [s]; a brake holds a finger where it finds it, but never against opening."""
        on = np.asarray(braked, bool)
        self._held = np.where(on, np.minimum(self._held, self.closed), np.inf)
        beyond = np.maximum(np.asarray(wanted, float) - self._held, 0.0)
        reachable = np.where(beyond > 0.0, self._held + YIELD * beyond, wanted)
        self.closed += -np.expm1(-dt / REACTION_S) * (reachable - self.closed)
