"""Random serial chains as digital twins: one to seven joints that turn or slide, of any sizes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePath
from random import Random

from ..models import ModelError
from ..runtime.configuration.config import Loaded, with_twin
from ..runtime.configuration.session import build
from ..runtime.errors import ConfigError
from .temper import RANDOM

MOST_JOINTS = 7
SLIDING, WITH_DETENT, WITH_SPRING, WITH_DRIVE = 0.25, 0.2, 0.3, 0.3
"""Share of the joints."""
STRAIGHT = 0.7
"""Share of the angles of the chain that are multiples of 90 degrees, as in most machines."""
OFFSET_M, LENGTH_M = 0.3, 0.6
INERTIA, MASS = (0.06, 3.0), (3.0, 20.0)
"""Of joints that turn and of those that slide [kg m^2], [kg]."""
TRIES = 100


def with_random_chain(machine: Loaded, seed: int) -> Loaded:
    """The machine with a chain of a seed; one that the machine refuses is drawn again.

    Raises:
        ConfigError: the machine renders no twin, or no chain of many.
    """
    random = Random(seed)
    for _ in range(TRIES):
        text = "\n".join(_chain(random))
        try:
            loaded = with_twin(machine, RANDOM, text, PurePath())
            build(loaded)
        except (ConfigError, ModelError) as error:
            refused = error
        else:
            return loaded
    raise refused


def _chain(random: Random) -> Iterator[str]:
    """Lines of a twin's file."""
    yield "[twin]"
    yield 'kind = "chain"'
    yield f'base = "{_angle(random)} {_angle(random)} {_angle(random)} deg"'
    for i in range(random.randint(1, MOST_JOINTS)):
        yield f"[twin.joints.joint_{i + 1}]"
        yield from _slide(random) if random.random() < SLIDING else _turn(random)
        d, a = random.uniform(-OFFSET_M, OFFSET_M), random.uniform(0, LENGTH_M)
        turns = f'theta = "{_angle(random)} deg", alpha = "{_angle(random)} deg"'
        yield f'dh = {{ {turns}, d = "{d:.3f} m", a = "{a:.3f} m" }}'


def _turn(random: Random) -> Iterator[str]:
    inertia = _between(random, *INERTIA)
    yield 'type = "revolute"'
    yield 'start = "0 rad"'
    yield f'range = "{-random.uniform(0.1, 2.5):.3f} {random.uniform(0.1, 2.5):.3f} rad"'
    yield f'velocity = "{_between(random, 0.5, 4.0):.3f} rad/s"'
    yield f'inertia = "{inertia:.4f} kg m^2"'
    yield f'damping = "{inertia * random.uniform(0.5, 5.0):.4f} N m s/rad"'
    if random.random() < WITH_DRIVE:
        yield f'drive = "{random.uniform(-3.0, 3.0):.3f} N m"'
    if random.random() < WITH_SPRING:
        yield f'stiffness = "{random.uniform(0.5, 10.0):.3f} N m/rad"'
    if random.random() < WITH_DETENT:
        at, torque = random.uniform(-0.5, 0.5), random.uniform(0.1, 1.0)
        yield f'detents = [{{ at = "{at:.3f} rad", torque = "{torque:.3f} N m", width = "0.2 rad" }}]'


def _slide(random: Random) -> Iterator[str]:
    mass = _between(random, *MASS)
    yield 'type = "prismatic"'
    yield 'start = "0 m"'
    yield f'range = "{-random.uniform(0.05, 1.0):.3f} {random.uniform(0.05, 1.0):.3f} m"'
    yield f'velocity = "{_between(random, 0.2, 1.5):.3f} m/s"'
    yield f'inertia = "{mass:.3f} kg"'
    yield f'damping = "{mass * random.uniform(0.5, 5.0):.3f} N s/m"'
    if random.random() < WITH_DRIVE:
        yield f'drive = "{random.uniform(-10.0, 10.0):.3f} N"'
    if random.random() < WITH_SPRING:
        yield f'stiffness = "{random.uniform(5.0, 200.0):.3f} N/m"'


def _angle(random: Random) -> str:
    if random.random() < STRAIGHT:
        return str(random.choice((-90, 0, 90, 180)))
    return f"{random.uniform(-180, 180):.1f}"


def _between(random: Random, low: float, high: float) -> float:
    """Every octave is as likely as the others."""
    return float(low * (high / low) ** random.random())
