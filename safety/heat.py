"""How much more than its rated torque a motor may give for a time (i2t)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..binding import bind
from ._plausibility import ffi, lib

PLANNED = 0.8
"""Share of a drive's budget that a controller plans with."""
ADMITTED = 0.95
"""The same that the gate lets through: more than is planned, less than makes the drive fold back."""

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Peak:
    """What a drive may give for a time, at the joint [N m or N].

    Attributes:
        rated: for ever.
        torque: for a time.
        seconds: that time [s].
    """

    rated: float
    torque: float
    seconds: float


class Heat:
    """Budgets of motors, (n,): what is above the rated torque fills them, what is below empties them.

    A motor that may give no more for a time keeps its torque.

    Attributes:
        able: what each may give now, (n,) [N m or N].
        used: share of the drive's budget, (n,).
    """

    def __init__(
        self,
        told: Array,
        lasting: Sequence[float],
        peaks: Sequence[Peak | None],
        share: float,
        dt: float,
    ) -> None:
        """Bind to the arrays of others.

        Args:
            told: torques that the motors give, (n,), read where they are.
            lasting: what each may give for ever, at most the rated torque of its peak, (n,).
            peaks: what each may give for a time, (n,).
            share: of a drive's budget that is used, below 1.
            dt: of a tick [s].
        """
        n = len(lasting)
        known = [peak or Peak(most, most, 1.0) for most, peak in zip(lasting, peaks, strict=True)]
        self.able = np.array([max(most, peak.torque) for most, peak in zip(lasting, known, strict=True)])
        self.used = np.zeros(n)
        self._core = ffi.new("heat_budget *", {"n": n, "dt": dt, "share": share})
        bind(
            lib,
            self._core,
            told=told,
            lasting=np.array(lasting, float),
            rated=np.array([peak.rated for peak in known]),
            peak=np.array([peak.torque for peak in known]),
            seconds=np.array([peak.seconds for peak in known]),
            used=self.used,
            able=self.able,
        )

    def take(self, elapsed: int) -> None:
        """What the motors were told was held for so many ticks."""
        lib.heat_take(self._core, elapsed)
