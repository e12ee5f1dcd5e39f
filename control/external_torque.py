"""What pushes the links of an arm beside the hand at its handle, by their measured motion and loads."""

from __future__ import annotations

import numpy as np

from ..models import Array, Robot
from ._kernels import lib
from .serial import SerialChain

SMOOTH_S = 10e-3
"""Time constant of each of two low-passes on all that is measured [s]."""


class ExternalTorque:
    """Inverse dynamics of the measured motion, less the springs' loads and the operator's wrench.

    Motion and torques pass the same two low-passes in series. Those of the positions give speeds and
    accelerations without differences from tick to tick; since the inertia hardly changes within their time
    constants, both sides of the equation of motion are late by the same. It is no matter what was commanded.

    Attributes:
        torque: unexplained, (n,) [N m or N].
    """

    def __init__(
        self, manipulator: Robot, chain: SerialChain, q: Array, load: Array, J: Array, dt: float
    ) -> None:
        """Bind to the arrays of others.

        Args:
            manipulator: model of the links; viscous friction is its own.
            chain: the same for the tick.
            q: measured links, (n,) [rad or m].
            load: measured between motors and links, (n,) [N m or N].
            J: Jacobian of the handle, (6, n).
            dt: of a tick [s].
        """
        n = manipulator.nv
        self.torque = np.zeros(n)
        self._measured = q, load, J
        self._friction = manipulator.damping
        self._share, self._rate = dt / (dt + SMOOTH_S), 1.0 / SMOOTH_S
        self._still = manipulator.model.gravity.linear.copy()
        self._once, self._twice = np.zeros((2, 2 * n + 2))
        self._q, self._qd, self._qdd = np.zeros((3, n))
        self._gravity, self._rigid = self._still.copy(), np.zeros(n)
        self._dynamics = chain.torque_arguments(self._q, self._qd, self._qdd, self._gravity, self._rigid)
        self._fresh = True

    def reset(self) -> None:
        """Forget what was measured."""
        self._fresh = True

    def update(self, wrench: Array, base: Array) -> Array:
        """The torques (n,) of a tick; own buffer.

        Args:
            wrench: of the operator on the handle in B, (6,) [N, N m].
            base: acceleration of what carries the arm, (2,) [m/s^2].
        """
        q, load, J = self._measured
        n = len(q)
        now = np.concatenate((q, load + wrench @ J, base))
        once, twice = self._once, self._twice
        if self._fresh:
            once[:] = twice[:] = now
            self._fresh = False
        once += self._share * (now - once)
        twice += self._share * (once - twice)
        # a low-pass of backward Euler has this for its rate, exactly
        rate = (now[:n] - once[:n]) * self._rate
        self._q[:] = twice[:n]
        np.multiply(once[:n] - twice[:n], self._rate, out=self._qd)
        np.multiply(rate - self._qd, self._rate, out=self._qdd)
        np.subtract(self._still[:2], twice[2 * n :], out=self._gravity[:2])
        lib.serial_torques(*self._dynamics)
        np.subtract(self._rigid + self._friction * self._qd, twice[n : 2 * n], out=self.torque)
        return self.torque
