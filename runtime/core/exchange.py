"""Exchanges of the digital twin that a person asks for: when there is one, and what people are told of it."""

from __future__ import annotations

from .events import EventKind
from .machine import Exchanging, Machine
from .modes import Mode
from .phase import Phase

WHEN = (Mode.READY, Mode.HOLDING, Mode.ACTIVE)
"""Nothing moves, or a hand does that a fade can bring to rest; a start or a stop is not disturbed."""


class Exchange:
    """Hands what a person asks for to the machine, and tells what came of it."""

    def __init__(self, machine: Machine, phase: Phase) -> None:
        self._machine = machine if isinstance(machine, Exchanging) and len(machine.twins) > 1 else None
        self._phase = phase
        self._rendered, self._wanted = 0, -1

    def ask(self, number: int) -> None:
        """For the twin of a number, from 1 on."""
        machine, phase = self._machine, self._phase
        index = number - 1
        name = machine.twins[index] if machine and index < len(machine.twins) else str(number)
        if machine is None or (why := _objection(machine, index, phase.mode)):
            why = why if machine else "this session has one twin"
            phase.say(EventKind.NOT_EXCHANGED(twin=name, why=why))
        elif phase.mode is Mode.ACTIVE:
            machine.exchange(index, at_rest=False)
            phase.say(EventKind.EXCHANGING(twin=name))
        else:
            machine.exchange(index, at_rest=True)

    def look(self) -> None:
        """At the end of a tick: tell what has become of an exchange."""
        machine = self._machine
        if machine is None:
            return
        if machine.wanted >= 0 and self._phase.mode is not Mode.ACTIVE:
            machine.give_up("the machine stops")
        if machine.rendered != self._rendered:
            self._rendered = machine.rendered
            self._phase.say(EventKind.EXCHANGED(twin=machine.twins[self._rendered]))
        if machine.abandoned:
            name = machine.twins[self._wanted]
            self._phase.say(EventKind.NOT_EXCHANGED(twin=name, why=machine.abandoned))
            machine.abandoned = ""
        self._wanted = machine.wanted


def _objection(machine: Exchanging, index: int, mode: Mode) -> str:
    """What stands against rendering a twin, for people; "" where nothing does."""
    if index >= len(machine.twins):
        return f"there are {', '.join(machine.twins)}"
    if mode not in WHEN:
        return f"that takes {', '.join(each.name for each in WHEN[:-1])} or {WHEN[-1].name}"
    if machine.wanted >= 0:
        return f"the exchange for {machine.twins[machine.wanted]} is under way"
    if index == machine.rendered:
        return "it is rendered already"
    return ""
