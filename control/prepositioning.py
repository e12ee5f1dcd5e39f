"""Prepositioning of the PPU (seed 000, section VI-D)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, cos, pi, sin, sqrt

from ..models import Array
from ..models.giant import LOWER, UPPER

Q2_REFERENCE = pi / 2
"""Maximises the manipulability of the SCARA arm of joints 1 and 2."""
Q3_REFERENCE = -atan(UPPER / LOWER)
"""Aligns the forearm's ground projection with the line from joint 1 to joint 3."""
BRAKING_SHARE = 0.7
"""Share of the acceleration that braking in front of a limit may count on: (28) and (29) with the control
period alone would ask for infinite deceleration."""


@dataclass(frozen=True, slots=True)
class PpuLimits:
    """Positions, one an axis [m]; speed [m/s], acceleration [m/s^2], lag of the velocity loop [s]."""

    lower: Sequence[float]
    upper: Sequence[float]
    velocity: float
    acceleration: float
    time_constant: float


def reference(q: Sequence[float], q_ppu: Sequence[float]) -> tuple[float, float]:
    """PPU position that would put joints 2 and 3 at their best angles with the handle at rest, (30) [m].

    The yaw q1 + q2 + q3 stays as it is, so forearm and handle cancel out of (30) and the difference of
    the elbow's positions remains.
    """
    q1, q12 = q[0], q[0] + q[1]
    r12 = q12 + q[2] - Q3_REFERENCE
    r1 = r12 - Q2_REFERENCE
    x = q_ppu[0] + UPPER * (cos(q1) - cos(r1)) + LOWER * (cos(q12) - cos(r12))
    y = q_ppu[1] + UPPER * (sin(q1) - sin(r1)) + LOWER * (sin(q12) - sin(r12))
    return x, y


class Prepositioning:
    """P-controller (27) with the bounds (28), (29), a braking curve and a limited slew.

    Attributes:
        velocity: commanded, one an axis [m/s].
    """

    def __init__(self, gain: float, limits: PpuLimits, dt: float) -> None:
        """The gain in 1/s."""
        self._gain, self._limits, self._dt = gain, limits, dt
        self.velocity = [0.0, 0.0]

    def reset(self) -> None:
        """Command standstill."""
        self.velocity = [0.0, 0.0]

    def update(self, q: Array, q_ppu: Array, qd_ppu: Array) -> list[float]:
        """Velocity command for this tick [m/s] from joints (6,) and PPU (2,)."""
        position, speed = q_ppu.tolist(), qd_ppu.tolist()
        target = reference(q.tolist(), position)
        for axis in range(2):
            # what the lag of the velocity loop will still add counts as travelled
            ahead = position[axis] + self._limits.time_constant * speed[axis]
            self.velocity[axis] = self._command(axis, target[axis] - position[axis], ahead)
        return self.velocity

    def stop(self) -> list[float]:
        """Brake at the rated acceleration."""
        step = self._limits.acceleration * self._dt
        self.velocity = [max(v - step, 0.0) if v > 0.0 else min(v + step, 0.0) for v in self.velocity]
        return self.velocity

    def _command(self, axis: int, error: float, position: float) -> float:
        limits, dt = self._limits, self._dt
        below = max(position - limits.lower[axis], 0.0)
        above = max(limits.upper[axis] - position, 0.0)
        a = BRAKING_SHARE * limits.acceleration
        slowest = -min(below / dt, sqrt(2.0 * a * below), limits.velocity)
        fastest = min(above / dt, sqrt(2.0 * a * above), limits.velocity)
        wanted = min(max(self._gain * error, slowest), fastest)
        step, last = limits.acceleration * dt, self.velocity[axis]
        return min(max(wanted, last - step), last + step)
