"""Where in its life the machine is, and what is said about it."""

from __future__ import annotations

from ...safety import Standstill
from .events import Event, EventKind
from .modes import STANDING, STARTING, Mode

UNSEEN_TICKS = 5
"""Ticks of engaging after which whatever moved while the drives had no torque has been measured."""


class Phase:
    """The machine's mode, and how far it has engaged.

    Attributes:
        mode: of the machine.
        gain: how far the operator's wrench has faded in.
        standstill: watches the axes in modes in which they must not move.
    """

    def __init__(self, standstill: Standstill, fade_ticks: float, events: list[Event]) -> None:
        """Begins with the bring-up.

        Args:
            standstill: started whenever the axes are to stand from now on.
            fade_ticks: time that the operator's wrench takes to fade in.
            events: where to put what happens at a tick.
        """
        self.mode = Mode.BRINGUP
        self.gain = 0.0
        self.standstill = standstill
        self._step = 1.0 / fade_ticks
        self._unseen = UNSEEN_TICKS * self._step
        self._events = events

    @property
    def starting(self) -> bool:
        """Whether what moved while the drives had no torque may not have been measured yet."""
        return self.mode in STARTING and self.gain < self._unseen

    def enter(self, mode: Mode, event: Event) -> None:
        """Come into a mode, with what people are told of it."""
        self.mode = mode
        if mode in STANDING:
            self.standstill.start()
        self.say(event)

    def enable(self) -> None:
        """The drives switch on; the operator's wrench will fade in from the beginning."""
        self.gain = 0.0
        self.enter(Mode.ENABLING, EventKind.ENABLING())

    def fade_in(self) -> None:
        """The operator's wrench moves the machine a little more."""
        self.gain = min(1.0, self.gain + self._step)
        if self.gain == 1.0:
            self.enter(Mode.ACTIVE, EventKind.ENGAGED())

    def say(self, event: Event) -> None:
        """Tell people."""
        self._events.append(event)
