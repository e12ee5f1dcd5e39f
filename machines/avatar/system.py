"""The avatar as a kind of machine."""

from __future__ import annotations

from ...runtime.configuration.system import System
from ..telemanipulation.limits import StationLimits
from ..telemanipulation.scene import StationScene
from ..telemanipulation.stance import station_stance
from .check import check_avatar
from .config import AvatarConfig
from .figures import AvatarFigures
from .machine import AvatarStation
from .plant import avatar_plant


def _limits(config: AvatarConfig) -> StationLimits:
    return StationLimits(config.avatar)


def _scene(config: AvatarConfig) -> StationScene:
    return StationScene(config.avatar, "wrench")


AVATAR = System(
    *(AvatarConfig, AvatarStation, _limits, lambda config: AvatarFigures(), avatar_plant, check_avatar),
    stance=station_stance,
    scene=_scene,
)
"""What hapticd finds by the entry point."""
