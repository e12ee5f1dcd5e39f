"""A tick of an arm that renders a twin: force control, joint tracking, and a stop that trusts no sensor."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, hypot

import numpy as np

from ...control.force_control import ForceControl
from ...control.tracking import SeriesElasticity, Tracking
from ...devices.torque_drive import JointDrives
from ...models import Array, Robot
from ...runtime.core.machine import DRIFT
from ...runtime.core.stages import Mark, Stage

AT_REST = 1e-6
"""Commanded speeds below this are standstill [rad/s or m/s]."""
JOINTS_AT_REST = 0.25
"""Measured speeds below this are standstill: a hand goes on pulling at the springs of joints that are held
[rad/s or m/s]."""
STOP_FADE_S = 5e-3
"""Time constant with which the operator's wrench leaves the feedforward of a stop."""
FEEDFORWARD_GAIN = 10.0
"""The feedforward of the operator's wrench fades in so many times as fast as the wrench itself."""


class Rendering:
    """Renders a twin with an arm whose base may move along x and y.

    A tick is ``render`` or ``slow_down``, then ``torque``, then ``advance``.

    Attributes:
        control: the force control.
        felt: wrench of the operator that moves the twin, (6,) [N, N m].
        wrench: the one that the joints hold against, (6,) [N, N m].
        fade: what is left after a tick of what fades out in a stop.
    """

    def __init__(
        self,
        manipulator: Robot,
        control: ForceControl,
        joints: JointDrives,
        elasticity: SeriesElasticity,
        gains: tuple[Array, Array],
        mark: Mark,
        dt: float,
    ) -> None:
        """Motor-side gains of the joints: proportional and derivative, (m,) each."""
        self.control = control
        self.felt, self.wrench = np.zeros(6), np.zeros(6)
        self.fade = exp(-dt / STOP_FADE_S)
        self._mark = mark
        self._tracking = Tracking(
            manipulator,
            control.arm,
            elasticity,
            *gains,
            {
                **{"q": control.q, "qd": control.qd, "qdd": control.qdd, "J": control.handle.J},
                **{"wrench": self.wrench, "motor": joints.position, "motor_rate": joints.velocity},
            },
        )

    @property
    def still(self) -> bool:
        """Whether no joint is commanded to move."""
        return max(map(abs, self.control.qd.tolist())) < AT_REST

    def engage(self, q: Array) -> None:
        """Twin on the handle, everything at rest at measured joints (m,), even a little outside limits."""
        self.control.reset(q)
        self._tracking.reset()

    def render(self, wrench: Array, gain: float, trust: float) -> bool:
        """Motion of arm and twin under the operator's wrench (6,); whether the solver stands by its answer.

        Args:
            wrench: measured, at the handle in B [N, N m].
            gain: 0 to 1, how far it moves the machine while it engages.
            trust: 0 to 1, how far it is believed.
        """
        control = self.control
        np.multiply(wrench, trust * gain, out=self.felt)
        np.multiply(wrench, trust * min(1.0, FEEDFORWARD_GAIN * gain), out=self.wrench)
        control.prepare(self.felt)
        self._mark(Stage.MODEL)
        regular = control.assemble()
        self._mark(Stage.ASSEMBLE)
        solved = regular and control.optimise()
        self._mark(Stage.SOLVE)
        if not regular:
            control.brake()
        return solved

    def slow_down(self) -> None:
        """Joints to rest at their rated accelerations; what the last wrench contributed fades out."""
        np.multiply(self.wrench, self.fade, out=self.wrench)
        self.control.arm.update()
        self.control.brake()

    def torque(self, base: Array) -> list[float]:
        """Motor torques, (m,) [N m or N], on a base with an acceleration (2,) [m/s^2]."""
        torque: list[float] = self._tracking.update(base).tolist()
        return torque

    def advance(self) -> None:
        """Arm and twin over this tick."""
        self.control.advance()


def sensor_pose(robot: Robot, handle: str, sensor: str) -> Array:
    """Pose of the force-torque sensor in the handle's frame, (4, 4) [m]."""
    zero = np.zeros(robot.nv)
    T: Array = np.linalg.inv(robot.placement(zero, handle)) @ robot.placement(zero, sensor)
    return T


def pulled(wrench: Array, scales: Sequence[float]) -> list[str]:
    """A sentence where a sensor with full scales (6,) shows a wrench (6,) at rest, when nobody pulls."""
    (force, *_, torque), values = scales, wrench.tolist()
    if hypot(*values[:3]) <= DRIFT * force and hypot(*values[3:]) <= DRIFT * torque:
        return []
    measured = f"{hypot(*values[:3]):.1f} N and {hypot(*values[3:]):.2f} N m"
    return [f"the handle is pulled with {measured}; let go, or check the sensor and the tool"]
