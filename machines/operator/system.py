"""The operator as a kind of machine."""

from __future__ import annotations

from ...runtime.configuration.system import System
from ..telemanipulation.limits import StationLimits
from ..telemanipulation.scene import StationScene
from ..telemanipulation.stance import station_stance
from .check import check_operator
from .config import OperatorConfig
from .figures import OperatorFigures
from .machine import OperatorStation
from .plant import operator_plant


def _limits(config: OperatorConfig) -> StationLimits:
    return StationLimits(config.operator)


def _scene(config: OperatorConfig) -> StationScene:
    return StationScene(config.operator, "hand")


OPERATOR = System(
    OperatorConfig,
    OperatorStation,
    _limits,
    lambda config: OperatorFigures(),
    operator_plant,
    check_operator,
    station_stance,
    scene=_scene,
)
"""What hapticd finds by the entry point."""
