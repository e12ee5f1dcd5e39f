"""Random walls, homes and postures of the simulated redundant interface, all over its reach."""

from __future__ import annotations

from itertools import product
from random import Random

import msgspec
import numpy as np

from ...models import Array, Robot
from ...runtime.configuration.system import Stance
from .config import RhiConfig
from .machine import redundant_arm
from .manipulability import velocity_ellipsoid
from .redundant import AXES, RedundantArm
from .self_motion import scan

INSIDE = 0.1
"""How far inside its limits the machine begins [rad]."""
ROOM = (0.04, 0.1)
"""How far from the wall's point a hand may want to go, along each direction [m]."""
FRONT = 0.02
"""How far in front of the wall a hand begins [m]."""
ALLOWED = 100
"""Postures inside the limits, of COUNT drawn, that every corner of the hand's room has."""
COUNT = 1500
LARGEST_CONDITION = 100.0
"""Of the ellipsoid of a home posture: beyond, the desired ones are lines."""
TRIES = 1000


def rhi_stance(config: RhiConfig, robot: Robot, random: Random) -> Stance[RhiConfig]:
    """Any wall whose surroundings are in reach, any home, either resolution, any posture at the wall.

    Raises:
        ValueError: none was found; the limits leave the machine hardly any room.
    """
    simulation, rhi = config.simulation, config.rhi
    assert simulation is not None
    arm = redundant_arm(config, robot)
    point, room, normal, posture = _wall(config, arm, random)
    rhi = msgspec.structs.replace(
        rhi,
        wall=msgspec.structs.replace(rhi.wall, point=tuple(point.tolist()), normal=tuple(normal)),
        task=msgspec.structs.replace(rhi.task, home=_home(config, arm, random)),
        null_space=msgspec.structs.replace(rhi.null_space, resolution=random.choice(("projection", "hqp"))),
    )
    plant = msgspec.structs.replace(simulation.rhi, posture=tuple(posture.tolist()))
    varied = msgspec.structs.replace(
        config, rhi=rhi, simulation=msgspec.structs.replace(simulation, rhi=plant)
    )
    joints = np.array(rhi.motors.transmission) @ posture
    place = robot.placement(joints, rhi.task.frame)[:3, 3].tolist()
    lower, upper = list(place), list(place)
    for name, x in zip(rhi.task.directions, point.tolist(), strict=True):
        lower[AXES.index(name)], upper[AXES.index(name)] = x - room, x + room
    return Stance(varied, place, lower, upper)


def _wall(config: RhiConfig, arm: RedundantArm, random: Random) -> tuple[Array, float, list[float], Array]:
    """Point, room about it, normal, and a posture that holds the hand in front of it."""
    inside = _bounds(config, INSIDE)
    for _ in range(TRIES):
        (point,), _J = arm.reach(_posture(config, random)[None])
        room = random.uniform(*ROOM)
        corners = [point + room * np.array(signs) for signs in product((-1.0, 1.0), repeat=arm.m)]
        if not all(len(scan(arm, corner, inside, COUNT)) >= ALLOWED for corner in corners):
            continue
        normal = [random.gauss(0.0, 1.0) for _ in range(arm.m)]
        place = point - FRONT * np.array(normal) / np.linalg.norm(normal)
        postures = scan(arm, place, inside, COUNT, random.getrandbits(32))
        if len(postures):
            return point, room, normal, postures[random.randrange(len(postures))]
    raise ValueError(f"no wall in reach in {TRIES} tries: widen rhi.motors.lower and upper")


def _home(config: RhiConfig, arm: RedundantArm, random: Random) -> tuple[float, ...]:
    limit = np.array(config.rhi.motors.torque)
    for _ in range(TRIES):
        q = _posture(config, random)
        if np.linalg.cond(velocity_ellipsoid(arm.at(q).J, limit)) < LARGEST_CONDITION:
            return tuple(q.tolist())
    raise ValueError(f"{TRIES} postures are next to singular: widen rhi.motors.lower and upper")


def _posture(config: RhiConfig, random: Random) -> Array:
    return np.array([random.uniform(*ends) for ends in zip(*_bounds(config, INSIDE), strict=True)])


def _bounds(config: RhiConfig, inside: float) -> tuple[list[float], list[float]]:
    motors = config.rhi.motors
    return [low + inside for low in motors.lower], [high - inside for high in motors.upper]
