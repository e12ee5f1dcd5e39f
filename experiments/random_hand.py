"""Random hands: where they want to go, how fast, how strong and how stiff they are."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, dist
from random import Random
from typing import Any

import msgspec

from ..configs.quantities import Instant
from ..models import Robot
from ..runtime.configuration.system import Stance, System
from ..runtime.core.sections import Arming, Config, Press
from .temper import Temper

PRESS_S, PRESS_TICKS = 0.3, 150
"""When the dead-man switch is pressed at the soonest: a machine needs some hundred ticks to be ready."""
STILL_S = (0.6, 4.0)
"""How long a hand stays where it is, had it pressed at the soonest: some move while a machine engages."""
LEG_M = (0.1, 1.8)
"""Way between two places, as far as the machine's space allows."""
PAUSE = 0.15
"""Share of the legs that end in a rest of at most REST_S."""
REST_S = 1.0
PEAK = 1.5
"""Peak over mean speed between two places, if the hand rests at both."""
TURNING = 2.0
"""Fastest turning of a hand [rad/s]."""
SLOWEST = 0.3
"""Slowest hand and slowest leg, as a share of the fastest."""
WEAKEST = 0.4
"""Weakest hand, as a share of the strongest."""
STIFFNESS, DAMPING = (300.0, 3000.0), (10.0, 40.0)
"""[N/m], [N s/m]."""
OF_TURNS = ("rotational_stiffness", "rotational_damping", "torque")
ANGULAR_STIFFNESS, ANGULAR_DAMPING = (10.0, 60.0), (0.4, 1.5)
"""[N m/rad], [N m s/rad]."""
HAND = 6
"""Coordinates of a hand's position and directions."""


BLOCK_S = 30.0
"""Paths last so long, or twice, and so on: where a path ends changes how it gets there."""


def stranger(
    config: Config,
    system: System[Any],
    robot: Robot,
    seed: int,
    seconds: float,
    temper: Temper,
    draw: int = 0,
) -> Config:
    """A configuration with a random hand, posture and whatever else the machine varies.

    The same seed gives the same hand in sessions of up to 25 s; ``draw`` is another of its hands.
    """
    random = Random(f"{seed}, drawn again {draw}") if draw else Random(seed)
    stance = system.stance(config, robot, random) if system.stance else _as_configured(config)
    simulation = stance.config.simulation
    assert simulation is not None
    hand = simulation.hand
    traits: dict[str, Any] = {
        "stiffness": _between(random, STIFFNESS),
        "damping": random.uniform(*DAMPING),
        "force": random.uniform(WEAKEST, 1.0) * temper.force,
        "rotational_stiffness": _between(random, ANGULAR_STIFFNESS),
        "rotational_damping": random.uniform(*ANGULAR_DAMPING),
        "torque": random.uniform(WEAKEST, 1.0) * temper.torque,
    }
    traits |= {"away": None}  # it never lets go
    known = [name for name in traits if stance.turns or name not in OF_TURNS]
    own = {name: traits[name] for name in known if name in hand.__struct_fields__}
    pressed = pressed_at(config)
    press = Press(Instant(pressed), True)
    speed = random.uniform(SLOWEST, 1.0) * temper.speed
    path = [
        msgspec.structs.replace(hand.path[0], at=at, **_coordinates(hand.path[0], stance.pose(place)))
        for at, place in _way(
            stance, random, speed, BLOCK_S * ceil((seconds + 5.0) / BLOCK_S), pressed - PRESS_S
        )
    ]
    changed = msgspec.structs.replace(hand, dead_man=(press,), path=tuple(path), **own)
    seeded = msgspec.structs.replace(simulation, seed=seed, hand=changed, touches={})
    arming = Arming("dead-man", config.arming.fade)  # nobody else is there who could arm it
    return msgspec.structs.replace(stance.config, simulation=seeded, arming=arming)


def pressed_at(config: Config) -> float:
    """When a random hand presses the dead-man switch [s]: no sooner than the machine is ready.

    Until when a machine is not, its configured hand knows.
    """
    assert config.simulation is not None
    own = [press.at for press in config.simulation.hand.dead_man if press.pressed]
    return max(PRESS_S, PRESS_TICKS / config.loop.rate, *own[:1])


def _between(random: Random, range_: tuple[float, float]) -> float:
    """Every octave is as likely as the others."""
    low, high = range_
    return float(low * (high / low) ** random.random())


def _as_configured(config: Config) -> Stance[Config]:
    """A machine that says nothing of its space: the hand stays within the configured path."""
    assert config.simulation is not None
    places = [_place(point) for point in config.simulation.hand.path]
    ways = list(zip(*places, strict=True))
    return Stance(config, places[0], [min(way) for way in ways], [max(way) for way in ways])


def _place(point: Any) -> tuple[float, ...]:
    return (*point.position, *getattr(point, "angles", ()))


def _coordinates(point: Any, place: Sequence[float]) -> dict[str, tuple[float, ...]]:
    found = {"position": tuple(place[:3])}
    for name in ("angles", "turned"):
        if len(place) > 3 and hasattr(point, name):
            found[name] = tuple(place[3:HAND])
    if len(place) > HAND:
        found |= {"left": tuple(place[HAND : HAND + 3]), "left_turned": tuple(place[HAND + 3 :])}
    return found


def _apart(place: Sequence[float], there: Sequence[float]) -> tuple[float, float]:
    """How far a hand goes [m] and turns [rad]; of two of them the most."""
    hands = [slice(first, first + HAND) for first in range(0, len(place), HAND)]
    pairs = [(place[hand], there[hand]) for hand in hands]
    return max(dist(a[:3], b[:3]) for a, b in pairs), max(dist(a[3:], b[3:]) for a, b in pairs)


def _way(
    stance: Stance[Config], random: Random, speed: float, seconds: float, late: float
) -> list[tuple[float, Sequence[float]]]:
    """Times and places until at least so many seconds; at rest at first.

    A smooth path swings a little before it leaves a place: only in the last of the knots at the first one.
    """
    place, t = list(stance.place), late + random.uniform(*STILL_S)
    knots: list[tuple[float, Sequence[float]]] = [
        (0.0, place),
        *((t - 0.1 * i, place) for i in (3, 2, 1, 0)),
    ]
    while t < seconds:
        there = _next(stance, random, place)
        fast = random.uniform(SLOWEST, 1.0)
        way, turn = _apart(place, there)
        t += max(PEAK * way / (fast * speed), PEAK * turn / (fast * TURNING), 0.15)
        place = there
        knots.append((t, place))
        if random.random() < PAUSE:
            t += random.uniform(0.05, 1.0) * REST_S
            knots.append((t, place))
    return knots


def _next(stance: Stance[Config], random: Random, place: Sequence[float]) -> list[float]:
    """Somewhere in the space, towards a random point of it, but no further than a leg."""
    aim = [random.uniform(low, high) for low, high in zip(stance.lower, stance.upper, strict=True)]
    away = [a - p for a, p in zip(aim, place, strict=True)]
    share = min(1.0, random.uniform(*LEG_M) / max(_apart(place, aim)[0], 1e-9))
    return [p + share * d for p, d in zip(place, away, strict=True)]
