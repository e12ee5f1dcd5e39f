"""Runs the tick's code before it matters: caches, lazily made objects, specialised bytecode."""

from __future__ import annotations

from .config import Loaded
from .cycle import Inputs, Outputs, cycle
from .record import NO_TIMING, RecordWriter
from .session import build

TICKS = 200


def warm_up(loaded: Loaded) -> None:
    """Some ticks of a session of its own, on no bus: nothing is received, nothing is sent."""
    session = build(loaded)
    memory, inputs, outputs = session.memory, Inputs(), Outputs()
    machine, gate = memory.machine, memory.gate
    writer = RecordWriter(memory)
    machine.estimate()
    machine.engage()
    still = [False] * len(machine.axes)
    for tick in range(TICKS):
        inputs.tick = tick
        cycle(inputs, memory, outputs)
        machine.plausibility.accept(1, True)
        machine.estimate()
        memory.monitor.judge(memory.seen)
        machine.update(1.0, 1.0)
        machine.brake(still)
        gate.admit(machine.commands, machine.position, machine.velocity, True, tick, tick, still)
        machine.write(gate.admitted)
        writer.write(inputs, outputs, NO_TIMING)
