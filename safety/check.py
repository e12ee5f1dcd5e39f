"""What a check of the monitor is: it judges one observation a tick; total, never raises."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .observation import Observation, Thresholds
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


Check = Callable[[Observation], Verdict]
Maker = Callable[[Thresholds, Trust], Check]
"""Makes a check with counters of its own; it may lower the trust in what it finds wanting."""
