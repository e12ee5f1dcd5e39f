"""Torques of an operator arm (Bimanual, (1) and (2))."""

from __future__ import annotations

import numpy as np

from ..binding import bind
from ..models import Array
from ._kernels import ffi, lib
from .limit_avoidance import LimitAvoidance
from .task_arm import TaskArm


class OperatorLaw:
    """tau_o = alpha tau_cmd + tau_h + tau_lo + tau_la + tau_no + tau_co; gravity is the arm's own affair.

    Attributes:
        torque: tau_o, (n,) [N m].
        command, feedback, avatar: alpha tau_cmd, tau_h and tau_la in it, (n,) [N m].
    """

    def __init__(
        self,
        arm: TaskArm,
        avoidance: LimitAvoidance,
        hand: Array,
        felt: Array,
        limits: Array,
        assist: float = 1.0,
    ) -> None:
        """Bind to what the law reads where it is.

        Args:
            arm: updated before the law is.
            avoidance: of its limits, updated before the law is, too.
            hand: wrench of the operator on the palm, (6,) [N, N m], in the palm's axes like the others.
            felt: wrench of the avatar's world on its palm.
            limits: that pushes the avatar away from its limits, (6).
            assist: gain of (2); 1 is the paper's.
        """
        n = arm.n
        self.torque, self.command = np.zeros(n), np.zeros(n)
        self.feedback, self.avatar = np.zeros(n), np.zeros(n)
        self._core = ffi.new("operator_law *", {"n": n, "assist": assist})
        bind(
            lib,
            self._core,
            J=arm.palm.J,
            rotation=arm.palm.rotation,
            hand=hand,
            felt=felt,
            limits=limits,
            alpha=avoidance.alpha,
            own=avoidance.torque,
            null=arm.null,
            coriolis=arm.coriolis,
            command=self.command,
            feedback=self.feedback,
            avatar=self.avatar,
            torque=self.torque,
        )

    def update(self) -> None:
        """Compute the torques for the present state and wrenches."""
        lib.operator_law_update(self._core)
