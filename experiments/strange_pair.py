"""Both stations of a telemanipulation under a person, a network and walls that a seed draws.

python -m hapticd.experiments.strange_pair --seconds 15 --seed 1 --count 20
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import msgspec
import numpy as np

from ..machines.telemanipulation.pair import Pair, declared
from ..models import Array
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.core.modes import Mode
from ..runtime.live.lockstep import unswept
from ..sim.network_model import Conditions, NetworkModel
from ..sim.wall import Wall, Walls

BEGIN_S = 7.0
"""Both have faded in by then; until then the hands stay where they are."""
ROOM = 0.14
"""How far from its first place a palm may want to go, along each axis [m]."""
TURN = 0.4
"""Largest of a rotation vector's components [rad]."""
WALLS = (0, 3)
"""How many there are, from and to."""


@dataclass(frozen=True, slots=True)
class Case:
    """What a seed draws.

    Attributes:
        grip: stiffness, damping, strength of the hands [N/m, N s/m, N].
        speed: of the hands, mean between two places [m/s].
        network: of both directions.
        walls: in front of the avatar.
        places: times [s] and places of both palms, (k, 12): left and right, position and rotation vector, as
            they differ from the first ones.
    """

    grip: tuple[float, float, float]
    speed: float
    network: Conditions
    walls: Sequence[Wall]
    times: Sequence[float]
    places: Array


@dataclass(frozen=True, slots=True)
class Seen:
    """What became of a session.

    Attributes:
        stops: of stations and of single arms, as people read them.
        force: largest on an avatar's palm [N].
        apart: largest distance between a palm and where it is led, while it follows and touches nothing [m].
        given: most that the link gave out beyond what went in, by either arm [J].
        taken: by the passivity of all ports [J].
    """

    stops: Sequence[str]
    force: float
    apart: float
    given: float
    taken: float


def strange_case(seed: int, seconds: float) -> Case:
    """A person, a network and walls."""
    r = np.random.default_rng([seed, 11])
    delay = float(r.choice([0.0, r.uniform(0.0, 0.02), r.uniform(0.02, 0.35)]))
    network = Conditions(
        delay,
        float(r.uniform(0.0, 0.33)) * delay,
        float(r.choice([0.0, r.uniform(0.0, 0.05)])),
        float(r.uniform(1.0, 4.0)),
    )
    grip = float(np.exp(r.uniform(np.log(200.0), np.log(1500.0)))), float(r.uniform(15.0, 40.0)), 30.0
    speed = float(r.uniform(0.05, 0.3))
    walls = [_wall(r) for _ in range(int(r.integers(*WALLS)))]
    times, places = [0.0, *(BEGIN_S - 0.1 * k for k in (3, 2, 1, 0))], [np.zeros(12)] * 5
    while times[-1] < seconds:
        there = r.uniform(-1.0, 1.0, 12) * np.tile([ROOM] * 3 + [TURN] * 3, 2)
        way = max(float(np.linalg.norm(there[k : k + 3] - places[-1][k : k + 3])) for k in (0, 6))
        times.append(times[-1] + max(0.4, way / speed))
        places.append(there)
        if r.random() < 0.3:
            times.append(times[-1] + float(r.uniform(0.2, 1.5)))
            places.append(there)
    return Case(grip, speed, network, walls, times, np.array(places))


def _wall(r: np.random.Generator) -> Wall:
    """A wall somewhere in the room, of 1 to 10 kN/m, that no palm begins in."""
    normal = r.normal(size=3)
    normal /= np.linalg.norm(normal)
    first = np.array([[0.45, 0.25, 1.0], [0.45, -0.25, 1.0]])
    away = float(r.uniform(0.03, 0.12))
    point = normal * (min(first @ normal) - away)
    return Wall(
        point, normal, float(np.exp(r.uniform(np.log(1e3), np.log(1e4)))), float(r.uniform(5.0, 30.0))
    )


def strange_pair(case: Case, seed: int) -> Pair:
    """The built-in stations in that case."""
    stations = [_led(config.load(name), case) for name in ("operator", "avatar")]
    if case.network.longest > 0.0:
        stations = [declared(loaded, case.network.longest) for loaded in stations]
    stations = [_led(loaded, case) for loaded in stations]
    pair = Pair(stations[0], stations[1], NetworkModel(case.network, seed))
    avatar: Any = pair.avatar.plant
    avatar.walls = Walls(case.walls)
    return pair


def _led(loaded: Loaded, case: Case) -> Loaded:
    simulation: Any = loaded.config.simulation
    first = simulation.hand.path[0]

    def at(time: float, way: Array) -> Any:
        def plus(name: str, part: Array) -> Any:
            value = getattr(first, name)
            return type(value)((np.array(value) + part).tolist())

        return msgspec.structs.replace(
            first,
            at=type(first.at)(time),
            left=plus("left", way[:3]),
            left_turned=plus("left_turned", way[3:6]),
            position=plus("position", way[6:9]),
            turned=plus("turned", way[9:]),
        )

    stiffness, damping, force = case.grip
    hand = msgspec.structs.replace(
        simulation.hand,
        path=tuple(at(time, way) for time, way in zip(case.times, case.places, strict=True)),
        stiffness=stiffness,
        damping=damping,
        force=force,
    )
    changed = msgspec.structs.replace(simulation, hand=hand)
    return replace(loaded, config=msgspec.structs.replace(loaded.config, simulation=changed))


def strange_session(
    seed: int, seconds: float, watch: Callable[[Pair], None] = lambda pair: None
) -> tuple[Case, Seen]:
    """One session of so many seconds; ``watch`` is called after each tick."""
    case = strange_case(seed, seconds)
    pair = strange_pair(case, seed)
    operator, avatar = (each.session.cycle for each in (pair.operator, pair.avatar))
    leads, follows, machine = _any(pair.operator.plant), _any(pair.avatar.plant), _any(avatar.machine)
    stops: list[str] = []
    force = apart = 0.0
    given = np.zeros(2)
    most = -inf
    with unswept():
        for _ in range(round(seconds / pair.dt)):
            pair.tick()
            watch(pair)
            for name, cycle, each in (("operator", operator, pair.operator), ("avatar", avatar, pair.avatar)):
                for event in each.outputs.events:
                    if event.code == "tripped" or "stopped itself" in str(event):
                        stops.append(f"{name}: {event}")
                if cycle.stops.latch.trip is not None and cycle.mode is Mode.STOPPED:
                    return case, Seen(stops, force, apart, float(most), _taken(operator, avatar))
            for i in range(2):
                lead, follow = leads.arms[i].arm, follows.arms[i].arm
                touch = float(np.linalg.norm(follow.hold.wrench[:3]))
                force = max(force, touch)
                if touch == 0.0 and machine.leases[i].follows and machine._laws[i].share == 1.0:
                    law = machine._laws[i]
                    apart = max(apart, float(np.linalg.norm(follow.position - law.goal)))
                law_felt = _any(operator.machine)._felt_there[i]
                out = float(law_felt[:3] @ (lead.rotation.T @ lead.twist[:3]))
                given[i] += pair.dt * (out - float(follow.hold.wrench[:3] @ follow.twist[:3]))
            most = max(most, float(given.max()))
    return case, Seen(stops, force, apart, float(most), _taken(operator, avatar))


def _any(thing: object) -> Any:
    return thing


def _taken(operator: Any, avatar: Any) -> float:
    ports = [*(far.port for far in operator.machine.far), *avatar.machine._ports]
    return float(sum(port.taken for port in ports))


def main() -> int:
    """One line a session; 1 where a station or an arm stopped."""
    parser = argparse.ArgumentParser(prog="python -m hapticd.experiments.strange_pair", description=__doc__)
    parser.add_argument("--seconds", type=float, default=15.0, help="of each; 7 of them are the beginning")
    parser.add_argument("--seed", type=int, default=1, help="of the first")
    parser.add_argument("--count", type=int, default=10, help="of sessions")
    options = parser.parse_args()
    stopped = 0
    for seed in range(options.seed, options.seed + options.count):
        case, seen = strange_session(seed, options.seconds)
        n, walls = case.network, "/".join(f"{wall.stiffness:.0f}" for wall in case.walls) or "none"
        stops = "".join(f"; {stop}" for stop in seen.stops)
        print(
            f"seed {seed}: delay {1e3 * n.delay:.0f} +- {1e3 * n.jitter:.0f} ms, loss {100 * n.loss:.1f} %,"
            f" walls {walls} N/m: {seen.force:.0f} N, {1e3 * seen.apart:.0f} mm apart,"
            f" {seen.given:.3f} J given, {seen.taken:.3f} J taken{stops}",
            flush=True,
        )
        stopped += bool(seen.stops)
    return int(stopped > 0)


if __name__ == "__main__":
    raise SystemExit(main())
