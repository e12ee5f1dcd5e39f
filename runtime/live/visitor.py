"""A person at a view of the session: words that arrive at a socket become the orders of a keyboard.

Each datagram is a word of `viewed`; ``hold``, which presses the simulated dead-man switch for as long as it
is repeated; or ``lead X Y Z``, which leads the simulated hand to a place [m]. Nothing is ever sent back, and
nothing here waits: what does not fit into the socket is lost to its sender.
"""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Sequence
from math import isfinite
from pathlib import Path

from ...sim.person import Deed, Lead
from .console import BREATH_S, Console
from .orders import PRESS, RELEASE, Order

HOLD, LEAD = "hold", "lead"
SILENCE_S = 0.1
"""A page that holds the dead-man switch and is silent for so long has let go."""
LONGEST_WORD = 64
AT_ONCE = 4
"""Words that are taken in a breath."""
OPENING = (Deed.RELEASE, Deed.STRIKE, Deed.LOOK_AWAY, Deed.ENTER_FIELD)
"""Deeds that take away what lets the machine move."""
REACH = 20.0
"""No hand is further away [m]: the range of places in a model."""


class Visitor:
    """Listens where views can find it."""

    def __init__(self, console: Console, orders: Sequence[Order]) -> None:
        """Orders that a view may give; without one that presses, nothing is held or led either."""
        self._console = console
        self._by_word = {order.word: order for order in orders}
        self._holds = PRESS.word in self._by_word
        self._socket: socket.socket | None = None
        self._path: Path | None = None
        self._breath: asyncio.TimerHandle | None = None
        self._release: asyncio.TimerHandle | None = None

    @property
    def words(self) -> list[str]:
        """What may be said."""
        return [*self._by_word, *((HOLD, LEAD) if self._holds else ())]

    def attend(self, loop: asyncio.AbstractEventLoop, path: Path) -> None:
        """Listen from now on at a path that only this user can reach.

        Raises:
            OSError: it cannot be made.
        """
        path.unlink(missing_ok=True)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._socket.bind(os.fspath(path))
        self._path = path
        loop.add_reader(self._socket.fileno(), self._hear, loop)

    def leave(self, loop: asyncio.AbstractEventLoop) -> None:
        """Listen no more."""
        for timer in (self._breath, self._release):
            if timer:
                timer.cancel()
        if self._socket and self._path:
            loop.remove_reader(self._socket.fileno())
            self._socket.close()
            self._path.unlink(missing_ok=True)

    def _hear(self, loop: asyncio.AbstractEventLoop) -> None:
        assert self._socket
        loop.remove_reader(self._socket.fileno())
        self._breath = loop.call_later(BREATH_S, loop.add_reader, self._socket.fileno(), self._hear, loop)
        for _ in range(AT_ONCE):
            try:
                data = self._socket.recv(LONGEST_WORD)
            except OSError:
                return
            word = data.decode("ascii", "replace")
            self._take(word, loop)
            if (order := self._by_word.get(word)) and order.means in OPENING:
                return  # what opens is seen before another page closes it again

    def _take(self, word: str, loop: asyncio.AbstractEventLoop) -> None:
        name, _, rest = word.partition(" ")
        if word == HOLD and self._holds:
            self._hold(loop)
        elif name == LEAD and self._holds:
            place = _place(rest)
            if place:
                self._console.act(place)
        elif order := self._by_word.get(word):
            if order is RELEASE and self._release:
                self._release.cancel()
                self._release = None
            self._console.obey(order)

    def _hold(self, loop: asyncio.AbstractEventLoop) -> None:
        """Press, and let go once nothing renews it."""
        if self._release:
            self._release.cancel()
        else:
            self._console.obey(PRESS)
        self._release = loop.call_later(SILENCE_S, self._silent)

    def _silent(self) -> None:
        self._release = None
        self._console.obey(RELEASE)


def _place(text: str) -> Lead | None:
    """Where the hand is to be led, None for what is no place."""
    try:
        x, y, z = map(float, text.split())
    except ValueError:
        return None
    return Lead((x, y, z)) if all(isfinite(v) and abs(v) <= REACH for v in (x, y, z)) else None
