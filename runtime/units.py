"""Numbers with units, as a configuration writes them: ``"2.5 2.5 3 rad/s"``."""

from __future__ import annotations

from math import inf, isfinite, isinf, isnan, pi
from typing import ClassVar

DIMENSIONS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "bit rate": {"bit/s": 1.0, "kbit/s": 1e3, "Mbit/s": 1e6},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "angle": {"rad": 1.0, "mrad": 1e-3, "deg": pi / 180.0},
    "speed": {"m/s": 1.0, "mm/s": 1e-3},
    "angular speed": {"rad/s": 1.0, "deg/s": pi / 180.0},
    "acceleration": {"m/s^2": 1.0},
    "angular acceleration": {"rad/s^2": 1.0, "deg/s^2": pi / 180.0},
    "mass": {"kg": 1.0, "g": 1e-3},
    "inertia": {"kg m^2": 1.0},
    "force": {"N": 1.0},
    "torque": {"N m": 1.0},
    "stiffness": {"N/m": 1.0},
    "damping": {"N s/m": 1.0},
    "angular stiffness": {"N m/rad": 1.0},
    "angular damping": {"N m s/rad": 1.0},
    "rate": {"1/s": 1.0},
    "rate squared": {"1/s^2": 1.0},
}

LARGEST: dict[str, float] = {
    "time": 1e6,
    "frequency": 1e4,
    "bit rate": 2e7,
    "length": 100.0,
    "angle": 100.0,
    "speed": 20.0,
    "angular speed": 100.0,
    "acceleration": 1e3,
    "angular acceleration": 1e4,
    "mass": 1e3,
    "inertia": 1e4,
    "force": 1e5,
    "torque": 1e4,
    "stiffness": 1e7,
    "damping": 1e5,
    "angular stiffness": 1e7,
    "angular damping": 1e5,
    "rate": 1e4,
    "rate squared": 1e8,
}
"""What no machine that a person holds on to goes beyond: more is a slip of the pen or of the unit."""
SMALLEST = 1e-8
"""Smallest number in SI units, but 0, that is taken for meant."""


class UnitError(ValueError):
    """A text that is no quantity; the message says what to write instead."""


def parse(text: object, dimension: str) -> tuple[float, ...]:
    """Numbers in SI units.

    Args:
        text: one or more numbers and a unit of the dimension.
        dimension: a key of DIMENSIONS.

    Raises:
        UnitError: for anything else, NaN included.
    """
    units = DIMENSIONS[dimension]
    example = f'write e.g. "1.5 {next(iter(units))}"'
    if isinstance(text, int | float) and not isinstance(text, bool):
        raise UnitError(f"{text} has no unit; {example}")
    if not isinstance(text, str):
        raise UnitError(f"{text!r} is no quantity; {example}")
    words = text.split()
    numbers = []
    while words:
        try:
            numbers.append(float(words[0]))
        except ValueError:
            break
        words.pop(0)
    unit = " ".join(words)
    if not numbers:
        raise UnitError(f'"{text}" does not start with a number; {example}')
    if not unit:
        raise UnitError(f'"{text}" has no unit; {example}')
    if unit not in units:
        raise UnitError(f'"{unit}" is no unit of {dimension}; use one of {", ".join(units)}')
    if any(map(isnan, numbers)):
        raise UnitError(f'"{text}" contains a NaN; {example}')
    values = tuple(number * units[unit] for number in numbers)
    if any(LARGEST[dimension] < abs(value) < inf for value in values):
        first = next(iter(units))
        raise UnitError(f'"{text}" is out of range; give at most {LARGEST[dimension]:g} {first}')
    if any(0.0 < abs(value) < SMALLEST for value in values):
        raise UnitError(f'"{text}" is out of range; give 0 or at least {SMALLEST:g}')
    return values


class Quantity(float):
    """One finite number with a unit; subclasses name the dimension and the range."""

    dimension: ClassVar[str]
    minimum: ClassVar[float] = 0.0
    strict: ClassVar[bool] = True
    """Whether the minimum itself is excluded."""

    @classmethod
    def read(cls, text: object) -> Quantity:
        """The quantity that a configuration's value stands for.

        Raises:
            UnitError: for a wrong or missing unit, more than one number, or one out of range.
        """
        numbers = parse(text, cls.dimension)
        if len(numbers) != 1:
            raise UnitError(f'"{text}" holds {len(numbers)} numbers; give one')
        value = numbers[0]
        if not isfinite(value) or value < cls.minimum or (cls.strict and value == cls.minimum):
            relation = ">" if cls.strict else ">="
            raise UnitError(f'"{text}" is out of range; give a finite number {relation} {cls.minimum:g}')
        return cls(value)


class Vector(tuple[float, ...]):
    """Several numbers with one unit; subclasses name dimension, range and, where it is fixed, length."""

    dimension: ClassVar[str]
    length: ClassVar[int | None] = None
    minimum: ClassVar[float] = float("-inf")
    infinite: ClassVar[bool] = False

    @classmethod
    def read(cls, text: object) -> Vector:
        """The vector that a configuration's value stands for.

        Raises:
            UnitError: for a wrong unit, a wrong count, or a number out of range.
        """
        numbers = parse(text, cls.dimension)
        if cls.length is not None and len(numbers) != cls.length:
            raise UnitError(f'"{text}" holds {len(numbers)} numbers; give {cls.length}')
        if not cls.infinite and any(map(isinf, numbers)):
            raise UnitError(f'"{text}" contains inf; give finite numbers')
        if any(number <= cls.minimum for number in numbers if isfinite(number)):
            raise UnitError(f'"{text}" is out of range; give numbers > {cls.minimum:g}')
        return cls(numbers)
