"""A session in which people and faults do anything at random; the plant judges what must never be."""

from __future__ import annotations

import functools
import random
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from math import nan

from hapticd.configs import read_text
from hapticd.devices.cia301 import AlState
from hapticd.devices.frames import Frames
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.drives import TRANSITION_DEADLINE_S
from hapticd.runtime.core.modes import Command, Mode
from hapticd.runtime.core.tick import Inputs
from hapticd.runtime.recording.record import NO_TIMING, RecordWriter
from hapticd.safety import Reaction
from hapticd.sim import faults
from hapticd.sim.drive import SimDrive
from hapticd.sim.force_torque import SimForceTorque
from hapticd.sim.node import SimNode
from hapticd.testing.bench import fall, weld
from hapticd.testing.energy import Energy

from .conftest import MACHINES, Bench, loaded

LATENCY = 4
"""Ticks from what happens in the plant until the cycle has answered it there."""
TICKS = 1500
VERBS = tuple(
    "press release release reset heal heal stop arm unrecorded weld weld deaf silent drop duplicate delay "
    "fault cycle fall intrude blip e-stop skip mode turn freeze shift".split()
)
AIMED = (Mode.ENABLING, Mode.ENGAGING, Mode.STOPPING, Mode.HOLDING)
"""Modes that pass quickly: something happens there on purpose, in every other session."""
RATES = ("500 Hz", "1 kHz", "4 kHz")
GIVEN = {
    **{"giant": 2.3, "rhi": 0.05, "panda": 0.7, "panda_rhi": 0.7, "panda_stamp": 0.7},
    **{"operator": 0.7, "avatar": 0.7, "giant_avatar": 0.7},
}
"""Energy that springs and brakes may set in motion after a stop, as in the tests of braking [J]."""


def changes(machine: str, rate: str) -> tuple[tuple[str, str], ...]:
    """Nobody presses, and a rate; the plant's own steps stay as short as they are built in."""
    text = read_text(f"{machine}.toml")
    (pressed,) = re.findall(r"^dead_man = .*", text, re.M)
    substeps = re.search(r"^substeps = (\d+)", text, re.M)
    assert substeps
    made = [(pressed, "dead_man = []")]
    if rate != "1 kHz":
        made.append(('rate = "1 kHz"', f'rate = "{rate}"'))
    if rate == "500 Hz":
        made.append((substeps[0], f"substeps = {2 * int(substeps[1])}"))
    return tuple(made)


class Campaign:
    """One session with faults at random moments, and what must never be."""

    def __init__(self, seed: int, machine: str = "", rate: str = "") -> None:
        self.random = random.Random(seed)
        self.machine = machine or self.random.choice(MACHINES)
        self.rate = rate or self.random.choice(("500 Hz", "1 kHz", "1 kHz", "1 kHz", "4 kHz"))
        self.changes = changes(self.machine, self.rate)
        self.aims = self.random.random() < 0.5
        self.bench = Bench(*self.changes, machine=self.machine)
        hertz = self.bench.lockstep.session.config.loop.rate
        self.dt, self.deadline = 1.0 / hertz, round(TRANSITION_DEADLINE_S * hertz)
        self.energy: Energy | None = None
        self.before = 0.0
        self.obedient = True
        self.writer = RecordWriter(self.bench.cycle)
        self.log: list[tuple[int, int, int, bytes, bytes]] = []
        self.drives = self.bench.nodes.of(SimDrive)
        self.found: list[str] = []
        self.modes: Counter[str] = Counter()
        self.powered = self.pressed_at = self.ready_at = 0
        self.recorded = True
        self.wrong: dict[SimNode, Callable[[], object]] = {}
        self.bench.after_sensing(lambda: [wrong() for wrong in self.wrong.values()])
        self.held = False
        self.done, self.count = "", 0
        self.stands: dict[str, int] = {}
        self.ramping = self.stopping = 0

    def run(self) -> list[str]:
        """What was found."""
        bench, rng = self.bench, self.random
        due = 120  # about when the devices have come up
        for tick in range(TICKS):
            commands, skipped = Command.NONE, 0
            if tick >= due:
                due = tick + rng.choice((1, 3, 10, 40, 60, 80))
                commands, skipped = self.happen()
            before = bench.mode
            self.step(commands, skipped)
            if self.aims and bench.mode in AIMED and bench.mode is not before:
                due = tick + 1 + rng.choice((0, 1, 2, 3, 5, 8, 13, 30))
        return self.found + self.replayed()

    def step(self, commands: Command = Command.NONE, skipped: int = 0) -> None:
        """A tick, and what must not be after it."""
        bench = self.bench
        before = bench.mode
        bench.run(1, commands, skipped)
        if skipped:
            self.energy = None
        inputs = bench.lockstep.inputs
        record = self.writer.write(inputs, NO_TIMING)
        self.log.append((inputs.tick, skipped, int(commands), bench.cycle.packed, record))
        self.judge(len(self.log) - 1, before)

    def happen(self) -> tuple[Command, int]:
        """A person tries to get on, or something breaks somewhere."""
        bench, rng = self.bench, self.random
        if rng.random() < 0.5 and not (self.aims and bench.mode in AIMED):
            if bench.mode is Mode.STOPPED:
                if rng.random() < 0.7:
                    self.heal()
                self.press(False)
                return Command.RESET, 0
            if bench.mode is Mode.READY:
                self.press(not self.held)
                return Command.NONE, 0
        return self.do(VERBS)

    def do(self, verbs: Sequence[str]) -> tuple[Command, int]:
        """One of these; commands and skipped ticks that come with it."""
        bench, rng = self.bench, self.random
        drive, node = rng.choice(self.drives), rng.choice(bench.nodes.nodes)
        self.done = verb = rng.choice(verbs)
        if verb == "fall" and node is bench.plc:  # it would not hear of an STO any more
            node = drive
        match verb:
            case "press" | "release":
                self.press(verb == "press")
            case "reset":
                return Command.RESET, 0
            case "stop":
                return rng.choice((Command.STOP, Command.STOP | Command.RESET)), 0
            case "arm":
                return Command.ARM, 0
            case "unrecorded":
                if rng.random() < 0.1:
                    self.recorded = False
                    return Command.UNRECORDED, 0
            case "skip":
                return Command.NONE, rng.choice((1, 5, 25))
            case "heal":
                self.heal()
            case "e-stop":
                bench.plc.emergency_stop = rng.choice(((True, True), (False, True), (False, False)))
            case "wrench":
                self.blind(rng.choice((nan, 1e30, 0.0)))
            case "intrude" | "blip":
                self.inject(verb, node)
            case _:
                self.break_(verb, drive, node)
        return Command.NONE, 0

    def press(self, pressed: bool) -> None:
        if pressed and not self.held:
            self.pressed_at = len(self.log)
        self.held = pressed
        self.bench.press(pressed)

    def heal(self) -> None:
        self.bench.plc.emergency_stop = (False, False)
        self.wrong.clear()
        for node in self.bench.nodes.nodes:
            node.silent, node.tamper = False, None
        for drive in self.drives:
            drive.fault, drive.mode = 0, drive.own_mode
            drive.deaf = drive.welded = False

    def inject(self, verb: str, node: SimNode) -> None:
        frames, emcy = Frames(), 0x080 + node.device.node
        if verb == "intrude":
            frames.append(self.random.choice((0x000, 0x080, 0x601)), bytes(8))
        else:
            frames.append(emcy, b"\x10\x23\x01" + bytes(5))
            frames.append(emcy, bytes(8))
        self.bench.lockstep._bus.send(frames)

    def break_(self, verb: str, drive: SimDrive, node: SimNode) -> None:
        self.count = count = self.random.choice((1, 4, 6, 30, 400))
        self.obedient &= verb not in ("weld", "deaf")
        if verb in ("turn", "freeze", "shift"):
            self.mismeasure(verb, drive)
        if verb == "weld" and drive.powered:  # it stays on; one that is off stays off
            weld(drive)
        elif verb == "deaf":
            drive.deaf = True
        elif verb == "silent":
            node.silent = True
        elif verb in ("drop", "duplicate", "delay"):
            node.tamper = getattr(faults, verb)(count)
        elif verb == "corrupt":
            node.tamper = faults.corrupt(count, self.random.randrange(24), 1 << self.random.randrange(8))
        elif verb == "fault":
            drive.fault = 0x2310
        elif verb == "mode":
            drive.mode = 8
        elif verb == "cycle" and self.random.random() < 0.1:
            drive.reset()
        elif verb == "fall":
            fall(node)

    def blind(self, value: float) -> None:
        """The force-torque sensor reports one value from now on."""
        sensor = self.random.choice(self.bench.nodes.of(SimForceTorque))
        self.wrong[sensor] = functools.partial(setattr, sensor, "wrench", [value] * 6)

    def mismeasure(self, verb: str, drive: SimDrive) -> None:
        """The encoder of a drive is wrong from now on."""
        position, velocity, by = drive.position, drive.velocity, self.random.uniform(-0.3, 0.3)

        def wrong() -> None:
            if verb == "turn":
                drive.velocity = -drive.velocity
            elif verb == "freeze":
                drive.position, drive.velocity = position, velocity
            else:
                drive.position += by

        self.wrong[drive] = wrong

    def weigh(self, tick: int) -> None:
        """After a stop only hand and gravity give energy."""
        bench = self.bench
        if bench.mode not in (Mode.STOPPING, Mode.HOLDING, Mode.STOPPED):
            self.energy = None
            return
        if self.energy is None:
            self.energy = Energy(bench.plant)
            self.before = self.energy.kinetic
            return
        energy = self.energy
        energy.take(self.dt)
        given = energy.kinetic - self.before - energy.hand - energy.gravity - energy.lifted
        if given > GIVEN[self.machine]:
            self.note(tick, f"a stop gives energy: {given:.1f} J")

    def judge(self, tick: int, before: Mode) -> None:
        bench, mode = self.bench, self.bench.mode
        self.modes[mode.name] += 1
        self.weigh(tick)
        has_power = any(drive.powered for drive in self.drives)
        off = bench.cycle.stops.latch.reaction is Reaction.OFF and bench.plc.sto
        self.powered = self.powered + 1 if has_power and not (mode.powered or off) else 0
        if mode is Mode.READY and before is not Mode.READY:
            self.ready_at = tick
        if self.powered > self.deadline + LATENCY:
            self.note(tick, "a drive has power in a stopped machine, and no STO follows")
        if mode is Mode.READY and self.powered > LATENCY:
            self.note(tick, "ready with a powered drive")
        if mode is Mode.ENABLING and before is not Mode.ENABLING:
            recent = self.pressed_at >= max(self.ready_at, tick - LATENCY) - 1
            if before is not Mode.READY or not recent:
                self.note(tick, f"armed from {before.name} without a new press")
            if not self.recorded:
                self.note(tick, "armed unrecorded")
            if stands := [what for what, ticks in self.stands.items() if ticks > LATENCY]:
                self.note(tick, f"armed although {', '.join(stands)}")
        self.stands = {what: self.stands.get(what, 0) + 1 for what in self.standing()}
        self.time_stops(tick, has_power)
        if bench.cycle.stops.latch.trip and mode in (Mode.READY, Mode.ENABLING, Mode.ENGAGING, Mode.ACTIVE):
            self.note(tick, f"{mode.name} with a latched stop")

    def standing(self) -> Iterator[str]:
        """What is wrong now, and would be seen by whoever looks."""
        for node in self.bench.nodes.nodes:
            name = node.device.name
            if node.silent:
                yield f"{name} is silent"
            if node.al_state is not AlState.OP:
                yield f"{name} is not in OP"
        for drive in self.drives:
            name = drive.device.name
            if drive.fault:
                yield f"{name} has a fault"
            if drive.mode != drive.own_mode:
                yield f"{name} is in another mode"
        if any(self.bench.plc.emergency_stop):
            yield "the emergency stop is pressed"

    def time_stops(self, tick: int, has_power: bool) -> None:
        """A stop takes as long as it may."""
        stops, mode = self.bench.cycle.stops, self.bench.mode
        reaction = stops.latch.reaction
        self.ramping = self.ramping + 1 if reaction >= Reaction.RAMP and has_power else 0
        most = stops.ramp_limit if reaction is Reaction.RAMP else 0
        if self.ramping > most + LATENCY + (0 if self.obedient else self.deadline + LATENCY):
            self.note(tick, f"power {self.ramping} ticks after {reaction.code}")
        self.stopping = self.stopping + 1 if mode is Mode.STOPPING else 0
        if self.stopping > stops.hold_limit + stops.ramp_limit:
            self.note(tick, f"a stop of {self.stopping} ticks")

    def note(self, tick: int, what: str) -> None:
        if not any(what[:20] in known for known in self.found):
            self.found.append(f"{self.machine} at {self.rate}, tick {tick}: {what}; {self.bench.said[-3:]}")

    def replayed(self) -> list[str]:
        """Whether the recorded inputs give the same again."""
        session = build(loaded(*self.changes, machine=self.machine))
        writer, inputs = RecordWriter(session.cycle), Inputs()
        for tick, skipped, commands, frames, record in self.log:
            inputs.frames.unpack(frames)
            inputs.tick, inputs.skipped, inputs.commands = tick, skipped, Command(commands)
            session.cycle.run(inputs)
            if writer.write(inputs, NO_TIMING) != record:
                return [f"{self.machine}, tick {tick}: the replay differs"]
        return []
