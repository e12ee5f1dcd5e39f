"""The arm as a kind of machine."""

from __future__ import annotations

from ...runtime.configuration.system import System
from ..rendering.figures import RenderingFigures
from ..rendering.twin import remarks
from .check import check_arm
from .config import ArmConfig
from .limits import ArmLimits
from .machine import SerialArm
from .rig import arm_rig
from .scene import ArmScene
from .script import arm_led
from .simulation import arm_plant

ARM = System(
    ArmConfig,
    SerialArm,
    ArmLimits,
    RenderingFigures,
    arm_plant,
    check_arm,
    led=arm_led,
    scene=ArmScene,
    remarks=lambda config: remarks(config.arm.twin),
    rig=arm_rig,
)
