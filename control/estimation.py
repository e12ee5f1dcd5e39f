"""State estimation from the device image: the PPU's motion and the operator's wrench."""

from __future__ import annotations

import numpy as np

from ..binding import bind, pointer
from ..models import Array
from ._kernels import ffi, lib

BANDWIDTH = 40.0
"""Bandwidth of the PPU observer [rad/s]: above the gantry's motion, below the noise of its accelerometer."""


class PpuObserver:
    """Position, velocity and accelerometer bias of the PPU's axes.

    The accelerometer on the carriage drives the model, the encoders correct it: a triple pole at
    BANDWIDTH. Measurements are one tick old; the estimate is extrapolated to the present.

    Attributes:
        q, qd, qdd: estimates for this tick, (2,) [m, s].
    """

    def __init__(self, dt: float, position: Array, acceleration: Array) -> None:
        """The arrays that are read where they are: encoders (2,) [m], specific force (2,) [m/s^2]."""
        w = BANDWIDTH
        self.q, self.qd, self.qdd = np.zeros(2), np.zeros(2), np.zeros(2)
        gain = 3.0 * w * dt, 3.0 * w * w * dt, w**3 * dt
        self._core = ffi.new("ppu_observer *", {"dt": dt, "gain": gain})
        bind(lib, self._core, q_now=self.q, v_now=self.qd, a_now=self.qdd)
        self._position = position
        self._measured = [pointer(array, "const double", 2) for array in (position, acceleration)]

    def reset(self) -> None:
        """Start at rest at the measured position."""
        core = self._core
        core.q, core.v, core.bias = self._position.tolist(), (0.0, 0.0), (0.0, 0.0)
        self.q[:], self.qd[:], self.qdd[:] = self._position, 0.0, 0.0

    def update(self) -> None:
        """Take the measurements of the last tick."""
        lib.ppu_observe(self._core, *self._measured)


class WrenchEstimator:
    """The operator's wrench from the force-torque sensor, freed of the handle's weight and inertia.

    The accelerometer in the handle measures acceleration less gravity at the tool's centre of mass, so
    m times its reading is what weight and translation of the tool contribute. The tool's rotational
    inertia, of the order of 1e-3 kg m^2, is neglected. What the sensor drifts by is taken off where nobody
    pulls, so that a released handle does not wander off.

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
        dt: float,
        bias: Array | None = None,
        drifts: tuple[float, float] = (1.0, 1.0),
    ) -> None:
        """Take the tool and the arrays that are read where they are.

        Args:
            mass: of the tool [kg].
            centre: of the tool in the sensor's frame, (3,) [m].
            T_handle_sensor: pose of the sensor in the handle's frame, (4, 4).
            measured: wrench in the sensor's frame, (6,) [N, N m].
            specific_force: at the handle in its frame, (3,) [m/s^2].
            rotation: of the handle in B, (3, 3).
            dt: of a tick [s].
            bias: what the sensor reads without a load, (6,) [N, N m]; None for nothing.
            drifts: by how much of what a sensor of a strong arm drifts, forces and torques.
        """
        self.wrench = np.zeros(6)
        self._drift = ffi.new("drift *", {"dt": dt, "share": drifts})
        self._core = ffi.new("tracking_tool *", {"mass": mass, "drift": self._drift})
        bind(
            lib,
            self._core,
            centre=centre,
            bias=np.zeros(6) if bias is None else bias,
            R_sensor=T_handle_sensor[:3, :3].copy(),
            arm=T_handle_sensor[:3, 3].copy(),
            measured=measured,
            specific_force=specific_force,
            R_handle=rotation,
            wrench=self.wrench,
        )

    def update(self) -> None:
        """Take the present measurement."""
        lib.tracking_wrench(self._core)
