"""What an avatar's configuration, its model and its plant must agree in."""

from __future__ import annotations

from ...devices.remote_operator import RemoteOperator
from ...models import Robot
from ..rendering.check import Found
from ..telemanipulation.arm import SIDES
from ..telemanipulation.check import check_station
from .config import AvatarConfig


def check_avatar(config: AvatarConfig, robot: Robot) -> Found:
    """What only the model can tell: key, problem, fix."""
    others = {f"{side}_operator": RemoteOperator for side in SIDES}
    found = check_station("avatar", config, config.avatar, config.simulation, robot, others)
    simulation = config.simulation
    for i, wall in enumerate((simulation.walls if simulation else None) or ()):
        if not any(wall.normal):
            found.append((f"simulation.walls[{i}].normal", "points nowhere", "give it a length"))
    return found
