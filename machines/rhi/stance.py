"""Random postures of the simulated redundant interface near the configured one."""

from __future__ import annotations

from random import Random

import msgspec
import numpy as np

from ...models import Robot
from ...runtime.configuration.system import Stance
from .config import RhiConfig

SPREAD = 0.15
"""Spread of each motor about its configured posture [rad]."""
BEYOND = 0.02
"""How far outside its configured path a hand may want to go [m]."""


def rhi_stance(config: RhiConfig, robot: Robot, random: Random) -> Stance[RhiConfig]:
    """A posture near the configured one; the hand keeps near the configured path, wall included."""
    simulation, motors = config.simulation, config.rhi.motors
    assert simulation is not None
    posture = tuple(
        min(max(q + random.uniform(-SPREAD, SPREAD), low), high)
        for q, low, high in zip(simulation.rhi.posture, motors.lower, motors.upper, strict=True)
    )
    joints = np.array(motors.transmission) @ np.array(posture)
    place = robot.placement(joints, config.rhi.task.frame)[:3, 3].tolist()
    plant = msgspec.structs.replace(simulation.rhi, posture=posture)
    varied = msgspec.structs.replace(config, simulation=msgspec.structs.replace(simulation, rhi=plant))
    ways = list(zip(*(point.position for point in simulation.hand.path), strict=True))
    free = ["xyz"[i] in config.rhi.task.directions for i in range(3)]
    lower = [min(way) - BEYOND if f else place[i] for i, (way, f) in enumerate(zip(ways, free, strict=True))]
    upper = [max(way) + BEYOND if f else place[i] for i, (way, f) in enumerate(zip(ways, free, strict=True))]
    return Stance(varied, place, lower, upper)
