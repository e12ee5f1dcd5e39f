"""Digital twins: the virtual mechanisms whose dynamics the operator feels."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..models import Array
from ._kernels import ffi, lib
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
    """A free rigid body with isotropic inertia and viscous damping: 6 DOF, J = 1, c = 0.

    Its joint coordinates are the translation and, as a quasi-coordinate, the rotation: only their rates
    matter, since a free body has no position limits.
    """

    def __init__(
        self,
        mass: float,
        inertia: float,
        damping: float,
        rotational_damping: float,
        velocity: tuple[float, float],
        acceleration: tuple[float, float],
    ) -> None:
        """Parameters in kg, kg m^2, N s/m, N m s/rad; limits as (linear, angular) in m, rad, s."""
        unlimited = np.full(6, np.inf)
        self.limits = Limits(-unlimited, unlimited, np.repeat(velocity, 3), np.repeat(acceleration, 3))
        self.q, self.qd = np.zeros(6), np.zeros(6)
        self.J, self.drift = np.eye(6), np.zeros(6)
        self.M = np.diag(np.repeat([mass, inertia], 3))
        self.force = np.zeros(6)
        self.position, self.rotation = np.zeros(3), np.eye(3)
        self.twist = self.qd
        self._damping = np.repeat([damping, rotational_damping], 3)
        buffers = (self.position, self.rotation, self.qd)
        self._qdd: Array | None = None
        self._qdd_buffer = ffi.NULL
        self._state = [ffi.from_buffer("double[]", array) for array in buffers]

    def reset(self, position: Array, rotation: Array) -> None:
        """Rest with E at a pose."""
        self.position[:], self.rotation[:] = position, rotation
        self.qd[:] = 0.0

    def update(self, wrench: Array) -> None:
        """Force = w - D v; everything else is constant."""
        np.multiply(self._damping, self.qd, out=self.force)
        np.subtract(wrench, self.force, out=self.force)

    def integrate(self, qdd: Array, dt: float) -> None:
        """Advance the pose under constant acceleration."""
        if qdd is not self._qdd:  # bound once: the caller keeps one array
            self._qdd, self._qdd_buffer = qdd, ffi.from_buffer("double[]", qdd)
        lib.rotation_advance_body(*self._state, self._qdd_buffer, dt)
