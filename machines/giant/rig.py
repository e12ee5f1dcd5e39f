"""How the giant's joints are identified: they are led, the gantry stands, and nobody holds the handle."""

from __future__ import annotations

import numpy as np

from ...control.way import Way
from ...devices.image import ProcessImage
from ...models import Array, Robot
from ...runtime.configuration.system import Rig
from ...runtime.core.stages import Mark
from ..rendering.led import PACE, LedJoints, let_alone
from .config import GiantConfig
from .kinematics import points
from .machine import Giant
from .names import PPU_JOINTS

MARGIN = 0.05
"""How far places stay inside the limits: of joints and their tilt [rad], and of the boxes [m]."""


class LedGiant(LedJoints, Giant):
    """A giant whose joints are led; see ``Led``. Everything that stops it stops it."""

    def __init__(self, config: GiantConfig, robot: Robot, image: ProcessImage, mark: Mark) -> None:
        super().__init__(config, robot, image, mark)
        m = config.giant.manipulator
        velocity, acceleration = (PACE * np.array(each) for each in (m.velocity, m.acceleration))
        self._course = self._way = Way(velocity, acceleration, 1.0 / config.loop.rate)

    def engage(self) -> None:
        """See ``Machine``."""
        super().engage()
        self.rest_at(self._way, self.force_control.q)

    def update(self, gain: float, trust: float) -> None:
        """One tick along; while the machine engages, it stays."""
        self._base[:] = self._observer.qdd
        self._standstill.reset()
        course = self._course
        if gain >= 1.0:
            course.advance()
        self._rendering.lead(course.q, course.qd, course.qdd, self._base)
        self.astray = self._rendering.astray + self._gantry_follows
        self.overload = self._rendering.overload
        self._prepositioning.stop()
        self._command(gain)


def giant_rig(config: GiantConfig, robot: Robot) -> Rig[GiantConfig]:
    """How the giant is led; its sensor is not calibrated by that."""
    assert config.simulation is not None
    giant, simulation = config.giant, config.simulation
    m, box, place = giant.manipulator, giant.box, simulation.giant.ppu

    def inside(q: Array) -> bool:
        handle, elbow = points(q.tolist(), place)
        boxed = [*zip(handle, box.lower, box.upper, strict=True)]
        boxed += zip(elbow[:2], box.lower[:2], box.upper[:2], strict=True)
        return m.tilt[0] + MARGIN <= q[3] + q[4] <= m.tilt[1] - MARGIN and all(
            low + MARGIN <= x <= high - MARGIN for x, low, high in boxed
        )

    lower, upper, velocity, acceleration, start = (
        np.array(each, float)
        for each in (m.lower, m.upper, m.velocity, m.acceleration, simulation.giant.posture)
    )
    return Rig(
        *(let_alone(config), LedGiant, (), robot.without(PPU_JOINTS), start),
        *(lower + MARGIN, upper - MARGIN, velocity, acceleration, inside),
    )
