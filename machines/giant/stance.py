"""Random postures of the simulated giant, inside its limits, and the digital twin that it renders."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, inf, isfinite, pi
from random import Random

import msgspec
import numpy as np

from ...models import Array, Robot
from ...runtime.configuration.system import Stance
from ..rendering.script import Led
from ..rendering.sections import ChainTwin, Twin
from ..rendering.twin import chain_twin
from .config import Box, GiantConfig
from .kinematics import DROP, FOREARM, HANDLE, points
from .script import angles, start

INSIDE, INSIDE_M = 0.1, 0.1
"""How far inside its limits the machine begins [rad], [m]."""
BEYOND, BEYOND_M, BEYOND_HEIGHT = 0.15, 0.15, 0.05
"""How far beyond its limits a hand may want to go: directions [rad], along x and y, heights [m]."""
TURN = 2.5
"""How far from the beginning a hand may want to turn the handle about the vertical [rad]."""
MOST_LED = 1.5
"""How far from its beginning a hand leads a joint of a chain, which may have no limit [rad or m]."""
MASS = (2.5, 8.0)
"""Mass of the twin [kg]; its inertia grows in proportion."""
DAMPING = (0.5, 2.0)
"""Damping of the twin, as a share of the configured one."""


def giant_stance(config: GiantConfig, robot: Robot, random: Random) -> Stance[GiantConfig]:
    """A posture inside joint limits, tilt and boxes; a free mass of another mass and damping.

    The first five joints are drawn until handle and elbow are in their box. Where the twin is a chain, the
    places that the hand wants are those of its joints.
    """
    simulation, giant = config.simulation, config.giant
    assert simulation is not None
    q, ppu = _posture(config, random)
    position, _ = points(q, ppu)
    place = (*position, sum(q[:3]), q[3] + q[4], q[5])

    plant = msgspec.structs.replace(simulation.giant, posture=q, ppu=ppu)
    varied = msgspec.structs.replace(
        config,
        giant=msgspec.structs.replace(giant, twin=_varied(giant.twin, random)),
        simulation=msgspec.structs.replace(simulation, giant=plant),
    )
    if isinstance(giant.twin, ChainTwin):
        return _leading(varied, giant.twin, start(varied, robot))
    (x, y, _), (X, Y, _) = giant.box.lower, giant.box.upper
    low, high = _heights(config)
    tilt, roll = giant.manipulator.tilt, (giant.manipulator.lower[5], giant.manipulator.upper[5])
    lower = (x - BEYOND_M, y - BEYOND_M, low, place[3] - TURN, tilt[0] - BEYOND, roll[0] - BEYOND)
    upper = (X + BEYOND_M, Y + BEYOND_M, high, place[3] + TURN, tilt[1] + BEYOND, roll[1] + BEYOND)
    return Stance(varied, place, lower, upper)


def _varied(twin: Twin, random: Random) -> Twin:
    """A free mass of another mass and damping; a chain as it is."""
    mass, damping = random.uniform(*MASS), random.uniform(*DAMPING)
    if isinstance(twin, ChainTwin):
        return twin
    return msgspec.structs.replace(
        twin,
        mass=mass,
        inertia=twin.inertia * mass / twin.mass,
        damping=damping * twin.damping,
        rotational_damping=damping * twin.rotational_damping,
    )


def _leading(config: GiantConfig, section: ChainTwin, handle: Array) -> Stance[GiantConfig]:
    """A hand that wants to lead the joints of a chain anywhere, and beyond their limits here and there."""
    twin = chain_twin(section)
    led, low, high = Led(twin, handle, angles), twin.limits.lower, twin.limits.upper
    first = twin.q.copy()
    lower = np.maximum(low - BEYOND, first - MOST_LED)
    upper = np.minimum(high + BEYOND, first + MOST_LED)
    return Stance(config, first.tolist(), lower.tolist(), upper.tolist(), led.pose)


def _posture(config: GiantConfig, random: Random) -> tuple[tuple[float, ...], tuple[float, ...]]:
    m, box, axes = config.giant.manipulator, config.giant.box, config.giant.ppu
    while True:
        ppu = tuple(
            random.uniform(low + INSIDE_M, high - INSIDE_M)
            for low, high in zip(axes.lower, axes.upper, strict=True)
        )
        q = tuple(
            random.uniform(low + INSIDE, high - INSIDE)
            for low, high in zip(map(_turn, m.lower), map(_turn, m.upper), strict=True)
        )
        if m.tilt[0] + INSIDE <= q[3] + q[4] <= m.tilt[1] - INSIDE and _boxed(points(q, ppu), box):
            return q, ppu


def _boxed(places: Sequence[Sequence[float]], box: Box) -> bool:
    """Whether handle and elbow are well inside; the elbow's height is constant."""
    handle, elbow = places
    room = (INSIDE_M, INSIDE_M, BEYOND_HEIGHT)
    near = [*zip(handle, box.lower, box.upper, room, strict=True)]
    near += zip(elbow[:2], box.lower[:2], box.upper[:2], room[:2], strict=True)
    return all(low + gap <= x <= high - gap for x, low, high, gap in near)


def _turn(limit: float) -> float:
    """A joint without a limit may begin anywhere."""
    return limit if isfinite(limit) else pi if limit == inf else -pi


def _heights(config: GiantConfig) -> tuple[float, float]:
    """Heights that a hand may want [m]: those of the box, as far as the forearm reaches."""
    m, box = config.giant.manipulator, config.giant.box
    highest = -DROP - FOREARM * cos(max(-m.lower[3], m.upper[3])) + HANDLE
    lowest = -DROP - FOREARM - HANDLE
    return max(box.lower[2], lowest) - BEYOND_HEIGHT, min(box.upper[2], highest) + BEYOND_HEIGHT
