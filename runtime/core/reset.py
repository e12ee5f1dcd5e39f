"""Resets: faults are acknowledged, and a latched stop let go once nothing stands against it."""

from __future__ import annotations

from ...devices.cia402 import State
from ...devices.image import ProcessImage
from ...safety import Verdict, refusal
from .drives import Drives
from .events import EventKind
from .modes import Mode
from .phase import Phase
from .senses import Senses
from .stops import Stops

RESET_DEADLINE_S = 0.5
"""From a reset command until faults and causes must be gone."""
QUIET_S = 0.02
"""For so long nothing must stand against a reset before the latch lets go."""


class Reset:
    """One reset at a time, from the command to its success or refusal.

    Attributes:
        acknowledging: whether the safety PLC is asked to let go.
    """

    def __init__(
        self, image: ProcessImage, phase: Phase, senses: Senses, drives: Drives, stops: Stops, rate: float
    ) -> None:
        self._image, self._phase = image, phase
        self._senses, self._drives, self._stops = senses, drives, stops
        self._limit, self._quiet_limit = round(RESET_DEADLINE_S * rate), max(1, round(QUIET_S * rate))
        self._left = self._quiet = 0
        self.acknowledging = False

    @property
    def under_way(self) -> bool:
        """Whether its deadline runs."""
        return self._left > 0

    @property
    def begins(self) -> bool:
        """Whether its first tick has just run."""
        return self._left == self._limit - 1

    def begin(self) -> None:
        """A person commands it; one that is under way goes on."""
        self._left = self._left or self._limit

    def step(self, tick: int, verdict: Verdict) -> bool:
        """One tick of a reset that is under way; whether it let go of the latched stop.

        Faults are acknowledged on every tick of the deadline until the latch lets go. The safety PLC is
        asked to let go only once nothing else stands against it.

        Args:
            tick: the present one.
            verdict: of the monitor.
        """
        phase = self._phase
        if phase.mode.powered:
            held = phase.mode is Mode.HOLDING
            why = "release the dead-man switch first" if held else "the machine is not at rest yet"
            phase.say(EventKind.NOT_RESET(why=why))
            self._left, self.acknowledging = 0, False
            return False
        if self._left == self._limit:
            self._drives.power.request(State.SWITCH_ON_DISABLED, reset_faults=True)
            self._quiet = 0
        self._left -= 1
        why = self._objection(tick, verdict)
        self.acknowledging = not why
        if not why and self._senses.seen.sto:
            why = "the safety PLC holds the torque off"
        self._quiet = 0 if why else self._quiet + 1
        if self._quiet >= self._quiet_limit and self._stops.release(verdict):
            self._end()
            phase.enter(Mode.READY, EventKind.RESET())
            return True
        if self._left == 0:
            self.refuse(why or "it was not quiet for long enough")
        return False

    def refuse(self, why: str) -> None:
        """It ends without success."""
        self._end()
        self._phase.say(EventKind.NOT_RESET(why=why))

    def _objection(self, tick: int, verdict: Verdict) -> str:
        """What stands against a reset besides an STO, for people; "" where nothing does."""
        senses, power = self._senses, self._drives.power
        live = power.live
        why = f"{live}; it may have power" if live else refusal(verdict, senses.held, senses.at_rest)
        if not why and senses.intruded(tick):
            why = "a second master was heard just now"
        if not why and any(senses.seen.faults):
            why = "devices report errors"
        if not why and not power.ready:
            why = "a drive has not left its fault"
        if why and any(self._image.lost):
            why = "a device restarted or left its operating state; end this session and start another"
        return why

    def _end(self) -> None:
        self._left = 0
        self.acknowledging = False
        self._drives.power.request(State.SWITCH_ON_DISABLED)
