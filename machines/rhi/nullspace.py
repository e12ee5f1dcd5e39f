"""Null-space control of a redundant interface in the tick: ContactAware, (2)-(6), (10), (12)-(16), in C.

``dynamic_inverse`` and ``null_projection`` are the same equations in numpy, for single postures and tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from ...binding import bind, pointer
from ...control._kernels import ffi, lib
from ...models import Array
from .guard import Guard, Span
from .manipulability import Shape, direction
from .redundant import RedundantArm


@dataclass(frozen=True, slots=True)
class Gains:
    """Gains of the secondary torque (6): tau_s = -beta dv/dq - K_d qd.

    Attributes:
        beta: [N m].
        damping: K_d [N m s/rad].
        cap: largest norm of the projected beta dv/dq [N m]; far from the optimum beta asks for more than
            motors have. At the optimum the gradient itself is not 0, only its projection.
        stiffness: of the pull towards known good postures, beyond the paper [N m/rad].
        friction: viscous, of the motors, (n,) [N m s/rad]; what of it the posture's motion puts on the hand
            is cancelled. Empty for none.
        ratio: of the damping about an optimum that the curvature there asks for besides, beyond the paper; 0
            for K_d alone.
        fastest: swing about an optimum [rad/s], to which the pull is weakened; with ``ratio`` only.
    """

    beta: float
    damping: float
    cap: float
    stiffness: float = 0.0
    friction: tuple[float, ...] = ()
    ratio: float = 0.0
    fastest: float = np.inf


def dynamic_inverse(J: Array, M: Array) -> Array:
    """J# = M^-1 J^T (J M^-1 J^T)^-1, (n, m), ContactAware, (4)."""
    X = np.linalg.solve(M, J.T)
    inverse: Array = X @ np.linalg.inv(J @ X)
    return inverse


def null_projection(J: Array, M: Array) -> Array:
    """I - J^T J#^T, (n, n), ContactAware, (3).

    It takes a torque to the nearest one, in the M^-1 metric, that does not accelerate the hand.
    """
    N: Array = np.eye(J.shape[1]) - J.T @ dynamic_inverse(J, M).T
    return N


class NullSpace:
    """Secondary and null-space torque, and their composition with the rendered force.

    A tick is ``secondary``, ``compose``; both read the arm where it is.

    Attributes:
        limit: largest torques of the motors; room: what the weight of the arm leaves of them, above 0; write
            here, (n,) [N m].
        motion, contact: u u^T of the directions of motion and of the environment's force, (m, m); write here.
        free, stiff: postures that free motion and contact pull towards, (n,) [rad]; write here.
        gradient: dv/dq, (n,); secondary_torque: tau_s; null: tau_N, (n,) [N m].
        inverse: J#^T, (m, n); root: L^-1 of M = L L^T, (n, n).
        coupling: force that cancels what the posture's motion does to the hand, (m,) [N].
        wanted: J^T F; torque: composed, (n,) [N m].
        guard: of the joint limits.
    """

    def __init__(
        self,
        arm: RedundantArm,
        limit: Array,
        shape: Shape,
        gains: Gains,
        u: Array,
        span: Span | None = None,
        slew: float = inf,
    ) -> None:
        """Bind to an arm.

        Args:
            arm: the interface.
            limit: torques of its motors, (n,) [N m].
            shape: of the desired ellipsoids.
            gains: of the secondary torque.
            u: first direction of motion and contact, (m,).
            span: limits of the motors; None for none.
            slew: largest rise of ``share`` in a ``compose``; it falls 2.5 times as fast. Where a motor
                saturates, a little more or less of the force would give the posture all or nothing. The
                null-space torques change by no more than twice that part of their limits in a
                ``secondary``.
        """
        n = arm.n
        self.limit = np.array(limit, float)
        self.room = self.limit.copy()
        self.motion, self.contact = direction(u), direction(u)
        self.free, self.stiff = np.zeros(n), np.zeros(n)
        self.gradient, self.secondary_torque, self.null = np.zeros(n), np.zeros(n), np.zeros(n)
        self.wanted, self.torque = np.zeros(n), np.zeros(n)
        self._given, self._asked = np.zeros(n), np.zeros(arm.m)
        self.inverse, self.root = np.zeros((arm.m, n)), np.zeros((n, n))
        self.coupling = np.zeros(arm.m)
        friction = np.array(gains.friction or np.zeros(n), float)
        self.guard = Guard(arm, span or Span.unbounded(n), self.limit, friction, self.inverse, self.root)
        core = self._core = ffi.new(
            "nullspace *", {"n": n, "m": arm.m, "guard": self.guard.core, "slew": slew, "share": 1.0}
        )
        core.major, core.minor = shape.major, shape.minor
        core.beta, core.damping, core.cap, core.stiffness = (
            gains.beta,
            gains.damping,
            gains.cap,
            gains.stiffness,
        )
        self._cap = gains.cap
        core.ratio, core.fastest = gains.ratio, gains.fastest
        bind(lib, core, J=arm.J, dJ=arm.dJ, M=arm.M, q=arm.q, qd=arm.qd, drift=arm.drift, bias=arm.bias)
        bind(
            lib,
            core,
            friction=friction,
            limit=self.limit,
            room=self.room,
            motion=self.motion,
            contact=self.contact,
            free=self.free,
            stiff=self.stiff,
            gradient=self.gradient,
            secondary=self.secondary_torque,
            null=self.null,
            inverse=self.inverse,
            root=self.root,
            coupling=self.coupling,
            wanted=self.wanted,
            torque=self.torque,
            given=self._given,
            asked=self._asked,
        )
        self._force, self._demand = ffi.new("double[]", arm.m), ffi.new("double[]", arm.m)
        self._rows: list[object] = []
        self._eased: object = None

    @property
    def cost(self) -> float:
        """Stein divergence v of the last ``secondary``."""
        return float(self._core.cost)

    @property
    def drive(self) -> float:
        """Norm of the projected pull on the posture, uncapped [N m]."""
        return float(self._core.drive)

    @property
    def alpha(self) -> float:
        """Share of the wanted force that the last ``compose`` let through."""
        return float(self._core.alpha)

    @property
    def share(self) -> float:
        """Share of the null-space torque that found room beside it."""
        return float(self._core.share)

    @property
    def slew(self) -> float:
        """See ``__init__``."""
        return float(self._core.slew)

    @slew.setter
    def slew(self, most: float) -> None:
        self._core.slew = most

    def secondary(self, omega: float) -> bool:
        """Compute tau_s and tau_N for D = omega D_free + (1 - omega) D_stiff; False in a singular posture."""
        return bool(lib.nullspace_secondary(self._core, omega))

    def hurry(self, haste: float) -> None:
        """Let the pull on the posture be so many times the cap."""
        self._core.cap = haste * self._cap

    def want(self, force: Sequence[float]) -> None:
        """Take a force on the hand (m,) [N] and compute J^T F."""
        self._force[0 : len(force)] = force
        lib.nullspace_wanted(self._core, self._force)

    def reserve(self, J: Array, steepness: float) -> float:
        """V of the wanted force in a posture with this Jacobian (m, n), ContactAware, (14)."""
        posture = pointer(J, "const double", self._core.m, self._core.n, name="J")
        return float(lib.nullspace_reserve(self._core, posture, self._force, steepness))

    def level_rows(self, rows: Sequence[Array], gain: float) -> None:
        """Write the rows of a hierarchy over (tau, alpha) and their right-hand sides; see csrc/nullspace.h.

        Args:
            rows: force (m, n + 1) and (m,), limits (n, n + 1), posture (n, n + 1) and (n,); always the same
                arrays.
            gain: as of ``compose``.
        """
        if not self._rows:
            n, m = self._core.n, self._core.m
            shapes = (m, n + 1), (m,), (n, n + 1), (n + 1, n + 1), (n + 1,)
            self._rows = [pointer(a, "double", *shape) for a, shape in zip(rows, shapes, strict=True)]
        lib.nullspace_levels(self._core, gain, *self._rows)

    def within(self, part: float) -> float:
        """Largest share of J^T F, at most 1, that keeps this part (0 to 1) of the limits."""
        return float(lib.nullspace_within(self._core, part))

    def bearable(self, part: float) -> float:
        """The same beside the coupling force and the end stop."""
        return float(lib.nullspace_bearable(self._core, part))

    def reset(self) -> None:
        """No torque has been given yet."""
        self.null[:] = self.torque[:] = self._given[:] = self._asked[:] = 0.0
        self._core.rendered = 1.0

    def compose(self, part: float, gain: float = 1.0) -> None:
        """Write ``torque``: alpha J^T F within this part of the limits, then tau_N with its coupling.

        Args:
            part: of the limits that the force may use, 0 to 1.
            gain: of tau_N, 0 to 1. The posture's motion is there, whatever set it going: its coupling is
                cancelled as a whole. Less of both where there is no room.
        """
        lib.nullspace_compose(self._core, part, gain)

    def ease(self, torque: Array, force: Sequence[float], share: float) -> float:
        """Let torques (n,) [N m] follow what they are to be, in place; returns the share that they render.

        Beyond what the change of the force explains none steps by more than 2.8 ``slew``, as a part of
        ``limit``.

        Args:
            torque: as resolved; always the same array.
            force: of the environment on the hand, (m,) [N].
            share: of it that they render as resolved.
        """
        if self._eased is None:
            self._eased = pointer(torque, "double", self._core.n)
        self._demand[0 : len(force)] = force
        return float(lib.nullspace_ease(self._core, self._demand, share, self._eased))
