"""State estimation from the device image: the PPU's motion and the operator's wrench."""

from __future__ import annotations

import numpy as np

from ..models import Array
from ._kernels import ffi, lib

BANDWIDTH = 40.0
"""Of the PPU observer [rad/s]: above the gantry's motion, below the noise of its accelerometer."""


class PpuObserver:
    """Position, velocity and accelerometer bias of the PPU's axes.

    The accelerometer on the carriage drives the model, the encoders correct it: a triple pole at
    BANDWIDTH. Measurements are one tick old; the estimate is extrapolated to the present.

    Attributes:
        q, qd, qdd: estimates for this tick, (2,) [m, s].
    """

    def __init__(self, dt: float) -> None:
        self._dt = dt
        w = BANDWIDTH
        self._gains = 3.0 * w * dt, 3.0 * w * w * dt, w**3 * dt
        self._axes = [(0.0, 0.0, 0.0)] * 2
        self.q, self.qd, self.qdd = np.zeros(2), np.zeros(2), np.zeros(2)

    def reset(self, position: Array) -> None:
        """Start at rest at a position (2,) [m]."""
        self._axes = [(q, 0.0, 0.0) for q in position.tolist()]
        self.q[:], self.qd[:], self.qdd[:] = position, 0.0, 0.0

    def update(self, position: Array, acceleration: Array) -> None:
        """Take measurements of the last tick: encoders (2,) [m], horizontal specific force (2,) [m/s^2]."""
        dt, (l_q, l_v, l_b) = self._dt, self._gains
        measured = zip(position.tolist(), acceleration.tolist(), strict=True)
        for i, (x, f) in enumerate(measured):
            q, v, bias = self._axes[i]
            a = f - bias
            error = x - (q + dt * v)
            q += dt * v + l_q * error
            v += dt * a + l_v * error
            self._axes[i] = q, v, bias - l_b * error
            self.q[i], self.qd[i], self.qdd[i] = q + dt * v, v + dt * a, a


class WrenchEstimator:
    """The operator's wrench from the force-torque sensor, freed of the handle's weight and inertia.

    The accelerometer in the handle measures acceleration less gravity at the tool's centre of mass, so
    m times its reading is what weight and translation of the tool contribute. The tool's rotational
    inertia, of the order of 1e-3 kg m^2, is neglected.

    Attributes:
        wrench: at the handle H in B, (6,) [N, N m].
    """

    def __init__(
        self,
        mass: float,
        centre: Array,
        T_handle_sensor: Array,
        measured: Array,
        specific_force: Array,
        rotation: Array,
    ) -> None:
        """Take the tool and the arrays that are read where they are.

        Args:
            mass: of the tool [kg].
            centre: of the tool in the sensor's frame, (3,) [m].
            T_handle_sensor: pose of the sensor in the handle's frame, (4, 4).
            measured: wrench in the sensor's frame, (6,) [N, N m].
            specific_force: at the handle in its frame, (3,) [m/s^2].
            rotation: of the handle in B, (3, 3).
        """
        self.wrench = np.zeros(6)
        R, arm = T_handle_sensor[:3, :3].copy(), T_handle_sensor[:3, 3].copy()
        arrays = (centre, R, arm, measured, specific_force, rotation, self.wrench)
        self._arguments = (mass, *(ffi.from_buffer("double[]", array) for array in arrays))

    def update(self) -> None:
        """Take the present measurement."""
        lib.tracking_wrench(*self._arguments)
