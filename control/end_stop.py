"""Springs that joints meet in the last part of their range, and that no command is stronger than for long."""

from __future__ import annotations

import numpy as np

from ..models import Array


class EndStop:
    """A one-sided spring and damper at each end of every joint; passive, and nothing in between.

    Attributes:
        torque: (n,) [N m].
    """

    def __init__(self, lower: Array, upper: Array, stiffness: Array, damping: Array, zone: float) -> None:
        """Bind the limits.

        Args:
            lower: (n,) [rad].
            upper: (n,) [rad].
            stiffness: (n,) [N m/rad].
            damping: against going further only, (n,) [N m s/rad].
            zone: part of the range at each end in which it acts [rad].
        """
        self._ends = list(zip((lower + zone).tolist(), (upper - zone).tolist(), strict=True))
        self._stiffness, self._damping = stiffness.tolist(), damping.tolist()
        self.torque = np.zeros(len(lower))
        self._acts = False

    def update(self, q: Array, qd: Array) -> Array:
        """Torques (n,) [N m] in a state (n,); own buffer."""
        if self._acts:
            self.torque[:] = 0.0
            self._acts = False
        for i, (x, (low, high)) in enumerate(zip(q.tolist(), self._ends, strict=True)):
            if low <= x <= high:
                continue
            speed = float(qd[i])
            beyond, outwards = (x - high, max(speed, 0.0)) if x > high else (x - low, min(speed, 0.0))
            self.torque[i] = -self._stiffness[i] * beyond - self._damping[i] * outwards
            self._acts = True
        return self.torque
