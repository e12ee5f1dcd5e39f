"""Runs a machine against its plant in one process, in virtual time, as fast as it goes."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ...devices.adapter import memory_pair
from ...devices.frames import Frames
from ..configuration.session import Session
from ..configuration.system import Plant
from ..core.modes import Command, Mode
from ..core.tick import Inputs


@contextmanager
def unswept() -> Iterator[None]:
    """Keep the garbage collector off: ticks leave it nothing, and it looks through everything that lives."""
    swept = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if swept:
            gc.enable()


class Lockstep:
    """A session coupled to a plant, one tick at a time.

    Attributes:
        session: the daemon's side.
        plant: the machine's side.
        inputs, outputs: of the last tick.
    """

    def __init__(self, session: Session, plant: Plant | None = None) -> None:
        self.session = session
        self.plant = plant or session.plant()
        self.inputs, self.outputs = Inputs(), session.cycle.outputs
        self._dt = 1.0 / session.config.loop.rate
        self._daemon, self._bus = memory_pair()
        self._requests, self._answers = Frames(), Frames()
        self._next = 0

    @property
    def mode(self) -> Mode:
        """Mode of the machine."""
        return self.session.cycle.mode

    def tick(self, commands: Command = Command.NONE, skipped: int = 0) -> None:
        """One tick of the daemon, then one period of the plant.

        Args:
            commands: of a person.
            skipped: ticks that the daemon sleeps through first, while the plant goes on.
        """
        for _ in range(skipped):
            self.plant.step(self._dt)
        inputs = self.inputs
        inputs.tick, inputs.skipped, inputs.commands = self._next + skipped, skipped, commands
        self._daemon.receive(inputs.frames)
        self.session.cycle.run(inputs)
        self._next = inputs.tick + 1
        self._daemon.send(self.outputs.frames)
        self.exchange()
        self.plant.step(self._dt)

    def exchange(self) -> None:
        """Let the plant take what was sent, and answer."""
        self._bus.receive(self._requests)
        self._answers.clear()
        self.plant.exchange(self._requests, self._answers)
        self._bus.send(self._answers)

    def run(self, ticks: int, after_tick: Callable[[], None] = lambda: None) -> None:
        """Several ticks; ``after_tick`` is called after each."""
        with unswept():
            for _ in range(ticks):
                self.tick()
                after_tick()
