"""Speeds of a holonomic base from the three axes of a foot paddle (Bimanual, section III)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..models import Array


@dataclass(frozen=True, slots=True)
class BaseLimits:
    """What a base may do.

    Attributes:
        speed: along the floor [m/s]; rate: about the upright axis [rad/s].
        acceleration [m/s^2]; turning: [rad/s^2].
        dead_zone: part of a paddle's way that means nothing, 0 to less than 1.

    Raises:
        ValueError: at construction, where a limit is not positive or the dead zone is all of the way.
    """

    speed: float
    rate: float
    acceleration: float
    turning: float
    dead_zone: float

    def __post_init__(self) -> None:
        if not min(self.speed, self.rate, self.acceleration, self.turning) > 0.0:
            raise ValueError("speeds and accelerations of a base must be positive")
        if not 0.0 <= self.dead_zone < 1.0:
            raise ValueError(f"a dead zone of {self.dead_zone:g} of the way; give 0 to less than 1")


class Base:
    """Velocity for the base's drives.

    Attributes:
        velocity: forward, to the left, about the upright axis, (3,) [m/s, m/s, rad/s].
    """

    def __init__(self, limits: BaseLimits, dt: float) -> None:
        self._limits, self._dt = limits, dt
        self.velocity = np.zeros(3)
        self._armed = False

    @property
    def still(self) -> bool:
        """Whether it stands."""
        return not self.velocity.any()

    def reset(self) -> None:
        """It stands, and the paddle must pass its dead zone before it moves."""
        self.velocity[:] = 0.0
        self._armed = False

    def update(self, paddle: Array, permitted: bool) -> Array:
        """Take the paddle's axes (3,), -1 to 1 of their way; own buffer.

        A foot that rests on the paddle when the permission comes moves nothing: the paddle must have been
        in its dead zone once. Without permission, or with readings that are none, the base brakes.
        """
        wanted = self._wanted(paddle)
        if not permitted or wanted is None:
            self._armed = False
        elif not wanted.any():
            self._armed = True
        goal = wanted if self._armed and wanted is not None else np.zeros(3)
        limits, dt = self._limits, self._dt
        self.velocity[:2] = _towards(self.velocity[:2], goal[:2], limits.acceleration * dt)
        self.velocity[2:] = _towards(self.velocity[2:], goal[2:], limits.turning * dt)
        return self.velocity

    def _wanted(self, paddle: Array) -> Array | None:
        """What the paddle means beyond its dead zone; None where it is no reading."""
        if not np.isfinite(paddle).all():
            return None
        limits, wanted = self._limits, np.zeros(3)
        along = float(np.linalg.norm(paddle[:2]))
        if along > limits.dead_zone:  # of both axes together: no direction is favoured
            wanted[:2] = paddle[:2] / along * (limits.speed * _share(along, limits.dead_zone))
        about = abs(float(paddle[2]))
        if about > limits.dead_zone:
            wanted[2] = np.sign(paddle[2]) * limits.rate * _share(about, limits.dead_zone)
        return wanted


def _share(way: float, dead: float) -> float:
    """Part of the full speed: 0 at the edge of the dead zone, without a step, to 1 at the end of the way."""
    return min(1.0, (way - dead) / (1.0 - dead))


def _towards(speed: Array, goal: Array, step: float) -> Array:
    """A speed that has come nearer to its goal by a step at most."""
    change = goal - speed
    size = float(np.linalg.norm(change))
    return goal if size <= step else speed + change * (step / size)
