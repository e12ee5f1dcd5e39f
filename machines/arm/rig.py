"""How an arm is calibrated: the joints are led, and nobody holds the handle."""

from __future__ import annotations

import numpy as np

from ...control.way import Way
from ...devices.image import ProcessImage
from ...models import Array, Robot
from ...runtime.configuration.system import Mount, Rig
from ...runtime.core.stages import Mark
from ..rendering.led import PACE, LedJoints, let_alone
from .config import ArmConfig
from .machine import STILL, SerialArm, joint_sums

MARGIN = 0.03
"""How far poses stay inside the limits: of joints [rad or m], of their sums, and of boxes [m]."""


class LedArm(LedJoints, SerialArm):
    """An arm whose joints are led from place to place; see ``Led``. Everything that stops it stops it."""

    def __init__(self, config: ArmConfig, robot: Robot, image: ProcessImage, mark: Mark) -> None:
        super().__init__(config, robot, image, mark)
        velocity, acceleration = rated(config)
        self._course = self._way = Way(PACE * velocity, PACE * acceleration, 1.0 / config.loop.rate)

    def engage(self) -> None:
        """See ``Machine``."""
        super().engage()
        self.rest_at(self._way, self.force_control.q)

    def update(self, gain: float, trust: float) -> None:
        """One tick on the way; while the machine engages, it stays."""
        self._standstill.reset()
        course = self._course
        if gain >= 1.0:
            course.advance()
        self._rendering.lead(course.q, course.qd, course.qdd, STILL)
        self.astray = self._rendering.astray
        self.overload = self._rendering.overload
        self.commands = self._rendering.torque(STILL)


def rated(config: ArmConfig) -> tuple[Array, Array]:
    """Speeds and accelerations of the joints, (m,) each."""
    joints = config.arm.joints.values()
    velocity, acceleration = (
        np.array([getattr(joint, key) for joint in joints], float) for key in ("velocity", "acceleration")
    )
    return velocity, acceleration


def arm_rig(config: ArmConfig, robot: Robot) -> Rig[ArmConfig]:
    """How an arm is calibrated."""
    assert config.simulation is not None
    arm, simulation = config.arm, config.simulation
    lower, upper = np.array([joint.range for joint in arm.joints.values()], float).T
    sums = joint_sums(config)
    frames = [(box.frame, np.array(box.lower), np.array(box.upper)) for box in arm.boxes or ()]

    def inside(q: Array) -> bool:
        total_inside = (
            total.lower + MARGIN <= float(np.dot(total.weight, q)) <= total.upper - MARGIN for total in sums
        )
        return all(total_inside) and all(
            bool(
                ((at := robot.placement(q, frame)[:3, 3]) >= low + MARGIN).all()
                and (at <= high - MARGIN).all()
            )
            for frame, low, high in frames
        )

    start = np.array([joint.start for joint in simulation.arm.joints.values()], float)
    mount = Mount("force_torque", 0, arm.frames.sensor)
    return Rig(
        let_alone(config),
        LedArm,
        (mount,),
        robot,
        start,
        lower + MARGIN,
        upper - MARGIN,
        *rated(config),
        inside,
    )
