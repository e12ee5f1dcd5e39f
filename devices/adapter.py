"""What the daemon asks of a bus, and the bus that is only memory."""

from __future__ import annotations

from typing import Protocol

from .errors import FrameError
from .frames import Frames


class Adapter(Protocol):
    """One end of a bus; never blocks, never raises once open."""

    @property
    def closed(self) -> bool:
        """Whether the other end is gone for good, or `close` was called."""

    @property
    def unsent(self) -> int:
        """Frames that were dropped because the queue to the bus was full."""

    @property
    def malformed(self) -> int:
        """Messages received that were no CAN frames."""

    def receive(self, frames: Frames) -> int:
        """Replaces the contents of `frames` by what has arrived; returns how many."""

    def send(self, frames: Frames) -> None:
        """Sends all of `frames`, which stay as they are."""

    def fileno(self) -> int:
        """Something to poll, or -1 where there is nothing."""

    def close(self) -> None:
        """Closes this end."""


class MemoryAdapter:
    """One end of a bus in memory, for lockstep; see `memory_pair`."""

    def __init__(self, capacity: int) -> None:
        self._inbox = Frames(capacity)
        self._peer = self
        self.closed = False
        self.unsent = 0
        self.malformed = 0

    def receive(self, frames: Frames) -> int:
        """Replaces the contents of `frames` by what the peer sent; returns how many."""
        return frames.take(self._inbox)

    def send(self, frames: Frames) -> None:
        """Puts all of `frames` into the peer's inbox, or none where it is full."""
        try:
            if not self.closed:
                self._peer._inbox.extend(frames)
                return
        except FrameError:
            pass
        self.unsent += len(frames)

    def fileno(self) -> int:
        """There is nothing to poll."""
        return -1

    def close(self) -> None:
        """Closes both ends; what is in the inboxes can still be received."""
        self.closed = self._peer.closed = True


def memory_pair(capacity: int = 64) -> tuple[MemoryAdapter, MemoryAdapter]:
    """Two ends of a bus in memory.

    Args:
        capacity: frames that one end holds until they are received; no more than the buffers
            that receive them.
    """
    here, there = MemoryAdapter(capacity), MemoryAdapter(capacity)
    here._peer, there._peer = there, here
    return here, there
