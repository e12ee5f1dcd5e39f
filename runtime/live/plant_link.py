"""The daemon's end of the simulated plant: its process, its bus, and the wait for its answers."""

from __future__ import annotations

import os
import socket
import subprocess

from ...devices.frames import CAPACITY, Frames
from ...devices.socket_adapter import SocketAdapter
from ...sim.person import Deed, Lead
from .children import spawn

FROZEN_S = 2.0
"""How long a simulated plant may owe its answer before the session ends."""
LONGEST_LOOK_S = 0.1
"""What a tick that waits for the plant counts at most: while this process did not run, it saw nothing."""


class PlantLink:
    """A plant process, over a Unix socket.

    Attributes:
        child: the process.
        bus: this end of the socket.
    """

    def __init__(self, configuration: str, rate: float) -> None:
        """Start the process; rate of the loop [Hz]."""
        self._rate = rate
        self._stalled = 0
        here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        arguments = [configuration, str(there.fileno())]
        self.child = spawn("plant_process", arguments, [there.fileno()], subprocess.PIPE)
        there.close()
        assert self.child.stdin
        os.set_blocking(self.child.stdin.fileno(), False)
        self.bus = SocketAdapter(here)

    def act(self, deed: Deed | Lead) -> None:
        """A person acts at the machine's side; only what its devices then measure comes back.

        Raises:
            OSError: the plant takes no more.
        """
        assert self.child.stdin
        os.write(self.child.stdin.fileno(), deed.encode() if isinstance(deed, Lead) else bytes([deed.value]))

    def owes(self, frames: Frames, up: bool, skipped: int) -> bool:
        """Whether the last tick is not answered yet; asked at every tick.

        Args:
            frames: that arrived since.
            up: whether its devices have come up; before, nobody has to answer, but the bus has to be read.
            skipped: ticks before this one that did not run.
        """
        silent = not frames.answers if up else self.bus.unread
        owes = silent and len(frames) <= CAPACITY
        looks = min(1 + skipped, round(LONGEST_LOOK_S * self._rate))
        self._stalled = self._stalled + looks if owes else 0
        return owes

    @property
    def frozen(self) -> bool:
        """Whether its answer is owed for too long."""
        return self._stalled >= FROZEN_S * self._rate
