"""Random walls or bodies, homes and postures of the simulated redundant interface, all over its reach."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import hypot
from random import Random

import msgspec
import numpy as np

from ...configs.quantities import Lengths, Stiffness
from ...models import Array, Robot
from ...runtime.configuration.system import Stance
from .body_check import SHORTEST
from .config import RhiBody, RhiConfig, RhiPlane, RhiTissue
from .machine import redundant_arm
from .manipulability import velocity_ellipsoid
from .random_bodies import random_bodies
from .reachable import lead
from .redundant import AXES, PLACE, RedundantArm
from .sampled_walls import check_walls
from .self_motion import CLOSED, Bounds, close, scan

INSIDE = 0.1
"""How far inside its limits the machine begins [rad]."""
ROOM = (0.04, 0.1)
"""How far from the wall's point a hand may want to go, along each direction [m]."""
TURN = 0.25
"""How far it may want to turn the handle about each axis [rad]."""
FRONT = 0.02
"""How far in front of the wall a hand begins [m]."""
ALLOWED = 100
"""Postures inside the limits, of COUNT drawn, that every corner of the hand's room has."""
COUNT = 1500
LARGEST_CONDITION = 100.0
"""Of the ellipsoid of a home posture: beyond, the desired ones are lines."""
LARGEST_TURNING = 600.0
"""The same with turns, whose torques and forces a lever compares; few postures have less than 200."""
SINGULAR = 1e6
"""Of any, beyond which it is refused: ``check``."""
NEAR = 0.3
"""How far from home towards any posture a hand begins that only one posture holds."""
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
        ValueError: none was found; the limits leave the machine hardly any room, or the rate is too low.
    """

    def bodies(begin: Beginning) -> dict[str, RhiBody]:
        for _ in range(TRIES):
            drawn = random_bodies(random, begin.point, begin.normal, begin.room, begin.hand)
            varied = msgspec.structs.replace(config.rhi, bodies=drawn)
            if not check_walls(msgspec.structs.replace(config, rhi=varied), robot):
                return drawn
        raise ValueError(f"in {TRIES} tries no bodies are soft enough for the rate: raise loop.rate")

    return _stance(config, robot, random, bodies)


@dataclass(frozen=True, slots=True)
class Beginning:
    """Where a hand begins.

    Attributes:
        point: that it is in front of, (m,) or (3,) [m]; room: how far from it it may want to go [m].
        normal: from the hand to the point, of any length, (m,) or (3,).
        posture: of the motors, (n,) [rad]; hand: where that holds the hand, or the foremost point of what it
            holds, (m,) or (3,) [m].
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
    arm, home = redundant_arm(config, robot), None
    if arm.m > PLACE:  # which also says how the hand is turned
        home = _home(config, arm, random)
        arm.refer(np.array(home))
    begin = _begin(config, arm, random, home)
    point, room, posture = begin.point, begin.room, begin.posture
    bodies = draw(begin)
    rhi = msgspec.structs.replace(
        rhi,
        bodies=bodies,
        task=msgspec.structs.replace(rhi.task, home=home or _home(config, arm, random)),
        null_space=msgspec.structs.replace(rhi.null_space, resolution=random.choice(("projection", "hqp"))),
    )
    plant = msgspec.structs.replace(simulation.rhi, posture=tuple(posture.tolist()))
    varied = msgspec.structs.replace(
        config, rhi=rhi, simulation=msgspec.structs.replace(simulation, rhi=plant)
    )
    joints = np.array(rhi.motors.transmission) @ posture
    place = robot.placement(joints, rhi.task.frame)[:3, 3].tolist()
    lower, upper = list(place), list(place)
    tip = _foremost(config, arm, begin.normal)
    for name, x in zip(rhi.task.directions[:PLACE], (point - tip).tolist(), strict=True):
        lower[AXES.index(name)], upper[AXES.index(name)] = x - room, x + room
    if arm.m <= PLACE:
        return Stance(varied, place, lower, upper, turns=False)
    still, most = [0.0] * PLACE, [TURN] * PLACE
    return Stance(varied, place + still, lower + [-x for x in most], upper + most)


def _begin(config: RhiConfig, arm: RedundantArm, random: Random, home: Sequence[float] | None) -> Beginning:
    """A point whose surroundings are in reach, and a posture that holds the hand in front of it."""
    inside, moving = _bounds(config, INSIDE), min(arm.m, PLACE)
    turning = (
        inside if arm.m == moving else _bounds(config, INSIDE + TURN)
    )  # what turns may need of the motors
    still = (0.0,) * (arm.m - moving)
    for _ in range(TRIES):
        drawn = _posture(config, random)[None]
        if home is not None and arm.n == arm.m:  # nothing else turns the hand back to how home holds it
            drawn = np.array(home) + random.uniform(0.0, NEAR) * (drawn - home)
        (point,), _J = arm.reach(drawn)
        point[moving:] = 0.0
        room = random.uniform(*ROOM)
        corners = [point + room * np.array((*signs, *still)) for signs in product((-1.0, 1.0), repeat=moving)]
        if arm.n > arm.m:
            if not all(len(scan(arm, corner, turning, COUNT)) >= ALLOWED for corner in corners):
                continue
        elif not _follows(arm, drawn, point, turning, corners):
            continue
        normal = _direction(random, moving)
        place = point.copy()
        place[:moving] -= FRONT * np.array(normal) / np.linalg.norm(normal)
        if arm.n > arm.m:
            postures = scan(arm, place, inside, COUNT, random.getrandbits(32))
        else:
            good, led = lead(arm, close(arm, drawn, point), point, inside, place - point)
            postures = led[good]
        if len(postures):
            posture = postures[random.randrange(len(postures))]
            hand, tip = arm.at(posture).position[:moving], _foremost(config, arm, np.array(normal))
            return Beginning(point[:moving] + tip, room, np.array(normal), posture, (hand + tip).tolist())
    raise ValueError(f"no wall in reach in {TRIES} tries: widen rhi.motors.lower and upper")


def _follows(arm: RedundantArm, drawn: Array, point: Array, bounds: Bounds, places: Sequence[Array]) -> bool:
    """Whether a posture (1, n) that nothing but the hand turns is at a point and can follow to all places."""
    q = close(arm, drawn, point)
    if np.linalg.norm(arm.reach(q)[0][0] - point) > CLOSED:
        return False
    return all(bool(lead(arm, q, point, bounds, place - point)[0][0]) for place in places)


def _direction(random: Random, m: int) -> list[float]:
    """Any direction, of a length that a configuration may have, (m,)."""
    while True:
        found = [random.gauss(0.0, 1.0) for _ in range(m)]
        if hypot(*found) > SHORTEST:
            return found


def _foremost(config: RhiConfig, arm: RedundantArm, into: Array) -> Array:
    """From the hand to the point of its tool that is first in a direction (3,); nothing without turns."""
    if arm.m <= PLACE or config.rhi.task.tool is None:
        return np.zeros(min(arm.m, PLACE))
    points: Array = np.array(config.rhi.task.tool) @ arm.reference.T
    found: Array = points[np.argmax(points @ into)]
    return found


def _home(config: RhiConfig, arm: RedundantArm, random: Random) -> tuple[float, ...]:
    limit = np.array(config.rhi.motors.torque)
    most = LARGEST_CONDITION if arm.m <= PLACE else LARGEST_TURNING
    best, least = None, SINGULAR  # motors that are very unlike give lines in every posture
    for _ in range(TRIES):
        q = _posture(config, random, INSIDE if arm.m <= PLACE or arm.n > arm.m else INSIDE + 2.0 * TURN)
        condition = np.linalg.cond(velocity_ellipsoid(arm.at(q).J, limit))
        if condition < most:
            return tuple(q.tolist())
        if condition < least:
            best, least = q, condition
    if best is None:
        raise ValueError(f"{TRIES} postures are next to singular: widen rhi.motors.lower and upper")
    return tuple(best.tolist())


def _posture(config: RhiConfig, random: Random, inside: float = INSIDE) -> Array:
    return np.array([random.uniform(*ends) for ends in zip(*_bounds(config, inside), strict=True)])


def _bounds(config: RhiConfig, inside: float) -> tuple[list[float], list[float]]:
    motors = config.rhi.motors
    return [low + inside for low in motors.lower], [high - inside for high in motors.upper]
