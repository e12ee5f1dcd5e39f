"""Torques of an avatar arm (Bimanual, (7) and (8)): an impedance that follows, holds and fades."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from ..binding import bind
from ._kernels import ffi, lib
from .limit_avoidance import LimitAvoidance
from .task_arm import TaskArm


@dataclass(frozen=True, slots=True)
class Impedance:
    """S and D of (8), the fade, and what keeps a held pose.

    The goal's lag on a ramp is damping / stiffness: these values give the paper's "up to 200 ms".

    Attributes:
        stiffness, rotational_stiffness: [N/m], [N m/rad].
        damping, rotational_damping: [N s/m], [N m s/rad].
        fade: from the held to the commanded pose [s].
        rate: of the integral that keeps a held pose [1/s]; 0 for none.
        most_force, most_torque: of that integral and of what held the arm before [N], [N m].
        most_pull, most_turn: of the springs, however far the goal is away [N], [N m].
    """

    stiffness: float = 600.0
    rotational_stiffness: float = 30.0
    damping: float = 110.0
    rotational_damping: float = 5.5
    fade: float = 3.0
    rate: float = 2.0
    most_force: float = 20.0
    most_torque: float = 3.0
    most_pull: float = inf
    most_turn: float = inf

    def __post_init__(self) -> None:
        positive = self.stiffness, self.rotational_stiffness, self.damping, self.rotational_damping, self.fade
        if not (min(positive) > 0.0 and min(self.rate, self.most_force, self.most_torque) >= 0.0):
            raise ValueError(f"{self} wants stiffness, damping and fade above 0, the rest not below")

    @property
    def lag(self) -> float:
        """Of the palm behind a goal that moves evenly, D/S of translation [s]."""
        return self.damping / self.stiffness


class AvatarLaw:
    """tau_a = tau_cmd + tau_na + tau_ca + tau_lo about a goal; gravity is the arm's own affair.

    tau_lo, as of the operator arm, is beyond (7): what (6) tells the operator has no part in the null space.

    Before the first command, and whenever commands stop, the goal is the pose of that moment; then it goes to
    the commanded pose within the fade, on a straight line. tau_init of (7) is that same impedance.

    Attributes:
        commanded, commanded_rotation: pose of the palm, (3,) and (3, 3), in the station; write here.
        torque: tau_a, (n,) [N m].
        goal, goal_rotation: of the impedance, (3,) [m] and (3, 3).
        error: pose less goal, rotation as its logarithm in the station's axes, (6,) [m, rad].
        wrench: on the palm in the station's axes, (6,) [N, N m].
    """

    def __init__(self, arm: TaskArm, avoidance: LimitAvoidance, impedance: Impedance, dt: float) -> None:
        """Bind to the arm.

        Args:
            arm: updated before the law is.
            avoidance: of its limits, updated before the law is, too.
            impedance: its constants.
            dt: of a tick [s].
        """
        n, k = arm.n, impedance
        self.commanded, self.commanded_rotation = np.zeros(3), np.eye(3)
        self.torque, self.goal, self.goal_rotation = np.zeros(n), np.zeros(3), np.eye(3)
        self.error, self.wrench = np.zeros(6), np.zeros(6)
        self._core = ffi.new(
            "avatar_law *",
            {
                "n": n,
                "stiffness": [k.stiffness] * 3 + [k.rotational_stiffness] * 3,
                "damping": [k.damping] * 3 + [k.rotational_damping] * 3,
                "rate": k.rate,
                "most_force": k.most_force,
                "most_torque": k.most_torque,
                "most_pull": k.most_pull,
                "most_turn": k.most_turn,
                "dt": dt,
                "fade": k.fade,
            },
        )
        bind(
            lib,
            self._core,
            J=arm.palm.J,
            position=arm.palm.position,
            rotation=arm.palm.rotation,
            twist=arm.twist,
            null=arm.null,
            coriolis=arm.coriolis,
            own=avoidance.torque,
            commanded=self.commanded,
            commanded_rotation=self.commanded_rotation,
            goal=self.goal,
            goal_rotation=self.goal_rotation,
            error=self.error,
            wrench=self.wrench,
            torque=self.torque,
        )
        self._follows = False

    @property
    def share(self) -> float:
        """Of the way from the held to the commanded pose: 0 while it holds, 1 where it follows."""
        return float(self._core.share)

    def reset(self) -> None:
        """Hold the pose of now, and carry nothing over."""
        lib.avatar_law_hold(self._core, False)
        self._follows = False

    def update(self, follow: bool) -> None:
        """Compute the torques of a tick.

        Args:
            follow: whether there is a fresh commanded pose to follow; the tick in which that ends is the one
                whose pose is held.
        """
        if self._follows and not follow:
            lib.avatar_law_hold(self._core, True)
        self._follows = follow
        lib.avatar_law_update(self._core, follow)
