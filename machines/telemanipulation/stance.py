"""Where the palms of a person may want to go at a simulated station."""

from __future__ import annotations

from random import Random
from typing import TypeVar

from ...models import Robot
from ...runtime.configuration.system import Stance
from ...runtime.core.sections import Config
from .sections import Hands, Poses

C = TypeVar("C", bound=Config)
BEYOND_M, BEYOND = 0.4, 1.0
"""How far beyond the configured path palms may want to go [m] and turn [rad]: further than the arms reach."""


def station_stance(config: C, robot: Robot, random: Random) -> Stance[C]:
    """As configured; all about the configured path, and limits of joints here and there."""
    assert config.simulation is not None and isinstance(config.simulation.hand, Hands)
    places = [_place(poses) for poses in config.simulation.hand.path]
    ways = list(zip(*places, strict=True))
    beyond = 2 * (*3 * (BEYOND_M,), *3 * (BEYOND,))
    lower = [min(way) - more for way, more in zip(ways, beyond, strict=True)]
    upper = [max(way) + more for way, more in zip(ways, beyond, strict=True)]
    return Stance(config, places[0], lower, upper)


def _place(poses: Poses) -> tuple[float, ...]:
    """Of the right palm, then of the left one: position and directions."""
    return (*poses.position, *poses.turned, *poses.left, *poses.left_turned)
