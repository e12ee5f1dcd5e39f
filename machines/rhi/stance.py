"""Random walls or bodies, homes and postures of the simulated redundant interface, all over its reach."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from random import Random

import msgspec
import numpy as np

from ...configs.quantities import Lengths, Stiffness
from ...models import Array, Robot
from ...runtime.configuration.system import Stance
from .config import RhiBody, RhiConfig, RhiPlane, RhiTissue
from .machine import redundant_arm
from .manipulability import velocity_ellipsoid
from .random_bodies import random_bodies
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
WALL = Stiffness(1000.0)
"""Of a wall where the configuration renders no body [N/m]."""


def rhi_stance(config: RhiConfig, robot: Robot, random: Random) -> Stance[RhiConfig]:
    """Any wall whose surroundings are in reach, any home, either resolution, any posture at the wall.

    Raises:
        ValueError: none was found; the limits leave the machine hardly any room.
    """

    def wall(begin: Beginning) -> dict[str, RhiBody]:
        (name, body), *_ = config.rhi.bodies.items()
        stiffness = body.stiffness if isinstance(body, RhiTissue) else WALL
        normal = tuple(begin.normal.tolist())
        return {name: RhiPlane(stiffness=stiffness, point=Lengths(begin.point.tolist()), normal=normal)}

    return _stance(config, robot, random, wall)


def rhi_bodies(config: RhiConfig, robot: Robot, random: Random) -> Stance[RhiConfig]:
    """The same with one to three bodies of any kind and tissue instead of the wall.

    Raises:
        ValueError: none was found; the limits leave the machine hardly any room.
    """

    def bodies(begin: Beginning) -> dict[str, RhiBody]:
        return random_bodies(random, begin.point, begin.normal, begin.room, begin.hand)

    return _stance(config, robot, random, bodies)


@dataclass(frozen=True, slots=True)
class Beginning:
    """Where a hand begins.

    Attributes:
        point: that it is in front of, (m,) [m]; room: how far from it it may want to go [m].
        normal: from the hand to the point, of any length (m,).
        posture: of the motors, (n,) [rad]; hand: where that holds the hand, (m,) [m].
    """

    point: Array
    room: float
    normal: Array
    posture: Array
    hand: Sequence[float]


def _stance(
    config: RhiConfig,
    robot: Robot,
    random: Random,
    draw: Callable[[Beginning], dict[str, RhiBody]],
) -> Stance[RhiConfig]:
    simulation, rhi = config.simulation, config.rhi
    assert simulation is not None
    arm = redundant_arm(config, robot)
    begin = _begin(config, arm, random)
    point, room, posture = begin.point, begin.room, begin.posture
    bodies = draw(begin)
    rhi = msgspec.structs.replace(
        rhi,
        bodies=bodies,
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


def _begin(config: RhiConfig, arm: RedundantArm, random: Random) -> Beginning:
    """A point whose surroundings are in reach, and a posture that holds the hand in front of it."""
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
            posture = postures[random.randrange(len(postures))]
            return Beginning(point, room, np.array(normal), posture, arm.at(posture).position.tolist())
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
