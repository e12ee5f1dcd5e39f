"""Brings joints to rest as fast as they are rated for, and holds them there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..models import Array

MOVING = 1.0
"""Speed from which on what brakes a joint is a damper that goes on [rad/s]."""


@dataclass(frozen=True, slots=True)
class HoldGains:
    """One entry a joint: stiffness [N m/rad], damping [N m s/rad], deceleration [rad/s^2], limit [N m]."""

    stiffness: Array
    damping: Array
    deceleration: Array
    limit: Array


def limited(torque: Array, most: Array) -> None:
    """Cut torques (n,) to their largest magnitudes (n,), in place; without what makes np.clip slow."""
    np.minimum(np.maximum(torque, -most, out=torque), most, out=torque)


def bearable(torque: Array, other: Array, most: Array) -> None:
    """Scale a command (n,), in place, so that every motor has what it asks beside what it gives otherwise.

    Cut joint by joint, strong joints would go on to press a palm on a wall that a weak wrist cannot bear, and
    turn it over. Where a motor has nothing left for the command, nothing of it remains.

    Args:
        torque: of the command, (n,) [N m].
        other: what the motors give besides, (n,) [N m].
        most: they can give, (n,) [N m].
    """
    share = 1.0
    for asked, given, limit in zip(torque.tolist(), other.tolist(), most.tolist(), strict=True):
        room = limit - given if asked > 0.0 else limit + given
        if abs(asked) * share > room:
            share = max(0.0, room) / abs(asked)
    if share < 1.0:
        torque *= share


class Hold:
    """A PD controller on a reference that starts where the joints are and slows down to rest.

    While it moves it does not lead a joint that something else has slowed down more, so that its motor is not
    asked to push on.

    Attributes:
        reference, rate: (n,) [rad, s]; torque: of the last tick, (n,) [N m].
    """

    def __init__(self, gains: HoldGains, dt: float) -> None:
        n = len(gains.limit)
        self._gains, self._step, self._dt = gains, gains.deceleration * dt, dt
        self.reference, self.rate, self.torque = np.zeros(n), np.zeros(n), np.zeros(n)
        self._drag = np.zeros(n)

    @property
    def at_rest(self) -> bool:
        """Whether the reference stands still."""
        return not self.rate.any()

    def reset(self, q: Array, qd: Array, torque: Array | None = None) -> None:
        """Start from a state (n,).

        The reference has the joints' speed and asks nothing of them at first. Where torques (n,) are given
        [N m], those that braked a joint until now go on as a damper: else what they withstood drives it on.
        """
        self.reference[:], self.rate[:] = q, qd
        self._drag[:] = 0.0
        if torque is not None:
            speed = np.abs(qd)
            braking = np.maximum(-torque * np.sign(qd), 0.0)
            np.divide(braking, speed, out=self._drag, where=speed > MOVING)

    def update(self, q: Array, qd: Array) -> Array:
        """Torques (n,) [N m] for the measured state (n,); own buffer. Advances the reference by a tick."""
        g = self._gains
        self._follow(q, qd)
        self.torque[:] = g.stiffness * (self.reference - q) + g.damping * (self.rate - qd) - self._drag * qd
        limited(self.torque, g.limit)
        if self.at_rest:
            return self.torque
        slower = self.rate - np.clip(self.rate, -self._step, self._step)
        self.reference += 0.5 * self._dt * (self.rate + slower)
        self.rate[:] = slower
        return self.torque

    def _follow(self, q: Array, qd: Array) -> None:
        """Bring a moving reference back to joints that it leads in place or speed."""
        if self.at_rest:
            return
        way = np.sign(self.rate)
        np.copyto(self.reference, q, where=way * (self.reference - q) > 0.0)
        np.copyto(self.rate, way * np.maximum(way * qd, 0.0), where=way * (self.rate - qd) > 0.0)
