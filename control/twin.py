"""Digital twins: the virtual mechanisms whose dynamics the operator feels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ..models import Array
from ._kernels import ffi, lib
from .chain import ALL_DIRECTIONS
from .limits import Limits


class Twin(Protocol):
    """A mechanism with n joints whose end effector E is kept coincident with the handle (HapticGiant, (9)).

    Arrays are the twin's own buffers, valid until the next ``update``.
    """

    limits: Limits
    q: Array
    qd: Array
    J: Array
    drift: Array
    M: Array
    force: Array
    position: Array
    rotation: Array
    twist: Array

    def reset(self, position: Array, rotation: Array) -> None:
        """Rest with E at a pose (3,) [m], (3, 3) in B."""

    def update(self, wrench: Array) -> None:
        """Compute J, drift, M, force, pose and twist of E under a wrench (6,) at E in B [N, N m]."""

    def integrate(self, qdd: Array, dt: float) -> None:
        """Advance q and qd by dt under constant acceleration."""


class CartesianTwin:
    """A free rigid body with isotropic inertia and viscous damping, c = 0: 6 DOF, or some of them.

    Its joint coordinates are translation and, as a quasi-coordinate, rotation along the axes of B, one a
    direction: only their rates matter, since a free body has no position limits. In directions that it
    lacks, the twin does not move.
    """

    def __init__(
        self,
        mass: float,
        inertia: float,
        damping: float,
        rotational_damping: float,
        velocity: tuple[float, float],
        acceleration: tuple[float, float],
        directions: Sequence[int] = ALL_DIRECTIONS,
    ) -> None:
        """Parameters in kg, kg m^2, N s/m, N m s/rad; limits as (linear, angular) in m, rad, s."""
        self._directions = np.array(directions)

        def of_each(linear: float, angular: float) -> Array:
            values: Array = np.repeat([linear, angular], 3)[self._directions]
            return values

        n = len(directions)
        unlimited = np.full(n, np.inf)
        self.limits = Limits(-unlimited, unlimited, of_each(*velocity), of_each(*acceleration))
        self.q, self.qd = np.zeros(n), np.zeros(n)
        self.J, self.drift = np.eye(6)[:, self._directions].copy(), np.zeros(6)
        self.M = np.diag(of_each(mass, inertia))
        self.force = np.zeros(n)
        self.position, self.rotation = np.zeros(3), np.eye(3)
        self._whole = n == 6
        self.twist = self.qd if self._whole else np.zeros(6)
        self._damping = of_each(damping, rotational_damping)
        buffers = (self.position, self.rotation, self.twist)
        self._state = [ffi.from_buffer("double[]", array) for array in buffers]
        self._acceleration = np.zeros(6)
        self._acceleration_buffer = ffi.from_buffer("double[]", self._acceleration)

    def reset(self, position: Array, rotation: Array) -> None:
        """Rest with E at a pose."""
        self.position[:], self.rotation[:] = position, rotation
        self.qd[:] = self.twist[:] = 0.0

    def update(self, wrench: Array) -> None:
        """Force = w - D v; everything else is constant."""
        np.multiply(self._damping, self.qd, out=self.force)
        np.subtract(wrench if self._whole else wrench[self._directions], self.force, out=self.force)

    def integrate(self, qdd: Array, dt: float) -> None:
        """Advance the pose under constant acceleration."""
        self._acceleration[self._directions] = qdd
        lib.rotation_advance_body(*self._state, self._acceleration_buffer, dt)
        if not self._whole:
            self.qd[:] = self.twist[self._directions]
