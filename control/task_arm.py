"""An arm as the laws of telemanipulation see it: palm, inertia, Coriolis and gravity, the elbow's posture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..binding import bind
from ..models import Array, Robot
from ._kernels import ffi, lib
from .serial import SerialChain

GRAVITY = (0.0, 0.0, -9.81)
"""In a base that stands upright [m/s^2]."""


@dataclass(frozen=True, slots=True)
class Posture:
    """What draws the elbow home in the null space of the palm.

    Attributes:
        q: convenient joint positions, (n,) [rad].
        stiffness: [N m/rad]; damping: [N m s/rad].
    """

    q: Array
    stiffness: float = 10.0
    damping: float = 2.0


class TaskArm:
    """State and model of an arm in the tick; everything in the axes of its base.

    The base is where the station puts it: ``base`` makes that the station's own frame.

    Attributes:
        n: number of joints.
        q, qd: state that is read where it is, (n,).
        palm: position (3,), rotation (3, 3), J (6, n) of the palm's frame.
        twist: of the palm, (6,).
        M: (n, n).
        coriolis: torques of the present velocities, tau_co, (n,); weight: those that carry the arm, (n,).
        null: torque that draws the elbow home, without accelerating the palm, tau_no, (n,).
    """

    def __init__(
        self,
        robot: Robot,
        palm: str,
        q: Array,
        qd: Array,
        posture: Posture,
        base: Array | None = None,
        gravity: tuple[float, float, float] = GRAVITY,
    ) -> None:
        """Bind to the joints' state.

        Args:
            robot: a serial chain.
            palm: name of its frame.
            q: (n,) [rad].
            qd: (n,) [rad/s].
            posture: of the elbow.
            base: pose of the robot's base in the station's frame, (4, 4); None where they are one.
            gravity: in the station's frame [m/s^2].

        Raises:
            ModelError: it is no serial chain, or has no such frame.
        """
        n = self.n = robot.nv
        self.chain = SerialChain(robot, [palm])
        if base is not None:
            self.chain.mount(base @ robot.model.jointPlacements[1].homogeneous)
        self.q, self.qd, self.palm = q, qd, self.chain.frames[0]
        self.twist, self.M = np.zeros(6), np.zeros((n, n))
        self.coriolis, self.weight, self.null = np.zeros(n), np.zeros(n), np.zeros(n)
        self.posture = np.array(posture.q, float)
        self._core = ffi.new(
            "task_arm *",
            {
                "chain": self.chain.pointer,
                "palm": ffi.addressof(self.chain.frame_constants(0)),
                "n": n,
                "gravity": gravity,
                "stiffness": posture.stiffness,
                "damping": posture.damping,
            },
        )
        bind(
            lib,
            self._core,
            posture=self.posture,
            q=q,
            qd=qd,
            twist=self.twist,
            M=self.M,
            coriolis=self.coriolis,
            weight=self.weight,
            null=self.null,
        )

    def update(self) -> None:
        """Compute everything for the present state."""
        lib.task_arm_update(self._core)
