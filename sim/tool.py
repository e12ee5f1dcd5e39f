"""What hangs on a force-torque sensor, and what the sensors on it feel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..binding import bind
from ..models import Array
from ._plant import ffi, lib


@dataclass(frozen=True, slots=True)
class Tool:
    """What hangs on the force-torque sensor.

    Attributes:
        mass: [kg].
        centre: of mass, in the sensor's frame, (3,) [m].
        inertia: principal moments about it, in the sensor's axes, (3,) [kg m^2].
    """

    mass: float
    centre: Sequence[float]
    inertia: Sequence[float]


class Carrier(Protocol):
    """The frame H that carries it, in the axes of its base B and without that one's motion; own buffers."""

    rotation: Array
    twist: Array
    acceleration: Array


class SensedTool:
    """A tool that a hand holds at the handle H.

    Attributes:
        tool: its parameters.
        place: of the force-torque sensor from H, in the sensors' axes, (3,) [m].
        base: acceleration of B less gravity, (3,) in its axes [m/s^2]; the plant sets it.
        felt: by the force-torque sensor, (6,): the operator's wrench, and the tool's weight and inertia.
        specific, omega: specific force at the inertial unit, and angular velocity, (3,) each.
    """

    def __init__(
        self,
        tool: Tool,
        place: Sequence[float],
        carrier: Carrier,
        wrench: Array,
        axes: Array | None = None,
        unit: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        """A tool on an arm.

        Args:
            tool: its parameters.
            place: see above.
            carrier: H, read at every update.
            wrench: of the operator on it in B, (6,) [N, N m], read at every update.
            axes: of the sensors in H, (3, 3); None for those of H.
            unit: place of an inertial unit from H, in the sensors' axes, (3,) [m].
        """
        self.tool, self.place = tool, list(place)
        self.base, self.felt = np.zeros(3), np.zeros(6)
        self.specific, self.omega = np.zeros(3), np.zeros(3)
        constants = {
            **{"mass": tool.mass, "centre": list(tool.centre), "inertia": list(tool.inertia)},
            **{"place": self.place, "unit": list(unit)},
            "axes": (np.eye(3) if axes is None else np.asarray(axes)).reshape(-1).tolist(),
        }
        self._core = ffi.new("tool *", constants)
        bind(
            lib,
            self._core,
            rotation=carrier.rotation,
            twist=carrier.twist,
            acceleration=carrier.acceleration,
            base=self.base,
            wrench=wrench,
            felt=self.felt,
            specific=self.specific,
            omega=self.omega,
        )

    def update(self) -> None:
        """Feel what is now."""
        lib.tool_feel(self._core)
