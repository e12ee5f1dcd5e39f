"""How far the motors are from their limits, and torques scaled so that none passes one (ContactAware, III-B).

Everything but ``Headroom`` takes stacks of torques, (..., n).
"""

from __future__ import annotations

import numpy as np

from ...models import Array

TAKEN = 3.0
"""Pull that takes force back over the pull that lets it go: a posture swings about its target once."""


def reserve(torque: Array, limit: Array, steepness: float) -> Array:
    """Actuator saturation observer V in [0, 1], (...,): 1 without torque, 0 where any motor saturates.

    ContactAware, (14), for symmetric limits: V = (1 - exp(-S p)) / (1 - exp(-S)), p = prod_i (1 - (tau_i /
    limit_i)^2). Torques beyond a limit count as on it; otherwise two of them would give a positive V.
    """
    share = np.clip(np.asarray(torque) / limit, -1.0, 1.0)
    p = np.prod(1.0 - share**2, axis=-1)
    V: Array = np.expm1(-steepness * p) / np.expm1(-steepness)
    return V


def force_share(torque: Array, limit: Array) -> Array:
    """Largest alpha <= 1 for which alpha torque keeps the limits, (...,): the force keeps its direction."""
    worst = np.max(np.abs(torque) / limit, axis=-1)
    alpha: Array = 1.0 / np.maximum(worst, 1.0)
    return alpha


def force_limit(J: Array, limit: Array, u: Array) -> Array:
    """Exact force polytope: largest f for which J^T u f keeps the limits, (...,) [N].

    Args:
        J: (..., m, n).
        limit: (n,) [N m].
        u: unit vector, (m,).
    """
    demand = np.max(np.abs(np.einsum("...ai,a->...i", J, u)) / limit, axis=-1)
    f: Array = 1.0 / np.maximum(demand, 1e-12)
    return f


class Headroom:
    """Part of the limits that the rendered force may use while the posture is still on its way.

    A saturated force would leave the null space nothing, and the reconfiguration that makes room for more
    force would stall half-way. The part follows the pull on the posture with a play: what has been let go is
    taken back only by TAKEN times the pull, and nothing is let go or taken back at once. Otherwise the force,
    which moves the posture, would take itself back.

    Attributes:
        part: 0 to 1.
    """

    def __init__(self, held: float, moving: float, release: float, dt: float) -> None:
        """Part that is held, drive of the null space from which it is [N m], time to let go of it [s]."""
        self._held, self._moving = held, moving
        self._step = (1.0 - held) * dt / release
        self.part = 1.0

    def reset(self) -> None:
        """Everything may be used."""
        self.part = 1.0

    def update(self, drive: float, turning: bool = False) -> float:
        """The part for this tick.

        Args:
            drive: norm of the projected gradient torque [N m].
            turning: whether the posture is to turn to contact. Its targets only begin to move then, so that
                they hardly pull, and a force that has taken all torques would let none of it begin.
        """
        pull, part = max(drive / self._moving, TAKEN if turning else 0.0), self.part
        wanted = 1.0 if pull <= 0.5 else min(max(part, self._within(pull)), self._within(pull / TAKEN))
        if wanted != part:
            self.part = min(max(wanted, part - self._step), part + self._step)
        return self.part

    def _within(self, drive: float) -> float:
        """All below a half, what is held from 1 on."""
        return 1.0 - (1.0 - self._held) * min(max(2.0 * drive - 1.0, 0.0), 1.0)
