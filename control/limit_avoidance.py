"""Torques that push joints away from limits, and the share of the command they leave (Bimanual, IV-A).

The paper's (3) has no sign: here a torque points away from the limit of position, and against the velocity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from ..binding import bind
from ..models import Array
from ._kernels import ffi, lib

LOWER, UPPER, SPEED = int(lib.AVOIDS_LOWER), int(lib.AVOIDS_UPPER), int(lib.AVOIDS_SPEED)
"""Bits of ``LimitAvoidance.near``."""


@dataclass(frozen=True, slots=True)
class Avoidance:
    """Constants of (3), for distances to limits of position [rad] or velocity [rad/s].

    Attributes:
        gain: beta [N m rad, or N m rad/s].
        zone: t, the distance at which it begins.
        least: what a distance is taken for where it is smaller; it bounds the torque.

    Raises:
        ValueError: at construction, unless 0 <= gain and 0 < least < zone.
    """

    gain: float
    zone: float
    least: float

    def __post_init__(self) -> None:
        if not (self.gain >= 0.0 and 0.0 < self.least < self.zone):
            raise ValueError(f"{self} wants gain >= 0 and 0 < least < zone")

    @property
    def most(self) -> float:
        """Largest torque [N m]."""
        return self.gain * (1.0 / self.least - 1.0 / self.zone)


POSITION = Avoidance(0.1, radians(10.0), radians(0.5))
"""At most 11 N m a joint; the zone is the paper's, which gives no gain."""
VELOCITY = Avoidance(0.3, radians(40.0), radians(2.0))
"""At most 8 N m a joint."""


@dataclass(frozen=True, slots=True)
class JointLimits:
    """One entry a joint: limits of position [rad] and the largest speed [rad/s]."""

    lower: Array
    upper: Array
    velocity: Array


def slowed(torque: Array, qd: Array, velocity: Sequence[float], zone: float) -> None:
    """Take from a command what drives joints on that are near their largest speeds: all of it there.

    The torques of (3) are bounded, and a command may be stronger.

    Args:
        torque: of the command, (n,) [N m], in place.
        qd: speeds of the joints, (n,) [rad/s].
        velocity: the largest, (n,) [rad/s].
        zone: the distance to it at which this begins [rad/s].
    """
    for i, (speed, most) in enumerate(zip(qd.tolist(), velocity, strict=True)):
        room = most - abs(speed)
        if room < zone and torque[i] * speed > 0.0:
            torque[i] *= max(0.0, room / zone)


class LimitAvoidance:
    """(3) to (5) for all joints of an arm; reads its state where it is.

    Attributes:
        torque: tau_lo, (n,) [N m]; at most ``most`` of position and velocity together.
        alpha: share of the commanded torque that each joint keeps, 0 to 1, (n,).
        near: which limits push: LOWER, UPPER and SPEED by the joint, (n,).
    """

    def __init__(
        self,
        limits: JointLimits,
        q: Array,
        qd: Array,
        position: Avoidance = POSITION,
        velocity: Avoidance = VELOCITY,
    ) -> None:
        """Bind to the joints' state, (n,) each [rad, rad/s]."""
        n = len(q)
        self.torque, self.alpha = np.zeros(n), np.ones(n)
        self.near: NDArray[np.uint8] = np.zeros(n, np.uint8)
        self._core = ffi.new(
            "limit_avoidance *", {"n": n, "position": _gains(position), "velocity": _gains(velocity)}
        )
        bind(
            lib,
            self._core,
            lower=np.array(limits.lower, float),
            upper=np.array(limits.upper, float),
            fastest=np.array(limits.velocity, float),
            q=q,
            qd=qd,
            torque=self.torque,
            alpha=self.alpha,
            near=self.near,
        )

    @property
    def core(self) -> object:
        """The same for other parts of the C core."""
        return self._core

    def update(self) -> None:
        """Compute torque and alpha for the present state."""
        lib.limit_avoidance_update(self._core)


def _gains(avoidance: Avoidance) -> dict[str, float]:
    return {"gain": avoidance.gain, "zone": avoidance.zone, "least": avoidance.least}
