"""Drives that disobey, people who type and press, a bus that loses things, all at random; the plant judges.

python -m tests.runtime.test_random_faults FIRST LAST     runs more of them
"""

from __future__ import annotations

import random
import sys
from collections import Counter

import pytest
from hapticd.devices.frames import Frames
from hapticd.runtime.cycle import TRANSITION_DEADLINE_S, Inputs, Outputs, cycle
from hapticd.runtime.modes import Command, Mode
from hapticd.runtime.record import NO_TIMING, RecordWriter
from hapticd.runtime.session import build
from hapticd.safety import Reaction
from hapticd.sim import faults
from hapticd.sim.drives import SimDrive
from hapticd.sim.node import SimNode

from .conftest import MACHINES, Bench, fall, loaded, weld

NOBODY_PRESSES = ('dead_man = [{ at = "0.3 s", pressed = true }]', "dead_man = []")
DEADLINE = round(1e3 * TRANSITION_DEADLINE_S)
LATENCY = 4
"""Ticks from what happens in the plant until the cycle has answered it there."""
TICKS = 1500
VERBS = tuple(
    "press release release reset heal heal stop arm unrecorded weld weld deaf silent drop duplicate delay "
    "fault cycle fall intrude blip e-stop skip mode".split()
)


class Campaign:
    """One session with faults at random moments, and what must never be."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        self.machine = self.random.choice(MACHINES)
        self.bench = Bench(NOBODY_PRESSES, machine=self.machine)
        self.writer = RecordWriter(self.bench.memory)
        self.log: list[tuple[int, int, int, bytes, bytes]] = []
        self.drives = self.bench.nodes.of(SimDrive)
        self.found: list[str] = []
        self.modes: Counter[str] = Counter()
        self.powered = self.pressed_at = self.ready_at = 0
        self.recorded = True
        self.held = False

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
            bench.run(1, commands, skipped)
            inputs = bench.lockstep.inputs
            record = self.writer.write(inputs, bench.lockstep.outputs, NO_TIMING)
            self.log.append((inputs.tick, skipped, int(commands), bench.memory.packed, record))
            self.judge(tick, before)
        return self.found + self.replayed()

    def happen(self) -> tuple[Command, int]:
        """A person tries to get on, or something breaks somewhere."""
        bench, rng = self.bench, self.random
        if rng.random() < 0.5:
            if bench.mode is Mode.STOPPED:
                if rng.random() < 0.7:
                    self.heal()
                self.press(False)
                return Command.RESET, 0
            if bench.mode is Mode.READY:
                self.press(not self.held)
                return Command.NONE, 0
        drive, node = rng.choice(self.drives), rng.choice(bench.nodes.nodes)
        match verb := rng.choice(VERBS):
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
        for node in self.bench.nodes.nodes:
            node.silent, node.tamper = False, None
        for drive in self.drives:
            drive.fault, drive.mode = 0, drive.own_mode
            for name in ("outputs_latched", "outputs_invalid"):
                drive.__dict__.pop(name, None)

    def inject(self, verb: str, node: SimNode) -> None:
        frames, emcy = Frames(), 0x080 + node.device.node
        if verb == "intrude":
            frames.append(self.random.choice((0x000, 0x080, 0x601)), bytes(8))
        else:
            frames.append(emcy, b"\x10\x23\x01" + bytes(5))
            frames.append(emcy, bytes(8))
        self.bench.lockstep._bus.send(frames)

    def break_(self, verb: str, drive: SimDrive, node: SimNode) -> None:
        count = self.random.choice((1, 4, 6, 30, 400))
        if verb == "weld" and drive.powered:  # it stays on; one that is off stays off
            weld(drive)
        elif verb == "deaf":
            drive.outputs_latched = lambda: None  # type: ignore[method-assign]
        elif verb == "silent":
            node.silent = True
        elif verb in ("drop", "duplicate", "delay"):
            node.tamper = getattr(faults, verb)(count)
        elif verb == "fault":
            drive.fault = 0x2310
        elif verb == "mode":
            drive.mode = 8
        elif verb == "cycle" and self.random.random() < 0.1:
            drive.reset()
        elif verb == "fall" and node is not self.bench.plc:
            fall(node)

    def judge(self, tick: int, before: Mode) -> None:
        bench, mode = self.bench, self.bench.mode
        self.modes[mode.name] += 1
        has_power = any(drive.powered for drive in self.drives)
        off = bench.memory.latch.reaction is Reaction.OFF and bench.plc.sto
        self.powered = self.powered + 1 if has_power and not (mode.powered or off) else 0
        if mode is Mode.READY and before is not Mode.READY:
            self.ready_at = tick
        if self.powered > DEADLINE + LATENCY:
            self.note(tick, "a drive has power in a stopped machine, and no STO follows")
        if mode is Mode.READY and self.powered > LATENCY:
            self.note(tick, "ready with a powered drive")
        if mode is Mode.ENABLING and before is not Mode.ENABLING:
            recent = self.pressed_at >= max(self.ready_at, tick - LATENCY) - 1
            if before is not Mode.READY or not recent:
                self.note(tick, f"armed from {before.name} without a new press")
            if not self.recorded:
                self.note(tick, "armed unrecorded")
        if bench.memory.latch.trip and mode in (Mode.READY, Mode.ENABLING, Mode.ENGAGING, Mode.ACTIVE):
            self.note(tick, f"{mode.name} with a latched stop")

    def note(self, tick: int, what: str) -> None:
        if not any(what in known for known in self.found):
            self.found.append(f"{self.machine}, tick {tick}: {what}; {self.bench.events[-3:]}")

    def replayed(self) -> list[str]:
        """Whether the recorded inputs give the same again."""
        session = build(loaded(NOBODY_PRESSES, machine=self.machine))
        writer, inputs, outputs = RecordWriter(session.memory), Inputs(), Outputs()
        for tick, skipped, commands, frames, record in self.log:
            inputs.frames.unpack(frames)
            inputs.tick, inputs.skipped, inputs.commands = tick, skipped, Command(commands)
            cycle(inputs, session.memory, outputs)
            if writer.write(inputs, outputs, NO_TIMING) != record:
                return [f"{self.machine}, tick {tick}: the replay differs"]
        return []


@pytest.mark.parametrize("seed", range(6))
def test_whatever_happens_no_drive_keeps_power_and_nothing_starts_by_itself(seed: int) -> None:
    assert Campaign(seed).run() == []


def main(first: int, last: int) -> None:
    modes: Counter[str] = Counter()
    for seed in range(first, last):
        campaign = Campaign(seed)
        for found in campaign.run():
            print(f"seed {seed}: {found}", flush=True)
        modes += campaign.modes
    print(f"{last - first} sessions; ticks by mode {dict(modes)}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
