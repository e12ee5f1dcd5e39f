"""Prepositioning of the PPU (HapticGiant, section VI-D)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan, pi

import numpy as np

from ...binding import bind, pointer
from ...control._kernels import ffi, lib
from ...models import Array
from .kinematics import LOWER, UPPER

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


class Prepositioning:
    """P-controller (27) with the bounds (28), (29), a braking curve and a limited slew.

    It leads joints 2 and 3 into none of their limits: where the twin holds the handle, a gantry that goes on
    would tear it from there. Nor does it carry the elbow towards its box faster than it can stop: an arm that
    has to take back both the gantry's speed and its own runs out of speed.

    Attributes:
        velocity: commanded, (2,) [m/s].
    """

    def __init__(
        self,
        gain: float,
        limits: PpuLimits,
        angles: tuple[Sequence[float], Sequence[float]],
        elbow: tuple[Sequence[float], Sequence[float]],
        dt: float,
        q: Array,
        q_ppu: Array,
        qd_ppu: Array,
    ) -> None:
        """The gain [1/s], and the arrays that are read where they are: joints (6,), PPU's motion (2,).

        ``angles``: lower and upper limits of joints 2 and 3 [rad]; ``elbow``: lower and upper corner of its
        box, of which x and y count [m].
        """
        self.velocity = np.zeros(2)
        self._core = ffi.new(
            "ppu_positioning *",
            {
                **{"link": (UPPER, LOWER), "best_angle": (Q2_REFERENCE, Q3_REFERENCE)},
                **{"least_angle": tuple(angles[0]), "most_angle": tuple(angles[1])},
                **{"elbow_lower": tuple(elbow[0][:2]), "elbow_upper": tuple(elbow[1][:2])},
                **{"lower": tuple(limits.lower), "upper": tuple(limits.upper), "velocity": limits.velocity},
                **{"acceleration": limits.acceleration, "braking": BRAKING_SHARE * limits.acceleration},
                **{"time_constant": limits.time_constant, "gain": gain, "dt": dt},
            },
        )
        bind(lib, self._core, command=self.velocity)
        ppu = [pointer(array, "const double", 2) for array in (q_ppu, qd_ppu)]
        self._motion = [pointer(q, "const double", 6), *ppu]

    def reset(self) -> None:
        """Command standstill."""
        self.velocity[:] = 0.0

    def reference(self) -> Array:
        """PPU position that would put joints 2 and 3 at their best angles, (30), (2,) [m]."""
        target = np.zeros(2)
        lib.ppu_reference(self._core, *self._motion[:2], pointer(target, "double", 2))
        return target

    def update(self) -> None:
        """Velocity command for this tick."""
        lib.ppu_update(self._core, *self._motion)

    def stop(self) -> None:
        """Brake at the rated acceleration."""
        lib.ppu_stop(self._core)
