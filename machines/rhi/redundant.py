"""A redundant serial interface in its motors' coordinates: kinematics, their derivatives, inertia."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from ...binding import bind, pointer
from ...control._kernels import ffi, lib
from ...control.serial import Frame, SerialChain
from ...models import Array, ModelError, Robot

AXES = ("x", "y", "z", "rx", "ry", "rz")
"""Directions in which a hand moves, and the axes about which it turns."""
PLACE = 3
"""How many of them say where the hand is."""
LEVER = 0.1
"""Of turns, where nothing else is said [m]."""


class RedundantArm:
    """Task-space quantities of a serial robot whose motors drive its joints through a constant matrix.

    With r = T q (joint angles from motor angles) J = J_r T and M = T^T M_r T + diag(rotor). Where the hand
    turns, too, a turn counts as the way of a point at a lever, so that every force of the task is in newtons.

    Attributes:
        n, m: numbers of motors and of task directions.
        lever: of turns [m].
        q, qd: of the motors, (n,) [rad, s]; write here before ``update``.
        position, velocity: of the hand along the task's directions, (m,) [m, s]; turns from ``reference`` as
            a rotation vector in the base's axes, times the lever.
        reference: orientation of the hand that counts as not turned, (3, 3).
        J: (m, n); dJ: its derivatives by each q_k, (n, m, n).
        M: inertia matrix, (n, n) [kg m^2].
        drift: acceleration of the hand without any of the motors, (m,); bias: torques of the present
            velocities, Coriolis and centrifugal, (n,) [N m].
        weight: torques that hold the arm against the gravity of its model, (n,) [N m].
        rotation: of the hand's frame in the base's, (3, 3).
    """

    def __init__(
        self,
        robot: Robot,
        frame: str,
        task: Sequence[str],
        transmission: Array,
        rotor: Array,
        lever: float = LEVER,
    ) -> None:
        """Take the constants of a robot.

        Args:
            robot: a serial chain with at least as many joints as the task has directions.
            frame: that the hand holds.
            task: distinct names of the first three of AXES, or AXES.
            transmission: T, (n, n), invertible.
            rotor: inertia of the motors, (n,) [kg m^2].
            lever: of turns [m].

        Raises:
            ModelError: no serial chain, no such frame, too few joints, or a T of another shape or rank.
        """
        self._chain = SerialChain(robot, [frame])
        self.n, self.m = self._chain.n, len(task)
        n, m = self.n, self.m
        _require(robot, m <= n, f"{n} joints for {m} directions", "give it at least as many joints")
        _require(
            robot,
            0 < m == len(set(task)) and (set(task) <= set(AXES[:PLACE]) or tuple(task) == AXES),
            f"task {' '.join(task)}",
            "name x, y, z once each, or x, y, z, rx, ry, rz",
        )
        T = np.ascontiguousarray(transmission, float)
        _require(
            robot,
            T.shape == (n, n) and bool(np.linalg.matrix_rank(T) == n),
            f"a transmission of shape {T.shape}",
            f"give {n} independent rows of {n}",
        )
        _require(robot, np.shape(rotor) == (n,), f"{np.size(rotor)} rotor inertias", f"give {n}")
        self.transmission = T
        self.q, self.qd = np.zeros(n), np.zeros(n)
        self.position, self.velocity = np.zeros(m), np.zeros(m)
        self.drift, self.bias, self.weight = np.zeros(m), np.zeros(n), np.zeros(n)
        self.J, self.dJ, self.M = np.zeros((m, n)), np.zeros((n, m, n)), np.zeros((n, n))
        frame_of_hand: Frame = self._chain.frames[0]
        self.rotation = frame_of_hand.rotation
        self._whole, self._at_joints, self._load = frame_of_hand.J, np.zeros(n), np.zeros(n)
        self.lever, self.reference = lever, np.eye(3)
        rows = [AXES.index(name) for name in task]
        self._core = ffi.new("redundant *", {"m": m, "row": rows, "lever": lever})
        self._core.chain, self._core.frame = self._chain.pointer, self._chain.frame_constants(0)
        bind(
            lib,
            self._core,
            {"n": n},
            transmission=T,
            rotor=np.array(rotor, float),
            gravity=np.array(robot.model.gravity.linear, float),
            reference=self.reference.ravel(),
            q=self.q,
            qd=self.qd,
            position=self.position,
            velocity=self.velocity,
            J=self.J,
            dJ=self.dJ,
            M=self.M,
            drift=self.drift,
            bias=self.bias,
            weight=self.weight,
        )

    def update(self) -> None:
        """Compute everything at q and qd."""
        lib.redundant_update(self._core)

    def at(self, q: Array) -> RedundantArm:
        """Update at rest in a configuration (n,); returns itself."""
        self.q[:], self.qd[:] = q, 0.0
        self.update()
        return self

    def refer(self, q: Array) -> None:
        """From now on the hand is not turned in the configuration q (n,), at rest in which it leaves."""
        self.reference[:] = self.at(q).rotation
        self.update()

    def load(self, wrench: Array) -> Array:
        """Torques that a force and a torque on the hand, in any direction, put on the motors, (n,); a buffer.

        Args:
            wrench: in the base's axes, (6,) [N, N m].
        """
        np.matmul(wrench, self._whole, out=self._at_joints)
        np.matmul(self._at_joints, self.transmission, out=self._load)
        return self._load

    def reach(self, q: Array) -> tuple[Array, Array]:
        """Positions (count, m) and Jacobians (count, m, n) of configurations (count, n)."""
        x, J = np.empty((len(q), self.m)), np.empty((len(q), self.m, self.n))
        self._sweep(q, x, J, ffi.NULL)
        return x, J

    def sweep(self, q: Array) -> tuple[Array, Array, Array]:
        """The same, and the derivatives of the Jacobians, (count, n, m, n)."""
        x, J = np.empty((len(q), self.m)), np.empty((len(q), self.m, self.n))
        dJ = np.empty((len(q), self.n, self.m, self.n))
        self._sweep(q, x, J, pointer(dJ, "double", len(q), self.n, self.m, self.n))
        return x, J, dJ

    def approach(self, q: Array, x: Array, steps: int, longest: float, arrived: float) -> None:
        """Move configurations (count, n) in place by Gauss-Newton steps until the hand is at x, (count, m).

        Args:
            q: where to begin [rad].
            x: where the hand shall be [m].
            steps: the most of them.
            longest: the most that a motor turns in one [rad].
            arrived: distance from which one more step is the last [m].
        """
        count = len(q)
        postures = pointer(q, "double", count, self.n)
        hands = pointer(x, "const double", count, self.m)
        lib.redundant_approach(self._core, count, postures, hands, steps, longest, arrived)

    def _sweep(self, q: Array, x: Array, J: Array, dJ: object) -> None:
        count = len(q)
        postures = pointer(np.ascontiguousarray(q, float), "const double", count, self.n)
        hands = pointer(x, "double", count, self.m), pointer(J, "double", count, self.m, self.n)
        lib.redundant_sweep(self._core, count, postures, *hands, dJ)


class Travel:
    """Where the hand is, and how far it has turned: forces and torques work along its differences."""

    def __init__(self, arm: RedundantArm) -> None:
        """Of an arm."""
        self._arm, self._turned, self._before = arm, np.zeros(PLACE), np.eye(PLACE)

    def reset(self) -> None:
        """Not turned yet."""
        self._turned[:], self._before[:] = 0.0, self._arm.rotation

    def update(self) -> list[float]:
        """After the arm's: its position (m,) [m]; of turns the sum of all, as vectors, times the lever."""
        arm = self._arm
        position: list[float] = arm.position.tolist()
        if arm.m <= PLACE:
            return position
        self._turned += arm.lever * pin.log3(arm.rotation @ self._before.T)
        self._before[:] = arm.rotation
        return [*position[:PLACE], *self._turned.tolist()]


def _require(robot: Robot, condition: bool, problem: str, fix: str) -> None:
    if not condition:
        raise ModelError(robot.model.name, 0, problem, fix)
