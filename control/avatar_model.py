"""Prediction of the avatar's arm on the operator's side, and what its limits make the operator feel."""

from __future__ import annotations

from math import exp, pi

import numpy as np

from ..binding import bind
from ..models import Array, Robot
from ._kernels import ffi, lib
from .limit_avoidance import POSITION, VELOCITY, Avoidance, JointLimits, LimitAvoidance
from .panda_ik import PandaIk
from .serial import SerialChain
from .task_arm import Posture

DAMPING = 0.05
"""Of the inverse in (6): without it 1 N m at a joint becomes up to 2000 N m next to a singularity."""
CUT_OFF = 10.0
"""Of the velocity's low-pass [Hz]; the paper has one and gives no number."""
BEYOND = 0.15
"""How far past the avatar's limits its joints are foreseen [rad]; torques are bounded there."""


class AvatarModel:
    """The avatar's joints as the command will move them, and the wrench that keeps them from their limits.

    Where the commanded pose is out of reach the last joints foreseen stay, and so does what they push with.

    Attributes:
        position, rotation: commanded pose of the avatar's palm, (3,) [m] and (3, 3), in the avatar's frame;
            write here.
        measured: joints of the avatar as they came last, (7,) [rad]; write here.
        q, qd: foreseen, (7,) [rad, rad/s].
        limits: (3) to (5) at the joints foreseen: torque, alpha, near.
        wrench: (J_A^T)^+ tau of (6), at the palm in its axes, (6,) [N, N m].
    """

    def __init__(
        self,
        robot: Robot,
        palm: str,
        posture: Posture,
        lag: float,
        dt: float,
        base: Array | None = None,
        position: Avoidance = POSITION,
        velocity: Avoidance = VELOCITY,
    ) -> None:
        """A model of the avatar's arm.

        Args:
            robot: of the avatar, with the axes of a Panda.
            palm: name of its frame.
            posture: what draws the avatar's elbow home, as its own law has it.
            lag: from a command to the motion that is measured [s]; it says how far the elbow gets.
            dt: of a tick [s].
            base: pose of the robot's base in the frame of the commands, (4, 4).
            position: constants of (3) for positions.
            velocity: constants of (3) for velocities.

        Raises:
            ModelError: its axes are not a Panda's, or there is no such frame.
        """
        n = robot.nv
        self._ik = PandaIk(robot, palm, base, BEYOND)
        self._chain = SerialChain(robot, [palm])
        if base is not None:
            self._chain.mount(base @ robot.model.jointPlacements[1].homogeneous)
        self.position, self.rotation, self.measured = np.zeros(3), np.eye(3), np.zeros(n)
        self.q, self.qd, self.wrench = np.zeros(n), np.zeros(n), np.zeros(6)
        span = JointLimits(robot.lower, robot.upper, robot.velocity)
        self.limits = LimitAvoidance(span, self.q, self.qd, position, velocity)
        wish = {"inertia": posture.damping / lag, "pull": posture.stiffness}
        self._wish = ffi.new("panda_wish *", wish)
        bind(lib, self._wish, start=self.measured, home=np.array(posture.q, float))
        self._core = ffi.new(
            "avatar_model *",
            {
                "n": n,
                "arm": self._ik.core,
                "wish": self._wish,
                "chain": self._chain.pointer,
                "palm": ffi.addressof(self._chain.frame_constants(0)),
                "limits": self.limits.core,
                "dt": dt,
                "share": 1.0 - exp(-2.0 * pi * CUT_OFF * dt),
                "damping": DAMPING,
            },
        )
        bind(
            lib,
            self._core,
            position=self.position,
            rotation=self.rotation,
            q=self.q,
            qd=self.qd,
            wrench=self.wrench,
        )

    @property
    def reached(self) -> bool:
        """Whether the commanded pose is within reach."""
        return bool(self._core.reached)

    def reset(self) -> None:
        """Begin anew: the first joints foreseen have no velocity yet."""
        self._core.begun = False

    def update(self) -> None:
        """Foresee the joints for the present command and measurement."""
        lib.avatar_model_update(self._core)
