"""Beyond the paper: stops of the giant at random moments under random hands, and the next start there.

The machine is a plant of its own: its joints rub, and its sensors err. What is told is how far beyond any
limit, or beyond where the stop began if that was outside, it passes on the way, and how far beyond it lies
once its brakes are closed; and whether a new press there makes it render its twin again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from random import Random
from typing import Any

import numpy as np

from ..machines.giant.plant import GiantPlant
from ..models import Robot
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.configuration.system import find_system
from ..runtime.core.modes import Command, Mode
from ..runtime.live.lockstep import Lockstep, unswept
from ..sim.joint_drive import SimJointDrive
from ..sim.person import Switch
from ..sim.safety_plc import SimSafetyPlc
from .hands import Kept
from .outcome import COLOURS, Outcome, Progress, Row
from .own_plant import Doubt
from .random_hand import stranger
from .temper import Temper

TITLE = "the giant: stops at random moments under random hands, and the next start there"
DOUBT = Doubt(errors=True)
STRENGTHS = {50.0: Temper(50.0, 10.0, 1.5), 150.0: Temper(150.0, 12.0, 2.0)}
"""Tempers of hands by their force [N]."""
CAUSES = ("stop command (R2)", "dead-man released (R3)", "fault of a drive (R3)")
FIRST, FEW, MANY = 130_000, 6, 113
"""Seed of the first hand; how many hands of each strength."""
SOONEST_S, LATEST_S = 0.5, 4.5
"""When the stop comes, after the machine is active [s]."""
UP_S = 6.0
"""From the press of the switch the machine is active within so long, or not at all [s]."""
REST_S, HELD_S = 1.5, 0.3
"""A stop is over within the first [s]; what is held, or braked, is watched for the second."""
RESET_S = 3.0
"""A person who tries again and again has reset the stop within so long [s]."""
FAULT = 0x2310
"""Of a drive: continuous over-current."""
LEAST = {"joints and tilt": 10e-3, "boxes": 5e-3, "PPU": 20e-3}
"""How far beyond limits of a kind a stop may end [rad], [m]."""
UNITS = ("mrad", "mm", "mm")


@dataclass(frozen=True, slots=True)
class Stopped:
    """What became of a session that was stopped.

    Attributes:
        seed: of the hand; force: of its temper [N].
        cause: one of ``CAUSES``; "" where the machine had stopped by itself before.
        speed: of the handle as the stop began [m/s].
        passed, lies: how far beyond limits, by the kinds of ``LEAST`` [rad], [m]; negative inside.
        pressed: whether a new press made it active; said: the last it said where that did not.
    """

    seed: int
    force: float
    cause: str
    speed: float
    passed: dict[str, float]
    lies: dict[str, float]
    pressed: bool
    said: str


def stopped(loaded: Loaded, seed: int, force: float) -> Stopped:
    """A session under the hand of a seed, its stop, and the next start."""
    system = find_system("giant")
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    seconds = 2.0 * UP_S + LATEST_S + REST_S + 2.0 * HELD_S + RESET_S
    led = stranger(loaded.config, system, robot, seed, seconds, STRENGTHS[force])
    lockstep = Lockstep(build(replace(loaded, config=DOUBT.vary(led, seed))))
    with unswept():
        return _stopped(lockstep, seed, force)


class Person:
    """Somebody at the switches of a giant in lockstep; the hand goes on as it likes."""

    def __init__(self, lockstep: Lockstep) -> None:
        assert isinstance(lockstep.plant, GiantPlant)
        self.plant, self.cycle = lockstep.plant, lockstep.session.cycle
        self._lockstep, self._rate = lockstep, lockstep.session.config.loop.rate
        (self._plc,) = self.plant.nodes.of(SimSafetyPlc)
        self.said = ""

    def wait(
        self,
        seconds: float,
        until: Callable[[], bool] = lambda: False,
        watch: Callable[[], None] = lambda: None,
        command: Command = Command.NONE,
    ) -> bool:
        """For a time [s], or until something is so; whether it was. A command comes with the first tick."""
        for _ in range(round(seconds * self._rate)):
            self._lockstep.tick(command)
            command = Command.NONE
            watch()
            for event in self._lockstep.outputs.events:
                self.said = str(event)
            if until():
                return True
        return False

    def mode(self, *modes: Mode) -> Callable[[], bool]:
        """Whether the machine is in one of these."""
        return lambda: self.cycle.mode in modes

    def press(self, pressed: bool) -> None:
        """The dead-man switch."""
        self._plc.turn(Switch.DEAD_MAN, pressed)

    def fault(self, joint: int, code: int) -> None:
        """Of a joint's drive; 0 ends it."""
        self.plant.nodes.of(SimJointDrive)[joint].fault = code

    def reset(self) -> bool:
        """Let go of the switch and reset, again and again if need be; whether the machine then waits."""
        self.press(False)
        ready = self.mode(Mode.READY)
        return any(self.wait(0.6, ready, command=Command.RESET) for _ in range(round(RESET_S / 0.6)))


def _stopped(lockstep: Lockstep, seed: int, force: float) -> Stopped:
    person, random = Person(lockstep), Random(f"stop {seed}")
    cycle, cause = person.cycle, CAUSES[seed % len(CAUSES)]
    person.wait(UP_S, person.mode(Mode.ACTIVE))
    person.wait(random.uniform(SOONEST_S, LATEST_S), lambda: cycle.stops.last is not None)
    speed = _speed(person.plant)
    if cycle.stops.last or cycle.mode is not Mode.ACTIVE:
        return Stopped(seed, force, "", speed, {}, {}, False, person.said)
    kept, joint = Kept(lockstep), random.randrange(6)
    kept.add()  # limits count from here where the machine is outside of them
    command = Command.NONE
    if cause == CAUSES[0]:
        command = Command.STOP
    elif cause == CAUSES[1]:
        person.press(False)
    else:
        person.fault(joint, FAULT)
    person.wait(REST_S, person.mode(Mode.HOLDING, Mode.STOPPED), kept.add, command)
    person.wait(HELD_S, watch=kept.add)
    person.press(False)
    person.wait(REST_S, person.mode(Mode.STOPPED), kept.add)
    person.wait(HELD_S)
    lies = _kinds(kept.lies)
    person.fault(joint, 0)
    pressed = person.reset()
    if pressed:
        person.press(True)
        pressed = person.wait(UP_S, person.mode(Mode.ACTIVE, Mode.STOPPING, Mode.STOPPED))
        pressed = pressed and cycle.mode is Mode.ACTIVE
    passed = {kind: max(most, lies[kind]) for kind, most in _kinds(kept.excess).items()}
    return Stopped(seed, force, cause, speed, passed, lies, pressed, person.said)


def _speed(plant: GiantPlant) -> float:
    x, y = plant.ppu.velocity
    return float(np.linalg.norm(np.add(plant.arm.twist[:3], (x, y, 0.0))))


def _kinds(excess: dict[str, float]) -> dict[str, float]:
    """The worst of each kind of limit."""
    joints, boxes, gantry = LEAST
    found = dict.fromkeys(LEAST, -np.inf)
    for name, value in excess.items():
        kind = gantry if name.startswith("PPU") else joints if name.startswith(("joint", "tilt")) else boxes
        found[kind] = max(found[kind], value)
    return found


def run(progress: Progress) -> Outcome:
    """A few stops."""
    return _outcome(FEW, progress)


def study(progress: Progress) -> Outcome:
    """Many of them."""
    return _outcome(MANY, progress)


def _outcome(count: int, progress: Progress) -> Outcome:
    loaded, found = config.load("giant"), []
    for force in STRENGTHS:
        for k in range(count):
            progress(f"hand of {force:g} N, {k + 1} of {count}")
            found.append(stopped(loaded, FIRST + k, force))
    rows = [row for force in STRENGTHS for row in _rows([each for each in found if each.force == force])]
    figures = {"stops": [{name: getattr(each, name) for name in each.__slots__} for each in found]}
    return Outcome(rows, figures, partial(_draw, found), (7.0, 4.5))


def worst(found: Sequence[dict[str, float]]) -> list[float]:
    """The largest of each kind of ``LEAST``; negative inside."""
    return [max(each[kind] for each in found) for kind in LEAST]


def _rows(found: Sequence[Stopped]) -> list[Row]:
    force = found[0].force
    name = f"hands of at most {force:g} N"
    rows = []
    for cause in CAUSES:
        of = [each for each in found if each.cause == cause]
        if not of:
            continue
        passed, lies = (_written(worst([getattr(each, what) for each in of])) for what in ("passed", "lies"))
        speeds = [each.speed for each in of]
        rows.append(
            Row(
                f"{name}, {cause}: beyond joints and tilt [mrad] / boxes [mm] / PPU [mm], passed; lies",
                "-",
                f"{passed}; {lies}",
                f"{len(of)} stops, the handle at {min(speeds):.2f} to {max(speeds):.2f} m/s",
            )
        )
    stops = [each for each in found if each.cause]
    failed = "; ".join(f"seed {each.seed}: {each.said}" for each in stops if not each.pressed)
    worked = sum(each.pressed for each in stops)
    rows.append(Row(f"{name}: new presses that work", "-", f"{worked} of {len(stops)}", failed))
    if alone := [each for each in found if not each.cause]:
        said = "; ".join(f"seed {each.seed}: {each.said}" for each in alone)
        rows.append(Row(f"{name}: stopped by itself before", "-", str(len(alone)), said))
    return rows


def _written(values: Sequence[float]) -> str:
    return " / ".join(f"{1e3 * value:.1f}" if value > 0.0 else "inside" for value in values)


def _draw(found: Sequence[Stopped], figure: Any) -> None:
    plot = figure.subplots()
    for force, filled in zip(STRENGTHS, (True, False), strict=True):
        for cause, colour, marker in zip(CAUSES, COLOURS, "os^" if filled else "Dv<", strict=False):
            of = [each for each in found if each.cause == cause and each.force == force]
            shares = [max(each.passed[kind] / most for kind, most in LEAST.items()) for each in of]
            plot.plot(
                [each.speed for each in of],
                [100.0 * max(share, 0.0) for share in shares],
                ls="",
                marker=marker,
                color=colour,
                mfc=colour if filled else "none",
                label=f"{force:g} N, {cause}",
            )
    plot.axhline(100.0, color="black", lw=0.8)
    plot.set_xlabel("speed of the handle as the stop begins [m/s]")
    plot.set_ylabel("furthest beyond a limit [% of 10 mrad, 5 mm, PPU 20 mm]")
    plot.legend(fontsize=7)
