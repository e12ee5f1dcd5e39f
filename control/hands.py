"""From a glove's joints to a hand's drives, and from their currents to its brakes (Bimanual, IV-C)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import expm1, inf

import numpy as np
from numpy.typing import NDArray

from ..models import Array

FILTER_S = 20e-3
"""Time constant of what a brake sees of a current [s]."""
ON, OFF = 0.35, 0.22
"""Currents at which a brake closes, and opens again [A]."""
DWELL_S = 60e-3
"""Time that a brake stays as it is at least [s]."""


@dataclass(frozen=True, slots=True)
class Drive:
    """What one drive of a robot hand follows.

    Attributes:
        weights: of the glove's joints, by their names; most have none.
        offset: [rad].
        lower, upper: range of the drive [rad].
    """

    weights: Mapping[str, float]
    offset: float
    lower: float
    upper: float


class HandMap:
    """Targets of a hand's drives from a glove's joints: y = clip(A x + b), A with a handful of entries a row.

    Attributes:
        target: of the last update, (n,) [rad].
    """

    def __init__(self, joints: Sequence[str], drives: Sequence[Drive]) -> None:
        """Names of the glove's joints in the order of its readings.

        Raises:
            ValueError: a weight of a joint that the glove does not have, or an empty range.
        """
        for drive in drives:
            if unknown := [name for name in drive.weights if name not in joints]:
                raise ValueError(f"the glove has no joint '{unknown[0]}'; it has {', '.join(joints)}")
            if not drive.lower < drive.upper:
                raise ValueError(f"a drive's range from {drive.lower:g} to {drive.upper:g} is empty")
        self._A = np.array([[drive.weights.get(name, 0.0) for name in joints] for drive in drives])
        self._b = np.array([drive.offset for drive in drives])
        self._lower = np.array([drive.lower for drive in drives])
        self._upper = np.array([drive.upper for drive in drives])
        self.target = np.clip(np.zeros(len(drives)), self._lower, self._upper)

    def inside(self, target: Array) -> Array:
        """What of targets (n,) is in range [rad]."""
        return np.clip(target, self._lower, self._upper)

    def update(self, angle: Array) -> Array:
        """Targets for joint angles (20,) [rad]; own buffer. A reading that is no number leaves its drives."""
        wanted = self._A @ np.where(np.isfinite(angle), angle, 0.0) + self._b
        blind = (self._A[:, ~np.isfinite(angle)] != 0.0).any(axis=1)
        np.copyto(self.target, np.clip(wanted, self._lower, self._upper), where=~blind)
        return self.target


class HandLaw:
    """Where the drives of a hand are to be: as the glove has it while it leads, else where it led last.

    A hand that is not led keeps its grasp: what it carries does not fall because a packet is late.

    Attributes:
        target: (n,) [rad].
    """

    def __init__(self, hand: HandMap, speed: float, dt: float) -> None:
        """Map from the glove; largest speed of a target [rad/s]; period [s]."""
        self._map, self._step = hand, speed * dt
        self.target = hand.target.copy()

    def reset(self, position: Array) -> None:
        """Begin where the drives are, (n,) [rad]."""
        np.copyto(self.target, self._map.inside(position), where=np.isfinite(position))

    def update(self, angle: Array, share: float) -> Array:
        """Follow joint angles of the glove (20,) [rad] with a share of the speed, 0 to 1; own buffer."""
        step = share * self._step
        self.target += np.clip(self._map.update(angle) - self.target, -step, step)
        return self.target


def felt_by(drives: Sequence[str], fingers: Sequence[str]) -> list[list[int]]:
    """The drives that each finger feels, by their numbers: those whose names have the finger's in them."""
    return [[i for i, drive in enumerate(drives) if finger in drive.split("_")] for finger in fingers]


class Brakes:
    """Which fingers of a glove are held: those whose drives meet something.

    A bare threshold would chatter with the noise of the current. What a brake sees is filtered, it opens at
    less than it closes at, and stays as it is for a while.

    Attributes:
        closed: (fingers,) bool.
        bits: the same as a word, bit i of finger i.
    """

    def __init__(self, fingers: Sequence[Sequence[int]], dt: float) -> None:
        """The drives whose currents each finger feels, by their numbers; the period [s]."""
        self._fingers = [list(own) for own in fingers]
        self._gain, self._dwell = -expm1(-dt / FILTER_S), round(DWELL_S / dt)
        n = len(fingers)
        self._seen, self._since = [0.0] * n, [self._dwell] * n
        self.closed: NDArray[np.bool_] = np.zeros(n, np.bool_)
        self.bits = 0

    def release(self) -> None:
        """Open all of them at once: a stop, or a link that is gone, waits for nothing."""
        self.closed[:], self.bits = False, 0
        n = len(self._fingers)
        self._seen, self._since = [0.0] * n, [self._dwell] * n

    def update(self, current: Array) -> NDArray[np.bool_]:
        """Take the currents of the drives (n,) [A], positive where they close; own buffer."""
        felt = current.tolist()
        for i, own in enumerate(self._fingers):
            most = max([felt[k] for k in own], default=0.0)
            seen = self._seen[i]
            seen += self._gain * ((most if 0.0 < most < inf else 0.0) - seen)
            self._seen[i] = seen
            self._since[i] += 1
            turns = seen < OFF if self.bits >> i & 1 else seen > ON
            if turns and self._since[i] >= self._dwell:
                self.bits ^= 1 << i
                self.closed[i] ^= True
                self._since[i] = 0
        return self.closed
