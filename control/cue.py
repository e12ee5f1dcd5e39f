"""What tells an operator's hand that something intervenes: a short vibration, another one for each cause.

A pulse is a whole number of cycles of a cosine under a window of Hann, about its middle. Its sum and its
first moment are zero: it does no work on what moves evenly or accelerates evenly, and leaves a free mass at
rest where it was. What a hand makes of it beyond that is counted, and comes out of a small tank.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi

QUIET, ENERGY, LIMIT, AVATAR_LIMIT, UNLED, STOPPED = range(6)
"""Causes; of several that stand the last one counts: the passivity of the link, the arm's own limits and end
stops, those of the avatar's arm, an avatar that does not follow, one whose arm stopped itself."""


@dataclass(frozen=True, slots=True)
class Rhythm:
    """Pulses of so many cycles each, one after another.

    Attributes:
        frequency: [Hz].
        cycles: of a pulse, 2 or more: below that its sum is not zero.
        pulses: how many.
    """

    frequency: float
    cycles: int
    pulses: int


RHYTHMS = {
    ENERGY: Rhythm(50.0, 6, 3),
    LIMIT: Rhythm(100.0, 12, 1),
    AVATAR_LIMIT: Rhythm(70.0, 8, 2),
    UNLED: Rhythm(35.0, 6, 2),
    STOPPED: Rhythm(25.0, 10, 1),
}
"""Frequencies are apart by a factor of 1.4 or more, above a hand's tremor and a sensor's pass-band."""
LEAST_RATE = 4.0 * max(rhythm.frequency for rhythm in RHYTHMS.values())
"""Of ticks that can tell their cycles [Hz]."""
GAP_S, PERIOD_S = 0.06, 1.0
"""Between two pulses; from one announcement to the next, as long as the cause stands."""
FAINT = 0.5
"""Share of the force with which the least intervention is announced; it grows to all of it."""
MOST, FULL, FILL = 10e-3, 2e-3, 0.2e-3
"""Of the tank: what it holds [J], below what level cues grow faint [J], and what flows in [W]."""


def pattern(rhythm: Rhythm, dt: float) -> list[float]:
    """An announcement and the gap after it, -1 to 1, one number a tick of dt [s].

    Raises:
        ValueError: ticks are too long for its frequency, or it does not fit into the period.
    """
    ticks, gap = round(rhythm.cycles / (rhythm.frequency * dt)), round(GAP_S / dt)
    if ticks < 4 * rhythm.cycles or rhythm.pulses * (ticks + gap) * dt > PERIOD_S:
        raise ValueError(f"{rhythm} does not fit into {PERIOD_S:g} s of ticks of {dt:g} s")
    phases = [2.0 * pi * (k / ticks - 0.5) for k in range(ticks)]
    pulse = [0.5 * (1.0 + cos(phase)) * cos(rhythm.cycles * phase) for phase in phases]
    return (pulse + [0.0] * gap) * rhythm.pulses


class Cue:
    """Announces a cause along an axis of the palm, again and again as long as it stands.

    An announcement that has begun is not cut off, so that its pulses stay whole. But for what a palm does
    within a tick, the force gives out no more than ``MOST`` + ``FILL`` t in any time t.

    Attributes:
        force: of this tick [N].
        cause: that is being announced, QUIET where none is.
        level: of the tank [J].
    """

    def __init__(self, force: float, dt: float) -> None:
        """Largest force of a cue [N], 0 for none; period of a tick [s].

        Raises:
            ValueError: see ``pattern``.
        """
        self._most, self._dt, self._period = force, dt, round(PERIOD_S / dt)
        self._patterns = {cause: pattern(rhythm, dt) for cause, rhythm in RHYTHMS.items()} if force else {}
        self._row: list[float] = []
        self._last, self._k, self._force = QUIET, 0, 0.0
        self.force, self.cause, self.level = 0.0, QUIET, MOST

    def reset(self) -> None:
        """Fall silent at once."""
        self.force, self.cause, self._last, self._row = 0.0, QUIET, QUIET, []

    def update(self, cause: int, share: float, velocity: float) -> float:
        """The force of a tick [N].

        Args:
            cause: that stands now.
            share: how much it intervenes, 0 to 1; it counts when an announcement begins.
            velocity: of the palm along the axis, since the last tick [m/s].
        """
        self.level = min(MOST, self.level + self._dt * (FILL - self.force * velocity))
        over = self._k >= len(self._row)
        if over and cause in self._patterns and (cause != self._last or self._k >= self._period):
            self._last, self._row, self._k, over = cause, self._patterns[cause], 0, False
            self._force = self._most * (FAINT + (1.0 - FAINT) * min(1.0, max(0.0, share)))
        self.cause = QUIET if over else self._last
        self.force = 0.0 if over else self._force * self._row[self._k] * self._allowed()
        self._k += 1
        return self.force

    def _allowed(self) -> float:
        """Share of a force that the tank allows."""
        return min(1.0, max(0.0, self.level / FULL))
