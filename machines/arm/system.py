"""The arm as a kind of machine."""

from __future__ import annotations

from ...runtime.configuration.system import System
from ..rendering.figures import RenderingFigures
from ..rendering.surroundings import unwatched
from ..rendering.twin import remarks, twin_limits
from .check import check_arm
from .config import ArmConfig
from .limits import ArmLimits
from .machine import SerialArm, foreseen_limits
from .rig import arm_rig
from .scene import ArmScene
from .script import arm_led
from .simulation import arm_plant

ARM = System(
    ArmConfig,
    SerialArm,
    ArmLimits,
    lambda config: RenderingFigures([spec.unit for spec in twin_limits(config.twins)]),
    arm_plant,
    check_arm,
    led=arm_led,
    scene=ArmScene,
    remarks=lambda config, robot: [
        *remarks(config.twins),
        *unwatched(robot, config.look_ahead, foreseen_limits(config, robot)),
    ],
    rig=arm_rig,
)
