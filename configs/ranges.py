"""What no machine that a person holds on to goes beyond: more is a slip of the pen or of the unit."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi


@dataclass(frozen=True, slots=True)
class Range:
    """Closed range of a quantity in a robot description.

    Attributes:
        lower, upper: in ``unit``.
        unit: "" where it has none.
        why: what the ends come from.
    """

    lower: float
    upper: float
    unit: str
    why: str

    def __str__(self) -> str:
        return f"{self.lower:g} to {self.upper:g} {self.unit}".rstrip()


TURN = 2.0 * pi * (1.0 + 1e-6)

RANGES = {
    "place": Range(-20.0, 20.0, "m", "a hall; parts of a machine are metres apart, not millimetres"),
    "angle": Range(-TURN, TURN, "rad", "a full turn; degrees look larger"),
    "axis": Range(-10.0, 10.0, "", "a direction; its length must be 1"),
    "mass": Range(1e-4, 1000.0, "kg", "from a screw to the bridge of a gantry"),
    "moment": Range(1e-10, 1e4, "kg m^2", "a screw about its axis; a bridge of 500 kg and 15 m"),
    "product": Range(-1e4, 1e4, "kg m^2", "of inertia: no larger than a moment"),
    "gyration": Range(1e-4, 10.0, "m", "sqrt(moment / mass) of a part between a pin and a bridge"),
    "travel": Range(-20.0, 20.0, "m", "of a prismatic joint: a hall"),
    "turn": Range(-TURN, TURN, "rad", "a full turn; degrees look larger; continuous turns further"),
    "torque": Range(1e-3, 2000.0, "N m", "a finger's motor; the shoulder of a machine that carries a person"),
    "force": Range(1e-2, 20e3, "N", "a finger's motor; the drive of a gantry"),
    "angular speed": Range(1e-2, 100.0, "rad/s", "standstill; a motor of 1000 rpm without a gear"),
    "speed": Range(1e-3, 20.0, "m/s", "standstill; faster than a person runs"),
    "angular damping": Range(0.0, 1000.0, "N m s/rad", "no friction; a locked joint"),
    "damping": Range(0.0, 1e5, "N s/m", "no friction; a locked guide"),
    "dry torque": Range(0.0, 2000.0, "N m", "as torque"),
    "dry force": Range(0.0, 20e3, "N", "as force"),
    "size": Range(1e-4, 100.0, "m", "of a shape: a pin; the floor of a hall"),
    "scale": Range(-1000.0, 1000.0, "", "of a mesh: millimetres for metres; a minus mirrors"),
    "colour": Range(0.0, 1.0, "", "red, green, blue and opacity"),
}  # fmt: skip
"""Ranges of the numbers in a description, by the kind of number."""
