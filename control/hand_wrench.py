"""The wrench on the palm from the force-torque sensor at the wrist (Bimanual, IV-A and IV-D)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..binding import bind
from ..models import Array
from ._kernels import ffi, lib
from .task_arm import GRAVITY


@dataclass(frozen=True, slots=True)
class Load:
    """What a calibration finds of a force-torque sensor and of what hangs on it, in the sensor's axes.

    Attributes:
        bias: of force and torque, (6,) [N, N m].
        mass: [kg]; centre: of mass, (3,) [m].
    """

    bias: Array
    mass: float
    centre: Array


class HandWrench:
    """F of (2): what a hand, or the world, puts on the palm.

    The inertia of what hangs on the sensor stays in it, as in the paper.

    Attributes:
        wrench: at the palm in its axes, (6,) [N, N m].
    """

    def __init__(
        self,
        load: Load,
        T_palm_sensor: Array,
        rotation: Array,
        measured: Array,
        gravity: tuple[float, float, float] = GRAVITY,
    ) -> None:
        """Bind to what is measured.

        Args:
            load: from the calibration.
            T_palm_sensor: pose of the sensor in the palm's frame, (4, 4).
            rotation: of the palm in the station, (3, 3).
            measured: by the sensor in its axes, (6,) [N, N m].
            gravity: in the station [m/s^2].
        """
        self.wrench = np.zeros(6)
        self._core = ffi.new(
            "hand_wrench *",
            {
                "bias": list(load.bias),
                "mass": load.mass,
                "centre": list(load.centre),
                "R": T_palm_sensor[:3, :3].reshape(-1).tolist(),
                "t": T_palm_sensor[:3, 3].tolist(),
                "gravity": gravity,
            },
        )
        bind(lib, self._core, rotation=rotation, measured=measured, wrench=self.wrench)

    def update(self) -> None:
        """Take the present measurement."""
        lib.hand_wrench_update(self._core)
