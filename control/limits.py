"""Limits of a kinematic chain, as the bounds of HapticGiant, section VI-B, take them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..models import Array


@dataclass(frozen=True, slots=True)
class Limits:
    """One entry a joint: positions (may be infinite), speed, acceleration [rad or m, s].

    Raises:
        ValueError: at construction, where an interval is empty or a rating is not positive.
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array

    def __post_init__(self) -> None:
        if not np.all(self.lower < self.upper):
            raise ValueError(f"lower limits {self.lower} are not below upper limits {self.upper}")
        if not (np.all(self.velocity > 0.0) and np.all(self.acceleration > 0.0)):
            raise ValueError(
                f"velocity {self.velocity} and acceleration {self.acceleration} must be positive"
            )

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.lower)
