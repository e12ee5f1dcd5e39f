"""How long an arm may follow what it hears of its peer, and what a person must do after a silence.

The times are those of row 30 of docs/fault-matrix.md, beyond the delay that the link is declared to have.
"""

from __future__ import annotations

from enum import Enum
from math import inf
from typing import Final

FRESH_S: Final = 20e-3
"""What is older moves nothing."""
TOLD_S: Final = 0.1
"""From here on people are told."""
ENDS_S: Final = 2.0
"""A lease that hears nothing for so long has ended."""


class Standing(Enum):
    """What an arm has to do with its peer."""

    IDLE = "has not been led yet"
    FOLLOWS = "follows"
    RESTS = "rests: the operator's arm does not lead"
    WAITS = "holds: the link is late"
    SILENT = "holds: the link is silent"
    ENDED = "holds: the link was silent for too long; a new act of the operator is needed"
    BARRED = "holds: it stopped; a new act of the operator is needed"


_NUMBERS: Final = {standing: i for i, standing in enumerate(Standing)}


class Lease:
    """One arm's leave to follow its peer; each ``act`` of the operator, a number, gives one.

    Attributes:
        standing: after the last tick.
        useless: ticks in which what was heard made no sense.
    """

    def __init__(self, delay: float, dt: float) -> None:
        """Longest delay that is no fault, and period [s]."""
        self._delay, self._dt = delay, dt
        self._unusable = 0.0
        self.useless = 0
        self._barred = self._act = 0  # nobody has acted yet
        self._bar = Standing.IDLE
        self._untold = False
        self.standing = Standing.IDLE

    @property
    def number(self) -> int:
        """Of the standing, as a log keeps it: its place in the class."""
        return _NUMBERS[self.standing]

    @property
    def follows(self) -> bool:
        """Whether the arm may move with its peer."""
        return self.standing is Standing.FOLLOWS

    def update(self, age: float, valid: bool, leads: bool, act: int, told: bool = True) -> bool:
        """Take what is known at a tick; whether the arm may move with its peer.

        Args:
            age: of what was heard last [s].
            valid: whether it makes sense; what does not was not heard.
            leads: whether the peer takes part.
            act: the operator's last one.
            told: whether whoever acts says to know that this arm does not follow.
        """
        # what is not a number is no age
        usable = valid and age >= 0.0
        silent = age - self._delay if usable else inf
        self.useless += not usable
        # nonsense that keeps coming is a silence as well: its age never grows, so its ticks are counted
        self._unusable = 0.0 if silent <= FRESH_S else self._unusable + self._dt
        if silent <= FRESH_S:
            self._act = act
            if self._untold:  # what was done before anybody there knew of the stop ends no stop
                self._barred, self._untold = act, not told
            if act == self._barred:
                self.standing = self._bar
            else:
                self.standing = Standing.FOLLOWS if leads else Standing.RESTS
        elif self._barred == self._act:
            self.standing = self._bar
        elif (usable and silent > ENDS_S) or self._unusable > ENDS_S:
            self._barred, self._bar = self._act, Standing.ENDED
            self.standing = Standing.ENDED
        else:
            self.standing = Standing.SILENT if silent > TOLD_S else Standing.WAITS
        return self.follows

    def bar(self, told: bool = True) -> None:
        """The arm stopped by itself: neither the act that led it leads it, nor any before the operator knows.

        Args:
            told: whether the operator knows at once; else ``update`` has to say so.
        """
        self._barred, self._bar, self._untold = self._act, Standing.BARRED, not told
        self.standing = Standing.BARRED


class Fader:
    """A share that rises slowly and falls fast, for what comes from the peer.

    Attributes:
        share: 0 to 1.
    """

    def __init__(self, rise: float, fall: float, dt: float) -> None:
        """Times from 0 to 1 and back, and of a tick [s]."""
        self.share = 0.0
        self._up, self._down = dt / rise, dt / fall

    def update(self, on: bool) -> float:
        """The share after another tick."""
        share = self.share + self._up if on else self.share - self._down
        self.share = min(1.0, max(0.0, share))
        return self.share


class Granted:
    """Energy that the other side has handed over since this side began to count, whatever it counts from.

    Attributes:
        total: [J].
    """

    def __init__(self) -> None:
        self.total = 0.0
        self._last: float | None = None

    def begin(self) -> None:
        """Count anew: what was handed over before is gone."""
        self.total, self._last = 0.0, None

    def update(self, sent: float) -> float:
        """Take the newest sum that the other side has sent [J]; the total. It begins anew where it falls."""
        if self._last is not None and sent > self._last:
            self.total += sent - self._last
        self._last = sent
        return self.total
