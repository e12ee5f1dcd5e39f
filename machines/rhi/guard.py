"""Joint limits of a redundant interface in C: kept by the posture, and at the very end felt by the hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...binding import bind, pointer
from ...control._kernels import ffi, lib
from ...models import Array
from .redundant import RedundantArm

KEPT, STOP, ROOM = 0.5, 0.35, 4.0
"""Distances to a limit, in margins: that the posture keeps, in which the end stop is, from which on a motor
counts fully."""


SPEED = 0.85
"""Part of a motor's speed that the posture keeps."""


@dataclass(frozen=True, slots=True)
class Span:
    """Where the motors may be.

    Attributes:
        lower, upper: (n,) [rad], may be infinite.
        margin: that targets keep to them [rad].
        fastest: speeds, (n,) [rad/s]; empty for any.
    """

    lower: Sequence[float]
    upper: Sequence[float]
    margin: float
    fastest: Sequence[float] = ()

    @classmethod
    def unbounded(cls, n: int) -> Span:
        """Motors that turn freely."""
        return cls((-np.inf,) * n, (np.inf,) * n, 1.0)

    def inside(self, margin: float) -> tuple[Array, Array]:
        """Limits (n,) each, so far inside these [rad]; the middle where that leaves nothing."""
        lower, upper = np.array(self.lower, float), np.array(self.upper, float)
        room = np.minimum(margin, 0.5 * (upper - lower))
        return lower + room, upper - room


class Guard:
    """Linear bounds on the torques for the joint limits, see csrc/guard.h.

    Attributes:
        rows: (n, n); floor, ceiling: floor <= rows tau <= ceiling, (n,) [N m].
        stop: torques of the end stop, (n,) [N m].
    """

    def __init__(
        self, arm: RedundantArm, span: Span, limit: Array, friction: Array, inverse: Array, root: Array
    ) -> None:
        """Bind to an arm and its limits, and to J#^T (m, n) and L^-1 (n, n) of its null space."""
        n = arm.n
        self.rows, self.floor, self.ceiling = np.zeros((n, n)), np.zeros(n), np.zeros(n)
        self.stop, self._add = np.zeros(n), np.zeros(n)
        places = {"kept": KEPT * span.margin, "zone": STOP * span.margin, "room": ROOM * span.margin}
        core: Any = ffi.new("guard *", {"n": n, "m": arm.m, **places})
        self.core = core
        bind(lib, core, J=arm.J, dJ=arm.dJ, M=arm.M, q=arm.q, qd=arm.qd, drift=arm.drift, bias=arm.bias)
        bind(lib, core, lower=np.array(span.lower, float), upper=np.array(span.upper, float))
        fastest = SPEED * np.array(span.fastest, float) if span.fastest else np.full(n, np.inf)
        bind(lib, core, fastest=fastest)
        bind(lib, core, limit=limit, friction=friction, inverse=inverse, root=root)
        bind(lib, core, rows=self.rows, floor=self.floor, ceiling=self.ceiling, stop=self.stop)

    def update(self) -> None:
        """Rows, bounds and end stop for the present state."""
        lib.guard_update(self.core)

    def avoid(self) -> Array:
        """Gradient of what the hand would lose without the motors next to their limits, (n,); own buffer."""
        lib.guard_avoid(self.core, pointer(self._add, "double", self.core.n))
        return self._add

    def hold(self, torque: Array) -> Array:
        """What torques (n,) [N m] need besides so that the posture keeps its limits, (n,); own buffer."""
        n = self.core.n
        asked, add = pointer(torque, "const double", n), pointer(self._add, "double", n)
        lib.guard_hold(self.core, asked, add)
        return self._add
