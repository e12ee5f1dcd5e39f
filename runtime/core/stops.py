"""Stops: what is latched brings the machine to rest, and what came to rest must stay there."""

from __future__ import annotations

from ...safety import PASS, Reaction, StopLatch, Trip, Verdict
from .drives import Drives
from .events import EventKind
from .machine import Machine
from .modes import STANDING, Mode
from .phase import Phase
from .senses import Senses

BRAKING_MARGIN = 1.5
"""How much longer than planned a controlled stop may take before it becomes a ramp."""
DETECTION_SHARE = 0.2
"""Share of the declared stop time that detection may take; the ramp gets the rest."""
END = "end"
"""Reason of the stop that ends every session; no fault."""


class Stops:
    """Latches stops, and brakes.

    Attributes:
        latch: the stop that stands.
        last: the last stop that was more than the end of the session, None after a reset.
        dropped: one an axis, whether a stop switched its drive off for want of measurements.
        ramp_limit, hold_limit: ticks that a ramp and a controlled stop may take.
    """

    def __init__(
        self, machine: Machine, phase: Phase, senses: Senses, drives: Drives, stop_time: float, rate: float
    ) -> None:
        """``stop_time`` is the declared one, detection and ramp together [s]; ``rate`` in ticks a second."""
        self._machine, self._phase, self._senses, self._drives = machine, phase, senses, drives
        self.latch = StopLatch()
        self.last: Trip | None = None
        self.dropped = [False] * len(machine.axes)
        self.ramp_limit = round((1.0 - DETECTION_SHARE) * stop_time * rate)
        self.hold_limit = round(BRAKING_MARGIN * machine.braking * rate)
        self._ramp = 0

    @property
    def off(self) -> bool:
        """Whether a stop stands that takes the torque off at once (R4)."""
        return self.latch.trip is not None and self.latch.reaction is Reaction.OFF

    def take(self, verdict: Verdict, tick: int) -> None:
        """A stop is latched, and whatever is stronger after it; the strongest stands.

        While no drive has power, what would merely hold the machine (R2) forbids to start as long as it
        lasts; what would switch it off is latched all the same, for it may be gone when somebody presses. A
        machine whose drives just switch on, or got torque so lately that what moved before is not measured
        yet, has nothing to ramp down, and a ramp or a hold might pull at what moved: they switch off again.
        So do those of a machine that is held after a stop: it stands, or it was pushed away and must not be
        pulled back.
        """
        if verdict is PASS:  # nearly every tick
            return
        phase = self._phase
        if not (phase.mode.powered or self.latch.trip) and verdict.reaction < Reaction.RAMP:
            return
        trip = self.latch.take(verdict, tick)
        if not trip:
            return
        if verdict.reason != END:
            self.last = trip
        if phase.mode.powered and phase.mode is not Mode.HOLDING and not phase.starting:
            if phase.mode is not Mode.STOPPING:  # a stronger reason gives a stop no more time
                self._ramp = 0
            mode = Mode.STOPPING
        else:
            mode = Mode.STOPPED
        kind = EventKind.ENDING if verdict.reason == END else EventKind.TRIPPED
        phase.enter(mode, kind(mode=mode.name, **trip.values))

    def release(self, verdict: Verdict) -> bool:
        """Let go of what is latched; whether nothing that is seen, and nothing in ``verdict``, forbids it."""
        if self.latch.reset(verdict, self._senses.held, self._senses.at_rest):
            return False
        self.last = None
        return True

    def brake(self) -> Verdict:
        """Compute commands that bring a powered machine to rest and hold it, and end the stop at rest."""
        phase, dropped = self._phase, self.dropped
        if phase.mode is not Mode.ENABLING:
            self._drop()
        at_rest = self._machine.brake(dropped) or all(dropped)
        if phase.mode is not Mode.STOPPING:
            return PASS
        self._ramp += 1
        reaction = self.latch.reaction
        if reaction is Reaction.HOLD and not all(dropped):
            if at_rest:
                phase.enter(Mode.HOLDING, EventKind.HELD())
            elif self._ramp >= self.hold_limit:
                late = "the controlled stop did not come to rest in time"
                return Verdict(Reaction.RAMP, "stop_timeout", late)
        elif reaction is Reaction.OFF or at_rest or self._ramp >= self.ramp_limit:
            phase.enter(Mode.STOPPED, EventKind.SWITCHED_OFF())
        return PASS

    def watch(self) -> Verdict:
        """What should stand is watched: brakes slip, and what is held may be pushed away."""
        mode = self._phase.mode
        if mode not in STANDING:
            return PASS
        axis = self._phase.standstill.moved(self._machine.position, self._senses.slow)
        if axis < 0:
            return PASS
        name, held = self._machine.axes[axis].name, mode is Mode.HOLDING
        detail = f"{name} was pushed away" if held else f"{name} moves, though its brake should hold it"
        return Verdict(Reaction.RAMP if held else Reaction.OFF, "moved", detail)

    def forget_dropped(self) -> None:
        """A start switches all drives on again."""
        self.dropped[:] = [False] * len(self.dropped)

    def _drop(self) -> None:
        """Switch off, until the next start, the drives of axes that nothing reliable is known of."""
        for i, trusted in enumerate(self._senses.monitor.trust.axes):
            if not (trusted or self.dropped[i]):
                self.dropped[i] = True
                self._drives.power.drop(i)
                self._phase.say(EventKind.AXIS_DROPPED(axis=self._machine.axes[i].name))
