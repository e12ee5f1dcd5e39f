"""How an arm is calibrated: the joints are led, and nobody holds the handle."""

from __future__ import annotations

import msgspec
import numpy as np

from ...configs.quantities import Duration, Instant
from ...control.way import Way
from ...devices.image import ProcessImage
from ...models import Array, Robot
from ...runtime.configuration.system import Course, Mount, Rig
from ...runtime.core.sections import Arming, Press
from ...runtime.core.stages import Mark
from ..rendering.sections import Away
from .config import ArmConfig
from .machine import STILL, SerialArm, joint_sums

PACE = 0.4
"""Part of the joints' rated speeds and accelerations: a person stands beside the arm."""
MARGIN = 0.03
"""How far poses stay inside the limits: of joints [rad or m], of their sums, and of boxes [m]."""
PRESSED = Instant(0.3)
"""When the dead-man switch is pressed [s]."""


class LedArm(SerialArm):
    """An arm whose joints are led from place to place; see ``Led``. Everything that stops it stops it."""

    def __init__(self, config: ArmConfig, robot: Robot, image: ProcessImage, mark: Mark) -> None:
        super().__init__(config, robot, image, mark)
        velocity, acceleration = rated(config)
        self._way = Way(PACE * velocity, PACE * acceleration, 1.0 / config.loop.rate)
        self._course: Course = self._way

    @property
    def arrived(self) -> bool:
        """See ``Led``."""
        return self._course.arrived

    def go(self, q: Array) -> None:
        """See ``Led``."""
        self._way.rest(self._course.q.copy())
        self._way.go(q)
        self._course = self._way

    def follow(self, course: Course) -> None:
        """See ``Led``."""
        self._course = course

    def unrest(self, first: bool) -> list[str]:
        """What a sensor shows that is not calibrated says nothing."""
        return []

    def engage(self) -> None:
        """See ``Machine``."""
        super().engage()
        self._way.rest(self.force_control.q)
        self._course = self._way

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

    away = Away(Instant(0.0), Duration(1e6))
    hand = msgspec.structs.replace(simulation.hand, away=(away,), dead_man=(Press(PRESSED, True),))
    calm = msgspec.structs.replace(
        config,
        arming=Arming("dead-man", config.arming.fade),
        simulation=msgspec.structs.replace(simulation, hand=hand),
    )
    start = np.array([joint.start for joint in simulation.arm.joints.values()], float)
    mount = Mount("force_torque", 0, arm.frames.sensor)
    return Rig(calm, LedArm, (mount,), robot, start, lower + MARGIN, upper - MARGIN, *rated(config), inside)
