"""How old a packet is, by what both stations have heard of each other, without a clock that they share."""

from __future__ import annotations

from typing import Final, NamedTuple

DRIFT: Final = 1e-3
"""Two clocks run apart by no more than that; NTP slews each by at most half of it."""


class Age(NamedTuple):
    """What is known of a packet's age [ns].

    Attributes:
        likely: if the way there and back, at their fastest, take the same time.
        most: it is not older, whatever the network does.
        unheard: since the sender last heard of us.
    """

    likely: int
    most: int
    unheard: int


class Ages:
    """Judges the ages of packets that echo our own time stamps; both clocks may show anything.

    A packet bears the sender's clock when it was sent, the newest of our own stamps that the sender has
    heard, and how long ago that was. It was sent after our stamp was heard, and arrived before now: so the
    other clock is ahead of ours by at least ``sent - now`` and at most ``sent - held - echo``. The closest
    bounds of all packets are kept, and loosened by what clocks drift.
    """

    def __init__(self) -> None:
        self._least = self._most = 0
        self._at: int | None = None
        self.jumps = 0
        """How often the bounds contradicted each other: a clock has jumped."""

    def judge(self, now: int, sent: int, echo: int, held: int) -> Age | None:
        """The age of a packet [ns]; None where the echo is not one of our stamps."""
        round_trip = now - echo - held
        if echo <= 0 or round_trip < 0:
            return None
        least, most = sent - now, sent - held - echo
        if self._at is not None:
            slack = int(DRIFT * (now - self._at)) + 1
            tighter = max(least, self._least - slack), min(most, self._most + slack)
            if tighter[0] <= tighter[1]:
                least, most = tighter
            else:
                self.jumps += 1
        self._least, self._most, self._at = least, most, now
        # the bounds are no looser than this packet's own: 0 <= likely <= round_trip
        return Age(now - sent + (least + most) // 2, round_trip, held)
