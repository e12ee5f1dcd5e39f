"""Springs that joints meet in the last part of their range, brakes before them, less of what drives on."""

from __future__ import annotations

from math import copysign, sqrt

import numpy as np

from ..models import Array


class EndStop:
    """A one-sided spring and damper at each end of every joint, and a brake before them; passive.

    The brake damps what is faster than a joint may be that comes to rest where the spring begins.

    Attributes:
        torque: (n,) [N m].
    """

    def __init__(
        self,
        lower: Array,
        upper: Array,
        stiffness: Array,
        damping: Array,
        deceleration: Array,
        zone: float,
    ) -> None:
        """Bind the limits.

        Args:
            lower: (n,) [rad].
            upper: (n,) [rad].
            stiffness: (n,) [N m/rad].
            damping: against going further only, (n,) [N m s/rad].
            deceleration: with which a joint comes to rest before the spring, (n,) [rad/s^2].
            zone: part of the range at each end in which it acts [rad].
        """
        self._ends = list(zip((lower + zone).tolist(), (upper - zone).tolist(), strict=True))
        self._zone = zone
        self._stiffness, self._damping = stiffness.tolist(), damping.tolist()
        self._deceleration = deceleration.tolist()
        self.torque = np.zeros(len(lower))
        self._acts = False

    def restrain(self, q: Array, torque: Array) -> None:
        """Take from a command what drives a joint on in its zone: a share that grows, to all at the limit.

        A spring alone gives way to a command as strong as it likes: one that follows a palm that is led ever
        further than its arm reaches.

        Args:
            q: (n,) [rad].
            torque: of the command, (n,) [N m], in place.
        """
        for i, (x, (low, high)) in enumerate(zip(q.tolist(), self._ends, strict=True)):
            if low <= x <= high:
                continue
            beyond = x - high if x > high else x - low
            if torque[i] * beyond > 0.0:
                torque[i] *= max(0.0, 1.0 - abs(beyond) / self._zone)

    def update(self, q: Array, qd: Array) -> Array:
        """Torques (n,) [N m] in a state (n,); own buffer."""
        if self._acts:
            self.torque[:] = 0.0
            self._acts = False
        for i, (x, speed, (low, high)) in enumerate(zip(q.tolist(), qd.tolist(), self._ends, strict=True)):
            room = max(0.0, high - x if speed > 0.0 else x - low)
            beyond = x - high if x > high else min(x - low, 0.0)
            square = 2.0 * self._deceleration[i] * room
            if beyond == 0.0 and speed * speed <= square:
                continue
            too_fast = copysign(max(abs(speed) - sqrt(square), 0.0), speed)
            self.torque[i] = -self._stiffness[i] * beyond - self._damping[i] * too_fast
            self._acts = True
        return self.torque
