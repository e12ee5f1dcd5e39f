"""Beyond the paper: how quiet the giant is where nothing should move.

At a limit: the hand of the built-in walk stays where it presses against one, and what is commanded of the
joints should be still. Let go: nobody holds the handle while force-torque sensor and inertial units are off
by a bias, and the handle should not wander off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from random import Random
from typing import Any

import msgspec
import numpy as np

from ..machines.giant.config import GiantConfig
from ..machines.giant.limits import GiantLimits
from ..machines.giant.machine import Giant
from ..machines.giant.plant import GiantPlant
from ..machines.rendering.led import let_alone
from ..models import Array
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.core.modes import Mode
from ..runtime.live.lockstep import Lockstep, unswept
from ..sim.force_torque import SimForceTorque
from ..sim.imu import SimImu
from .outcome import COLOURS, LINES, Outcome, Progress, Row
from .own_plant import believed, own

TITLE = "the giant at rest: pressed against limits, and let go with biased sensors"
OWN, BELIEVED = "own plant", "plant as believed"
SEED, MANY = 1, 8
"""Of the sensors' errors and of the signs of biases; how many a study has."""
HELD_AT = {"handle x": 15.7, "tilt (singularity)": 17.9, "joint 6": 19.9, "joint 4": 21.9, "joint 2": 28.4}
"""Where the built-in walk presses against a limit: its times [s]."""
PAUSE_S, SETTLED_S, LOOKED_S, KNOTS = 3.0, 1.2, 1.0, 20
"""For so long the hand stays there, after the second time it is looked for the third; knots of its path in
the pause: a smooth path swings a little before it leaves."""
NEAR = 5e-3
"""A measured value this close to a limit is at it [rad], [m]."""
FORCE, TORQUE, ACCELERATION = 1.0, 0.1, 0.1
"""Biases of each axis: of the force-torque sensor [N], [N m]; of the inertial units [m/s^2]."""
WRONG = {
    "neither": (0.0, 0.0),
    "force-torque sensor": (1.0, 0.0),
    "inertial units": (0.0, 1.0),
    "both": (1.0, 1.0),
}
"""Which of these biases are there, as shares."""
WHEN = ("from the beginning", "from when the twin is rendered")
CASES = [("neither", WHEN[0]), *product(list(WRONG)[1:], WHEN)]
AFTER_S, LAST_S = 10.0, 1.0
"""So long after the twin is rendered, or the bias is there, the speed is judged, and for how long [s]."""
UP_S = 6.0
"""By then the machine is active."""


@dataclass(frozen=True, slots=True)
class Held:
    """A hand that stays where it presses against a limit, for k ticks.

    Attributes:
        limit: its name.
        at: share of the ticks in which the measured value is at the limit.
        acceleration: commanded of the joints, (k, 6) [rad/s^2].
        force, torque: of the hand, means of their sizes [N], [N m].
        stop: why the machine stopped, "" where it did not.
    """

    limit: str
    at: float
    acceleration: Array
    force: float
    torque: float
    stop: str

    @property
    def restless(self) -> Array:
        """RMS of each joint's commanded acceleration about its mean, (6,) [rad/s^2]."""
        return np.asarray(self.acceleration.std(0))


@dataclass(frozen=True, slots=True)
class LetGo:
    """A handle that nobody holds while sensors are biased, over k ticks since the twin is rendered.

    Attributes:
        wrong: which sensors; when: since when.
        velocity: of the handle, and its angular velocity, (k, 6) [m/s], [rad/s].
        stop: why the machine stopped, "" where it did not.
    """

    wrong: str
    when: str
    velocity: Array
    stop: str

    @property
    def _last(self) -> Array:
        return self.velocity[round(AFTER_S / (AFTER_S + LAST_S) * len(self.velocity)) :]

    @property
    def speed(self) -> float:
        """The largest in the end, with what trembles [m/s]."""
        return float(np.linalg.norm(self._last[:, :3], axis=1).max())

    @property
    def wander(self) -> tuple[float, float]:
        """How fast it goes away, and turns, in the end on average [m/s], [rad/s]."""
        mean = self._last.mean(0)
        return float(np.linalg.norm(mean[:3])), float(np.linalg.norm(mean[3:]))


def paused(settings: GiantConfig) -> tuple[GiantConfig, dict[str, float]]:
    """The walk with a hand that stays at the limits, and when each pause begins [s]."""
    assert settings.simulation
    hand = settings.simulation.hand
    path, begins, late = [], {}, 0.0
    for point in hand.path:
        path.append(msgspec.structs.replace(point, at=type(point.at)(point.at + late)))
        for limit, at in HELD_AT.items():
            if at == point.at:
                begin = point.at + late
                knots = begin + PAUSE_S * np.arange(1, KNOTS + 1) / KNOTS
                path += [msgspec.structs.replace(point, at=type(point.at)(t)) for t in knots.tolist()]
                late += PAUSE_S
                begins[limit] = begin
    held = msgspec.structs.replace(hand, path=tuple(path))
    simulation = msgspec.structs.replace(settings.simulation, hand=held, touches={})
    return msgspec.structs.replace(settings, simulation=simulation), begins


def held(loaded: Loaded, limits: Sequence[str], progress: Progress) -> list[Held]:
    """The paused walk, as far as the last of some limits."""
    assert isinstance(loaded.config, GiantConfig)
    walk, begins = paused(loaded.config)
    lockstep = Lockstep(build(replace(loaded, config=walk)))
    plant, cycle = lockstep.plant, lockstep.session.cycle
    machine, rate = cycle.machine, lockstep.session.config.loop.rate
    assert isinstance(plant, GiantPlant) and isinstance(machine, Giant)
    read = GiantLimits(walk)
    record = np.zeros(1, machine.state)
    machine.bind_state(record)
    found = []
    with unswept():
        for limit in sorted(limits, key=lambda limit: begins[limit]):
            progress(f"pressed against {limit}")
            _tick(lockstep, round((begins[limit] + SETTLED_S) * rate) - lockstep.inputs.tick - 1)
            (i,) = (i for i, spec in enumerate(read.specs) if spec.name == limit)
            rows, wrenches, near = [], [], []
            for _ in range(round(LOOKED_S * rate)):
                lockstep.tick()
                machine.fill()
                value, spec = read.values(record[0])[i], read.specs[i]
                rows.append(machine.force_control.qdd.copy())
                wrenches.append(plant.arm.hold.wrench.copy())
                near.append(value <= spec.lower + NEAR or value >= spec.upper - NEAR)
            trip, wrench = cycle.stops.last, np.array(wrenches)
            force, torque = (float(np.linalg.norm(part, axis=1).mean()) for part in np.hsplit(wrench, 2))
            stop = str(trip.verdict.detail) if trip else ""
            found.append(Held(limit, float(np.mean(near)), np.array(rows), force, torque, stop))
    return found


def _tick(lockstep: Lockstep, ticks: int) -> None:
    for _ in range(ticks):
        lockstep.tick()


def let_go(loaded: Loaded, wrong: str, when: str, signs: Sequence[float], seed: int) -> LetGo:
    """A handle that nobody holds; the signs, nine, are those of force, torque and acceleration."""
    assert isinstance(loaded.config, GiantConfig)
    settings = let_alone(loaded.config)
    assert settings.simulation
    simulation = msgspec.structs.replace(settings.simulation, touches={})
    alone = replace(loaded, config=msgspec.structs.replace(settings, simulation=simulation))
    lockstep = Lockstep(build(own(alone, seed)))
    plant, cycle, rate = lockstep.plant, lockstep.session.cycle, lockstep.session.config.loop.rate
    assert isinstance(plant, GiantPlant)
    of_wrench, of_acceleration = WRONG[wrong]
    wrench = of_wrench * np.repeat([FORCE, TORQUE], 3) * signs[:6]
    acceleration = of_acceleration * ACCELERATION * np.array(signs[6:])

    def bias() -> None:
        _bias(plant, wrench, acceleration)

    with unswept():
        if when == WHEN[0]:
            bias()
        for _ in range(round(UP_S * rate)):
            lockstep.tick()
            if cycle.mode is Mode.ACTIVE:
                break
        if when == WHEN[1]:
            bias()
        rows = []
        for _ in range(round((AFTER_S + LAST_S) * rate)):
            lockstep.tick()
            x, y = plant.ppu.velocity
            rows.append(np.add(plant.arm.twist, (x, y, 0.0, 0.0, 0.0, 0.0)))
    trip = cycle.stops.last
    stop = str(trip.verdict.detail) if trip else "" if cycle.mode is Mode.ACTIVE else "it did not start"
    return LetGo(wrong, when, np.array(rows), stop)


def _bias(plant: GiantPlant, wrench: Array, acceleration: Array) -> None:
    """From now on the sensors are off by a wrench (6,) [N, N m], and by an acceleration (3,) [m/s^2]."""
    sense = plant._sense

    def biased() -> None:
        sense()
        for sensor in plant.nodes.of(SimForceTorque):
            sensor.fields["wrench"] += wrench
        for unit in plant.nodes.of(SimImu):
            unit.fields["acceleration"] += acceleration

    plant._sense = biased  # type: ignore[method-assign]


def run(progress: Progress) -> Outcome:
    """A plant of its own, and the one that its controller believes in."""
    return _outcome([SEED], progress)


def study(progress: Progress) -> Outcome:
    """Many of the first."""
    return _outcome(range(SEED, SEED + MANY), progress)


def _outcome(seeds: Sequence[int], progress: Progress) -> Outcome:
    loaded = config.load("giant")
    pressed = {
        OWN: [held(own(loaded, seed), list(HELD_AT), progress) for seed in seeds],
        BELIEVED: [held(believed(loaded), list(HELD_AT), progress)],
    }
    gone = []
    for (wrong, when), seed in product(CASES, seeds):
        progress(f"let go: {wrong}, {when}, seed {seed}")
        random = Random(f"signs {seed}")
        gone.append(let_go(loaded, wrong, when, [random.choice((-1.0, 1.0)) for _ in range(9)], seed))
    rows = [row for name, runs in pressed.items() for row in _held_rows(name, runs)]
    rows += [_gone_row([each for each in gone if (each.wrong, each.when) == case]) for case in CASES]
    figures = {
        "held": {
            name: [
                {"limit": each.limit, "at": each.at, "rms": each.restless.tolist(), "force": each.force}
                | {"torque": each.torque, "stop": each.stop}
                for run in runs
                for each in run
            ]
            for name, runs in pressed.items()
        },
        "let go": [
            {"wrong": each.wrong, "when": each.when, "speed": each.speed}
            | {"wander": each.wander, "stop": each.stop}
            for each in gone
        ],
    }
    return Outcome(rows, figures, partial(_draw, pressed, gone[:: len(seeds)]), (9.0, 4.5))


def _held_rows(name: str, runs: Sequence[Sequence[Held]]) -> list[Row]:
    rows = []
    for of in zip(*runs, strict=True):
        worst = max(of, key=lambda each: float(each.restless.max()))
        joint = int(worst.restless.argmax()) + 1
        note = f"at joint {joint}; the hand holds {worst.force:.0f} N and {worst.torque:.1f} N m"
        at = min(each.at for each in of)
        stops = "".join(f"; {each.stop}" for each in of if each.stop)
        rows.append(
            Row(
                f"{name}, pressed against {worst.limit}: commanded acceleration, RMS about its mean"
                " [rad/s^2]",
                "-",
                f"{worst.restless.max():.3f}",
                f"{note}; at the limit in {100 * at:.0f} % of the ticks{stops}",
            )
        )
    return rows


def _gone_row(of: Sequence[LetGo]) -> Row:
    speed = max(each.speed for each in of)
    away, turning = np.max([each.wander for each in of], axis=0)
    stops = "".join(f"; {each.stop}" for each in of if each.stop)
    when = "" if of[0].wrong == "neither" else f" {of[0].when}"
    return Row(
        f"let go, {of[0].wrong} biased{when}: wanders after {AFTER_S:g} s with [mm/s], [mrad/s]",
        "-",
        f"{1e3 * away:.2f}, {1e3 * turning:.2f}",
        f"mean of {LAST_S:g} s; with what trembles the handle moves at up to {1e3 * speed:.2f} mm/s{stops}",
    )


def _draw(pressed: dict[str, list[list[Held]]], gone: Sequence[LetGo], figure: Any) -> None:
    rest, drift = figure.subplots(1, 2)
    for k, ((name, runs), colour) in enumerate(zip(pressed.items(), COLOURS, strict=False)):
        at = np.arange(len(runs[0])) + 0.4 * k
        most = [max(float(each.restless.max()) for each in of) for of in zip(*runs, strict=True)]
        rest.bar(at, most, 0.36, color=colour, hatch=("", "//")[k], label=name)
    rest.set_yscale("log")
    rest.set_xticks(np.arange(len(HELD_AT)) + 0.2, [each.limit.partition(" (")[0] for each in runs[0]])
    rest.set_xlabel("limit that the hand is pressed against")
    rest.set_ylabel("commanded acceleration, RMS [rad/s$^2$]")
    rest.legend(fontsize=7)
    for each in gone:
        speed = np.linalg.norm(each.velocity[:, :3], axis=1)
        t = (AFTER_S + LAST_S) * (np.arange(len(speed)) + 1.0) / len(speed)
        colour = COLOURS[list(WRONG).index(each.wrong)]
        line, marker = LINES[list(WRONG).index(each.wrong)], ("", "o")[WHEN.index(each.when)]
        shown = {"color": colour, "ls": line, "lw": 0.8, "marker": marker, "ms": 3, "markevery": 25}
        drift.semilogy(t[::20], 1e3 * speed[::20], label=f"{each.wrong} biased, {each.when}", **shown)
    drift.set_xlabel("time since the twin is rendered [s]")
    drift.set_ylabel("speed of the handle [mm/s]")
    drift.legend(fontsize=6)
