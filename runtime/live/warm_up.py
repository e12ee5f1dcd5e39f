"""Runs the tick's code before it matters: caches, lazily made objects, specialised bytecode."""

from __future__ import annotations

from ..configuration.config import Loaded
from ..configuration.session import build
from ..core.machine import Exchanging
from ..core.modes import Mode
from ..core.tick import Inputs
from ..recording.record import NO_TIMING, RecordWriter

TICKS = 200


def warm_up(loaded: Loaded) -> None:
    """Some ticks of a session of its own, on no bus: nothing is received, nothing is sent."""
    session = build(loaded)
    cycle, inputs = session.cycle, Inputs()
    machine, gate = cycle.machine, cycle.gate
    writer = RecordWriter(cycle)
    machine.estimate()
    machine.engage()
    twins = len(machine.twins) if isinstance(machine, Exchanging) else 1
    still = [False] * len(machine.axes)
    for tick in range(TICKS):
        inputs.tick = tick
        cycle.run(inputs)
        machine.plausibility.accept(1, True)
        machine.estimate()
        if twins > 1 and isinstance(machine, Exchanging):
            machine.exchange(tick % twins, at_rest=True)
        cycle.senses.judge(tick, 0, Mode.ACTIVE)
        machine.update(1.0, 1.0)
        machine.brake(still)
        gate.admit(machine.commands, machine.position, machine.velocity, True, tick, tick, still)
        writer.write(inputs, NO_TIMING)
