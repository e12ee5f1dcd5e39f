"""Numbers with units, as a configuration writes them: ``"2.5 2.5 3 rad/s"``."""

from __future__ import annotations

import re
from math import inf, isinf, pi
from typing import ClassVar

from .numerals import number
from .printable import beginning
from .ranges import Range

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

RANGES: dict[str, Range] = {
    "time": Range(1e-6, 1e6, "s", "a microsecond; eleven days"),
    "frequency": Range(1.0, 1e4, "Hz", "no control is slower; no bus is faster"),
    "bit rate": Range(1e3, 2e7, "bit/s", "the slowest transceiver; twice the fastest"),
    "length": Range(1e-6, 20.0, "m", "a hundredth of a hair; a hall"),
    "angle": Range(1e-6, 100.0, "rad", "finer than any encoder; sixteen turns"),
    "speed": Range(1e-3, 20.0, "m/s", "standstill; faster than a person runs"),
    "angular speed": Range(1e-2, 100.0, "rad/s", "standstill; a motor of 1000 rpm without a gear"),
    "acceleration": Range(1e-4, 1e3, "m/s^2", "below any sensor's noise; 100 g"),
    "angular acceleration": Range(1e-2, 1e4, "rad/s^2", "standstill; a finger's motor without a load"),
    "mass": Range(1e-4, 1e3, "kg", "a screw; a gantry"),
    "inertia": Range(1e-8, 1e4, "kg m^2", "a screw; a bridge of 500 kg and 15 m"),
    "force": Range(1e-6, 2e4, "N", "below any sensor's noise; the drive of a gantry"),
    "torque": Range(1e-6, 2e3, "N m", "below any sensor's noise; a machine that carries a person"),
    "stiffness": Range(1e-2, 1e6, "N/m", "a rubber band; steel between two hands"),
    "damping": Range(1e-4, 1e5, "N s/m", "air; a locked guide"),
    "angular stiffness": Range(1e-4, 1e6, "N m/rad", "a hair spring; steel in a gear"),
    "angular damping": Range(1e-6, 1e4, "N m s/rad", "a ball bearing; a locked joint"),
    "rate": Range(1e-3, 1e4, "1/s", "a quarter of an hour; beyond any loop"),
    "rate squared": Range(1e-6, 1e8, "1/s^2", "as rate"),
}
"""Magnitudes, but 0, that a number may have: what no machine that a person holds on to goes beyond, and what
nobody means. More, or less, is a slip of the pen or of the unit."""
MOST_NUMBERS = 64
"""In one vector: no machine has more joints."""
SHOWN = 60
"""Characters of a value that a message repeats."""


class UnitError(ValueError):
    """A text that is not a quantity; the message says what to write instead."""


_INFINITE = {"inf": inf, "+inf": inf, "-inf": -inf}
_MEANT_FOR_A_NUMBER = re.compile(r"[+-]?(nan|inf|[0-9.])[^/]*( |$)", re.IGNORECASE)


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
        raise UnitError(f"{shown(text)} has no unit; {example}")
    if not isinstance(text, str):
        raise UnitError(f"{shown(text)} is not a quantity; {example}")
    words = text.split()
    numbers: list[float] = []
    for word in words:
        value = _INFINITE.get(word, number(word))
        if value is None:
            break
        numbers.append(value)
    unit = " ".join(words[len(numbers) :])
    if _MEANT_FOR_A_NUMBER.match(unit):
        word = words[len(numbers)]
        what = "contains a NaN" if "nan" in word.lower() else f'contains "{shown(word)}", no finite number'
        raise UnitError(f'"{shown(text)}" {what}; {example}')
    if not numbers:
        raise UnitError(f'"{shown(text)}" does not start with a number; {example}')
    if not unit:
        raise UnitError(f'"{shown(text)}" has no unit; {example}')
    if unit not in units:
        raise UnitError(f'"{shown(unit)}" is not a unit of {dimension}; use one of {", ".join(units)}')
    if len(numbers) > MOST_NUMBERS:
        raise UnitError(f"holds {len(numbers)} numbers; give at most {MOST_NUMBERS}")
    return tuple(value * units[unit] for value in numbers)


def shown(value: object) -> str:
    """A value of a file, fit for a message: its beginning, printable."""
    return beginning(value if isinstance(value, str) else repr(value), SHOWN)


def require_range(text: object, values: tuple[float, ...], allowed: Range) -> None:
    """Refuse numbers whose magnitude is not 0 and not in the range; infinite ones pass.

    Raises:
        UnitError: with the range and its reason.
    """
    for value in map(abs, values):
        if allowed.upper < value < inf:
            bound = (
                f"a magnitude of at most {allowed.upper:g}"
                if min(values) < 0.0
                else f"at most {allowed.upper:g}"
            )
        elif 0.0 < value < allowed.lower:
            bound = f"0 or at least {allowed.lower:g}"
        else:
            continue
        raise UnitError(f'"{shown(text)}" is out of range; give {bound} {allowed.unit}: {allowed.why}')


class Quantity(float):
    """One finite number with a unit; subclasses name the dimension and, where it is narrower, the range."""

    dimension: ClassVar[str]
    range: ClassVar[Range | None] = None
    """Range of magnitudes; None: that of the dimension."""
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
            raise UnitError(f'"{shown(text)}" holds {len(numbers)} numbers; give one')
        value = numbers[0]
        if isinf(value) or value < cls.minimum or (cls.strict and value == cls.minimum):
            relation = ">" if cls.strict else ">="
            raise UnitError(
                f'"{shown(text)}" is out of range; give a finite number {relation} {cls.minimum:g}'
            )
        require_range(text, numbers, cls.range or RANGES[cls.dimension])
        return cls(value)


class Vector(tuple[float, ...]):
    """Several numbers with one unit; subclasses name dimension, range and, where it is fixed, length."""

    dimension: ClassVar[str]
    range: ClassVar[Range | None] = None
    length: ClassVar[int | None] = None
    minimum: ClassVar[float] = float("-inf")
    strict: ClassVar[bool] = True
    infinite: ClassVar[bool] = False

    @classmethod
    def read(cls, text: object) -> Vector:
        """The vector that a configuration's value stands for.

        Raises:
            UnitError: for a wrong unit, a wrong count, or a number out of range.
        """
        numbers = parse(text, cls.dimension)
        if cls.length is not None and len(numbers) != cls.length:
            raise UnitError(f'"{shown(text)}" holds {len(numbers)} numbers; give {cls.length}')
        if not cls.infinite and any(map(isinf, numbers)):
            raise UnitError(f'"{shown(text)}" contains inf; give finite numbers')
        finite = [number for number in numbers if not isinf(number)]
        if any(x < cls.minimum or (cls.strict and x == cls.minimum) for x in finite):
            relation = ">" if cls.strict else ">="
            raise UnitError(f'"{shown(text)}" is out of range; give numbers {relation} {cls.minimum:g}')
        require_range(text, numbers, cls.range or RANGES[cls.dimension])
        return cls(numbers)
