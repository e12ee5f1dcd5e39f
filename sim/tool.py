"""What hangs on a force-torque sensor, and what the sensor feels of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

Vector = list[float]


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


class SensedTool:
    """A tool that a hand holds at the handle H, on a sensor whose axes are the handle's.

    Attributes:
        tool: its parameters.
        place: of the sensor from H, in the handle's axes, (3,) [m].
    """

    def __init__(self, tool: Tool, place: Vector) -> None:
        self.tool, self.place = tool, place
        self._centre = list(tool.centre)

    def sensed(self, specific: Vector, alpha: Vector, omega: Vector, force: Vector, torque: Vector) -> Vector:
        """What the tool exerts on the sensor: the operator's wrench, and the tool's weight and inertia, (6,).

        Args:
            specific: a - g of H [m/s^2], this and all others (3,) in the handle's axes.
            alpha: its angular acceleration [rad/s^2].
            omega: its angular velocity [rad/s].
            force: of the operator at H [N].
            torque: of the operator [N m].
        """
        tool, centre = self.tool, self._centre
        at_centre = specific_force(
            specific, alpha, omega, [s + c for s, c in zip(self.place, centre, strict=True)]
        )
        pull = [-tool.mass * a for a in at_centre]
        spin = [i * a for i, a in zip(tool.inertia, alpha, strict=True)]
        gyroscopic = cross(omega, [i * w for i, w in zip(tool.inertia, omega, strict=True)])
        lever, sag = cross(force, self.place), cross(centre, pull)
        return [
            *(f + p for f, p in zip(force, pull, strict=True)),
            *(torque[i] + lever[i] + sag[i] - spin[i] - gyroscopic[i] for i in range(3)),
        ]


def cross(a: Vector, b: Vector) -> Vector:
    """The product a x b, (3,) each."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def specific_force(origin: Vector, alpha: Vector, omega: Vector, point: Vector) -> Vector:
    """A - g at a point of a rigid body from that at its origin, (3,) each [m, rad, s]."""
    tangential, centripetal = cross(alpha, point), cross(omega, cross(omega, point))
    return [o + t + c for o, t, c in zip(origin, tangential, centripetal, strict=True)]
