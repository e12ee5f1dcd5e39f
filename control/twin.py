"""Digital twins: the virtual mechanisms whose dynamics the operator feels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..binding import bind, pointer
from ..models import Array
from ._kernels import ffi, lib
from .chain import ALL_DIRECTIONS
from .limits import Limits


class Twin(Protocol):
    """A mechanism with n joints whose end effector E is kept coincident with the handle (HapticGiant, (9)).

    Arrays are the twin's own buffers, valid until the next ``update``.

    Attributes:
        held: what locks do to its joints, (n,) as ``ChainLevels`` takes it; None without locks.
        partial: whether E lacks directions to move in: ``follow`` does nothing otherwise.
    """

    limits: Limits
    partial: bool
    held: NDArray[np.uint8] | None
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

    def follow(self, position: Array, rotation: Array) -> None:
        """Take over the handle's pose, as for ``reset``, where E has no direction to move in."""

    def update(self, wrench: Array, share: float = 1.0) -> None:
        """Compute J, drift, M, force, pose and twist of E under a wrench (6,) at E in B [N, N m].

        ``share`` is that of what drives the joints besides: 0 to 1, while it fades in.
        """

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
        own = np.array(directions)

        def of_each(linear: float, angular: float) -> Array:
            values: Array = np.repeat([linear, angular], 3)[own]
            return values

        n = len(directions)
        self.held: NDArray[np.uint8] | None = None
        unlimited = np.full(n, np.inf)
        self.limits = Limits(-unlimited, unlimited, of_each(*velocity), of_each(*acceleration))
        self.q, self.qd = np.zeros(n), np.zeros(n)
        self.J, self.drift = np.eye(6)[:, own].copy(), np.zeros(6)
        self.M = np.diag(of_each(mass, inertia))
        self.force = np.zeros(n)
        self.position, self.rotation = np.zeros(3), np.eye(3)
        self.partial = n < 6
        self.twist = np.zeros(6) if self.partial else self.qd
        lacking = sorted(set(ALL_DIRECTIONS) - set(directions))
        self._lacking_places = [i for i in lacking if i < 3]
        self._lacking_turns = [i - 3 for i in lacking if i >= 3]
        self._relative, self._vector = np.eye(3), np.zeros(3)
        self._turn = pointer(self._relative, "double", 3, 3), pointer(self._vector, "double", 3)
        self._core = ffi.new("cartesian_twin *", {"n": n, "direction": tuple(directions)})
        bind(
            lib,
            self._core,
            **{"damping": of_each(damping, rotational_damping), "qd": self.qd, "force": self.force},
            **{"position": self.position, "rotation": self.rotation, "twist": self.twist},
        )
        self._wrench: Array | None = None
        self._qdd: Array | None = None
        self._wrench_pointer: object = None
        self._qdd_pointer: object = None

    def reset(self, position: Array, rotation: Array) -> None:
        """Rest with E at a pose."""
        self.position[:], self.rotation[:] = position, rotation
        self.qd[:] = self.twist[:] = 0.0

    def follow(self, position: Array, rotation: Array) -> None:
        """E differs from the handle in its own directions only: no spring pulls at what nobody renders."""
        if not self.partial:
            return
        self.position[self._lacking_places] = position[self._lacking_places]
        np.matmul(self.rotation, rotation.T, out=self._relative)
        lib.rotation_log(*self._turn)
        self._vector[self._lacking_turns] = 0.0
        lib.rotation_exp(*reversed(self._turn))
        np.matmul(self._relative, rotation, out=self.rotation)

    def update(self, wrench: Array, share: float = 1.0) -> None:
        """Force = w - D v; everything else is constant, and nothing else drives it."""
        if wrench is not self._wrench:  # bound once: it always comes in the same array
            self._wrench, self._wrench_pointer = wrench, pointer(wrench, "const double", 6, name="wrench")
        lib.cartesian_twin_feel(self._core, self._wrench_pointer)

    def integrate(self, qdd: Array, dt: float) -> None:
        """Advance the pose under constant acceleration."""
        if qdd is not self._qdd:
            self._qdd, self._qdd_pointer = qdd, pointer(qdd, "const double", len(self.qd), name="qdd")
        lib.cartesian_twin_advance(self._core, self._qdd_pointer, dt)
