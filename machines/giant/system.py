"""The giant as a kind of machine."""

from __future__ import annotations

from ...runtime.configuration.system import System
from ..rendering.figures import RenderingFigures
from ..rendering.surroundings import unwatched
from ..rendering.twin import remarks, twin_limits
from .check import check_giant
from .config import GiantConfig
from .limits import GiantLimits
from .machine import Giant
from .parts import foreseen_limits
from .rig import giant_rig
from .scene import GiantScene
from .script import giant_led
from .simulation import giant_plant
from .stance import giant_stance

GIANT = System(
    GiantConfig,
    Giant,
    GiantLimits,
    lambda config: RenderingFigures([spec.unit for spec in twin_limits(config.twins)]),
    giant_plant,
    check_giant,
    giant_stance,
    giant_led,
    GiantScene,
    lambda config, robot: [
        *remarks(config.twins),
        *unwatched(robot, config.look_ahead, foreseen_limits(config)),
    ],
    giant_rig,
)
