"""A machine in lockstep with its simulated plant: what happens to it, and what it does."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from ..devices.cia301 import AlState
from ..devices.cia402 import State
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.core.events import Event
from ..runtime.core.modes import Command, Mode
from ..runtime.live.lockstep import Lockstep
from ..sim.drive import SimDrive
from ..sim.node import SimNode
from ..sim.plant import SimPlant
from ..sim.safety_plc import SimSafetyPlc
from ..sim.torque_drive import SimTorqueDrive


class Bench:
    """A lockstep session that remembers what happened.

    Attributes:
        lockstep: the session and its plant.
        cycle: of its session.
        plant: Any, because a test may know more of it than that it is a ``SimPlant``.
        nodes: the simulated devices.
        plc: the safety controller.
        events: what people should know, from the beginning.
    """

    def __init__(self, loaded: Loaded) -> None:
        self.lockstep = Lockstep(build(loaded))
        self.cycle = self.lockstep.session.cycle
        assert isinstance(self.lockstep.plant, SimPlant), "let the simulated machine extend SimPlant"
        self.plant: Any = self.lockstep.plant
        self.nodes = self.lockstep.plant.nodes
        (self.plc,) = self.nodes.of(SimSafetyPlc)
        self.events: list[Event] = []

    @property
    def mode(self) -> Mode:
        """Mode of the machine."""
        return self.cycle.mode

    @property
    def said(self) -> list[str]:
        """The events as people read them."""
        return list(map(str, self.events))

    @property
    def tick_index(self) -> int:
        """Index of the last tick."""
        return self.lockstep.inputs.tick

    @property
    def reason(self) -> str:
        """Reason of the stop that stands, "" where none does."""
        trip = self.cycle.stops.latch.trip
        return trip.verdict.reason if trip else ""

    @property
    def dt(self) -> float:
        """Period [s]."""
        return 1.0 / self.lockstep.session.config.loop.rate

    def ticks(self, seconds: float) -> int:
        """How many ticks a time takes."""
        return round(seconds / self.dt)

    def run(self, ticks: int, commands: Command = Command.NONE, skipped: int = 0) -> None:
        """Some ticks; the commands, and the ticks that are skipped, come with the first."""
        for _ in range(ticks):
            self.lockstep.tick(commands, skipped)
            self.events += self.lockstep.outputs.events
            commands, skipped = Command.NONE, 0

    def until(self, *modes: Mode, limit: int = 2000) -> int:
        """Run until one of these modes; how many ticks that took."""
        for ticks in range(limit):
            if self.mode in modes:
                return ticks
            self.run(1)
        raise AssertionError(f"still {self.mode.name} after {limit} ticks: {self.said[-3:]}")

    def press(self, pressed: bool) -> None:
        """The dead-man switch, both channels."""
        self.plc.dead_man = (pressed, pressed)

    def silence_all(self) -> None:
        """No device says anything any more."""
        for node in self.nodes.nodes:
            node.silent = True

    def after_sensing(self, change: Callable[[], object]) -> None:
        """Change what the devices say, whenever they have measured, errors of the sensors included."""
        measure = self.plant._measure

        def changed(dt: float = 0.0) -> None:
            measure(dt)
            change()

        self.plant._measure = changed

    def break_sensor(self, node: str, field: str, value: object, samples: int = 1 << 30) -> None:
        """A sensor reports a value instead of what it measures, for some samples."""
        left = samples

        def broken() -> None:
            nonlocal left
            if left > 0:
                left -= 1
                setattr(self.nodes[node], field, value)

        self.after_sensing(broken)

    @property
    def drives(self) -> list[SimDrive]:
        """All of them, in the order of the network."""
        return self.nodes.of(SimDrive)

    @property
    def joints(self) -> list[SimTorqueDrive]:
        """Those with a torque."""
        return self.nodes.of(SimTorqueDrive)

    @property
    def torques(self) -> list[float]:
        """Joint torques [N m]."""
        return [joint.torque for joint in self.joints]

    @property
    def last_drive(self) -> SimDrive:
        """An axis where the machine has axes."""
        return self.drives[-1]

    @property
    def safe(self) -> bool:
        """Whether no drive has power."""
        return bool(self.plant.safe)


def fall(node: SimNode) -> None:
    """A device falls back to SAFEOP, reports no error, and goes on answering."""
    node.tripped, node.al_state = True, AlState.SAFEOP


def weld(drive: SimDrive) -> None:
    """A drive's power stage stays on, whatever it is told; only STO takes its torque."""
    drive.state = State.OPERATION_ENABLED
    drive.deaf = drive.welded = True


def creep(bench: Bench, drive: SimDrive, speed: float) -> None:
    """The encoders of a drive report an axis that moves, whatever holds it [rad/s or m/s]."""
    gone = 0.0

    def slip() -> None:
        nonlocal gone
        gone += speed * bench.dt
        drive.position += gone
        if isinstance(drive, SimTorqueDrive):
            drive.link_position += gone
        drive.velocity = speed

    bench.after_sensing(slip)


Make = Callable[[str], Bench]
"""Puts the machine of a name on a bench."""
Bring = Callable[[Bench], object]
"""Runs a session to where tests begin."""


@functools.cache
def _brought(make: Make, name: str, bring: Bring) -> tuple[Bench, int]:
    bench = make(name)
    bring(bench)
    return bench, bench.lockstep._next


def parked(make: Make, name: str, bring: Bring) -> Bench:
    """The same session for every test that asks for it: each runs in a copy of the process.

    It is made and brought once; ``make`` and ``bring`` must be the same objects each time.
    """
    bench, tick = _brought(make, name, bring)
    assert bench.lockstep._next == tick, "a parked session was moved, and not in a copy"
    return bench
