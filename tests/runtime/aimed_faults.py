"""One or two faults at a chosen moment of a session."""

from __future__ import annotations

import functools
import random

from hapticd.runtime.core.drives import TRANSITION_DEADLINE_S
from hapticd.runtime.core.modes import Command, Mode
from hapticd.sim import faults
from hapticd.sim.person import Deed
from hapticd.testing.copies import in_a_copy

from .campaign import VERBS, Campaign

NO_FAULTS = ("press", "reset", "heal", "arm")
MOMENTS = ("ENABLING", "ENGAGING", "ACTIVE", "STOPPING", "HOLDING", "reset")
FAULTS = (*(verb for verb in dict.fromkeys(VERBS) if verb not in NO_FAULTS), "wrench", "corrupt")
FOUND_WITHIN = {
    **dict.fromkeys(("stop", "release", "e-stop", "intrude", "blip"), 2),
    **dict.fromkeys(("fault", "mode", "fall"), 3),
    "silent": 7,
}
"""Ticks until what stops a machine that runs must be latched (docs/fault-matrix.md)."""
REST_S, AGAIN_S = 0.11, 0.2
"""What it takes until a machine is known to stand, and until a reset is done."""


class Aimed(Campaign):
    """One or two faults at a moment of a session."""

    def pause(self, seconds: float) -> None:
        for _ in range(self.bench.ticks(seconds)):
            self.step()

    def until(self, *modes: Mode, seconds: float) -> bool:
        """Whether one of them came."""
        for _ in range(self.bench.ticks(seconds)):
            if self.bench.mode in modes:
                break
            self.step()
        return self.bench.mode in modes

    def bring(self, mode: Mode) -> None:
        """To the beginning of a mode on the way to ACTIVE, the way people start it."""
        assert self.until(Mode.READY, seconds=1.0), self.bench.said
        if mode is not Mode.READY:
            self.pause(REST_S)
            self.press(True)
            assert self.until(mode, seconds=4.0), self.bench.said

    def lead(self, moment: str) -> None:
        """From a running machine to a moment, or to a stop that comes before it."""
        rng, bench = self.random, self.bench
        if moment == "ENABLING":
            self.pause(REST_S)
            self.press(True)
            self.until(Mode.ENABLING, seconds=0.1)
            self.pause(rng.choice((0, 1, 2, 3)) * bench.dt)
            return
        self.pause(rng.uniform(0.0, 0.2))
        if moment == "STOPPING":
            if rng.random() < 0.5:
                rng.choice(self.drives).tamper = faults.drop(6)
            else:
                self.press(False)
            self.until(Mode.STOPPING, seconds=0.05)
            self.pause(rng.choice((0.0, 0.002, 0.01, 0.03)))
        elif moment == "HOLDING":
            rng.choice(self.drives).tamper = faults.drop(6)
            self.until(Mode.HOLDING, Mode.STOPPED, seconds=0.8)
            self.pause(rng.choice((0.0, 0.002, 0.01, 0.05)))
        elif moment == "reset":
            if rng.random() < 0.5:
                bench.plc.emergency_stop = (True, True)
                self.pause(0.01)
                bench.plc.emergency_stop = (False, False)
            self.press(False)
            self.until(Mode.STOPPED, seconds=0.8)
            self.pause(rng.choice((0.0, 0.1, 0.2)))
            self.step(Command.RESET)
            self.pause(rng.choice((0.0, 0.002, 0.01, 0.02, 0.05)))

    def found_within(self) -> int:
        """Ticks within which the last fault stops a machine that runs, 0 where it need not."""
        lasting = self.done in ("drop", "duplicate", "delay") and self.count >= 30
        harmless = self.done == "e-stop" and not any(self.bench.plc.emergency_stop)
        if lasting:
            return FOUND_WITHIN["silent"]
        return 0 if harmless else FOUND_WITHIN.get(self.done, 0)

    def strike(self, count: int) -> None:
        """So many faults, shortly after each other, and what comes of them."""
        rng, bench = self.random, self.bench
        for left in reversed(range(count)):
            running = bench.mode in (Mode.ENGAGING, Mode.ACTIVE) and bench.cycle.stops.latch.trip is None
            commands, skipped = self.do(FAULTS)
            self.step(commands, skipped)
            within = self.found_within()
            if running and count == 1 and within:
                for _ in range(within):
                    self.step()
                if bench.cycle.stops.latch.trip is None:
                    self.note(len(self.log), f"{self.done} is not found within {within} ticks")
            if left:
                self.pause(rng.choice((0.0, 0.001, 0.003, 0.01, 0.04)))
        self.pause(bench.lockstep.session.config.safety.stop_time + TRANSITION_DEADLINE_S + 0.05)

    def go_on(self) -> None:
        """A person lets go, heals what is wrong or not, resets, and presses again; the hand rests."""
        if self.random.random() < 0.5:
            self.heal()
        self.bench.plant.obey(Deed.RELEASE)
        self.press(False)
        self.step()
        self.step(Command.RESET)
        self.pause(AGAIN_S)
        self.press(True)
        self.pause(AGAIN_S / 2)

    def aim(self, moment: str, seed: int) -> list[str]:
        """What was found."""
        self.random = random.Random(f"{self.machine} {self.rate} {moment} {seed}")
        self.lead(moment)
        self.strike(self.random.choice((1, 2)))
        self.go_on()
        return self.found


@functools.cache
def brought(machine: str, rate: str, mode: Mode) -> Aimed:
    """A session that has just come into a mode; use it in a copy."""
    session = Aimed(0, machine, rate)
    session.bring(mode)
    return session


def before(moment: str) -> Mode:
    """The mode in which a session waits for a moment."""
    return {"ENABLING": Mode.READY, "ACTIVE": Mode.ACTIVE}.get(moment, Mode.ENGAGING)


@in_a_copy
def aimed(session: Aimed, moment: str, seed: int) -> None:
    assert session.aim(moment, seed) == []
