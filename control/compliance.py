"""Compliance of joints that something pushes which the sensor at the handle does not explain.

HapticGiant names it as future work: a task for unintended collisions.
"""

from __future__ import annotations

import numpy as np

from ..models import Array

RESPONSE_S = 20e-3
"""Within this time a joint takes the speed that is asked of it [s]."""
WARY = 0.5
"""From this part of the threshold on a joint moves ever slower against what pushes it; at the threshold it
stands."""


class Compliance:
    """What accelerations leave room for pushes on the links.

    What something else than the operator pushes with, r, is known (``ExternalTorque``). From ``WARY`` of a
    threshold on a joint moves against it no faster than a speed that falls from its largest to 0, and beyond
    the threshold it gives way with a speed that grows with what is beyond. Where a link is blocked, that
    decays with the time constant ``relax``, for each rad that the reference of a held joint gives way takes
    1 / yielding from its torque.

    Attributes:
        external: r, (m,) [N m or N].
        excess: what of it is beyond the threshold, (m,).
        least, most: of the accelerations, (m,) [rad/s^2 or m/s^2]; infinite where nothing pushes.
    """

    def __init__(
        self,
        threshold: Array,
        yielding: Array,
        velocity: Array,
        acceleration: Array,
        relax: float,
    ) -> None:
        """For m joints.

        Args:
            threshold: (m,) [N m or N].
            yielding: of a held joint under a push, (m,) [rad/(N m) or m/N].
            velocity: largest speeds, (m,) [rad/s or m/s].
            acceleration: the same, (m,).
            relax: see above [s].
        """
        m = len(threshold)
        self.external, self.excess = np.zeros(m), np.zeros(m)
        self.least, self.most = np.full(m, -np.inf), np.full(m, np.inf)
        self._threshold, self._velocity, self._acceleration = threshold, velocity, acceleration
        self._gives = yielding / relax

    def reset(self) -> None:
        """Nothing pushes, as far as is known."""
        self.external[:] = self.excess[:] = 0.0
        self.least[:], self.most[:] = -np.inf, np.inf

    def update(self, external: Array, qd: Array) -> None:
        """Bounds of this tick from the torques of a push, and the commanded speeds, (m,) each."""
        self.external[:] = external
        size = np.abs(self.external)
        beyond = np.maximum(size - self._threshold, 0.0)
        np.copysign(beyond, self.external, out=self.excess)
        slower = self._velocity * (1.0 - size / self._threshold) / (1.0 - WARY)
        # least speed along the push, which a joint may also have by itself
        speed = np.where(beyond > 0.0, self._gives * beyond, -np.maximum(slower, 0.0))
        along = np.sign(self.external)
        needed = np.minimum((speed - along * qd) / RESPONSE_S, self._acceleration)
        pushed = size > WARY * self._threshold
        self.least[:] = np.where(pushed & (along > 0.0), needed, -np.inf)
        self.most[:] = np.where(pushed & (along < 0.0), -needed, np.inf)
