"""What a check of the monitor is, and when it need not be asked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from .observation import Observation, Thresholds
from .tally import Tallies, Tally
from .verdict import Verdict


@dataclass(slots=True)
class Trust:
    """How far measurements may be used.

    Attributes:
        wrench: 1 with a valid wrench, fading to 0 without, and back (row 12).
        axes: per axis, whether a stop may steer by what it measures: neither too old nor contradicted.
    """

    wrench: float
    axes: list[bool]


Judge = Callable[[Observation], Verdict]
"""Judges one observation a tick; total, never raises."""


class Check(NamedTuple):
    """A judge, and with what it counts over ticks."""

    judge: Judge
    counts: tuple[Tally | Tallies, ...] = ()


Maker = Callable[[Thresholds, Trust], Check]
"""Makes a check with counters of its own; it may lower the trust in what it finds wanting."""


@dataclass(frozen=True, slots=True)
class Row:
    """A check, and what it looks at.

    Where every field of ``bad`` is empty, zero or False, every one of ``good`` is not, and all its counters
    are idle, its judge passes and changes nothing: it need not be asked. One without fields is always asked.

    Attributes:
        make: makes the check.
        bad, good: fields of the observation.
    """

    make: Maker
    bad: tuple[str, ...] = ()
    good: tuple[str, ...] = ()
