"""What an operator station's configuration, its model and its plant must agree in."""

from __future__ import annotations

from ...devices.buttons import Buttons
from ...devices.remote_avatar import RemoteAvatar
from ...models import Robot
from ..rendering.check import Found
from ..telemanipulation.arm import SIDES
from ..telemanipulation.check import check_station
from .config import OperatorConfig


def check_operator(config: OperatorConfig, robot: Robot) -> Found:
    """What only the model can tell: key, problem, fix."""
    own = config.operator
    others = {**{f"{side}_avatar": RemoteAvatar for side in SIDES}, "buttons": Buttons}
    return check_station("operator", config, own, config.simulation, robot, others)
