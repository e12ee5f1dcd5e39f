"""A redundant interface whose handle is pushed, to tell what of it a hand feels (ContactAware, Table I)."""

from __future__ import annotations

from functools import partial

import msgspec

from ...devices.image import ProcessImage
from ...models import Robot
from ...runtime.configuration.system import Pushed
from ...runtime.core.stages import Mark
from .bodies import surroundings
from .config import RhiConfig
from .machine import RedundantInterface
from .redundant import PLACE

POSTURES = {"free": 0.0, "stiff": 1.0}
"""Phases of the transition that are kept."""


class PushedInterface(RedundantInterface):
    """Renders nothing, and keeps to one of its desired ellipsoids."""

    def __init__(
        self, config: RhiConfig, robot: Robot, image: ProcessImage, mark: Mark, *, phase: float
    ) -> None:
        """``phase``: of the transition, 0 for free motion and 1 for contact."""
        super().__init__(config, robot, image, mark)
        self.environment = surroundings(msgspec.structs.replace(config.rhi, bodies={}), self._arm)
        self.controller.transition.freeze(phase)


def rhi_pushed(config: RhiConfig) -> list[Pushed[RhiConfig]]:
    """In the posture for free motion, and in the one for contact; without redundancy they are one."""
    task, several = config.rhi.task, len(config.rhi.motors.torque) > len(config.rhi.task.directions)
    states = POSTURES.items() if several else [("as it stands", POSTURES["free"])]
    return [
        Pushed(name, partial(PushedInterface, phase=phase), task.directions[:PLACE]) for name, phase in states
    ]
