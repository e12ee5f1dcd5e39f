"""Any interface of python-can as a bus: slower than the batch calls, but it runs nearly everything."""

from __future__ import annotations

from typing import Any, Final

import can

from .errors import AdapterError
from .frames import Frames

_ERROR_FRAME: Final = 0x20000000
_EXTENDED: Final = 0x80000000
_REMOTE: Final = 0x40000000


class PythonCanAdapter:
    """A `can.Bus` in CAN FD mode."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self.closed = False
        self.unsent = 0
        self.malformed = 0

    def receive(self, frames: Frames) -> int:
        """Replaces the contents of `frames` by what has arrived; returns how many."""
        frames.clear()
        try:
            while not self.closed and len(frames) < frames.pointer.capacity:
                message = self._bus.recv(timeout=0)
                if message is None:
                    break
                self._take(message, frames)
        except can.CanError:
            self.closed = True
        return len(frames)

    def send(self, frames: Frames) -> None:
        """Sends all of `frames`, one after the other."""
        for can_id, data in frames:
            message = can.Message(
                arbitration_id=can_id, is_extended_id=False, is_fd=True, bitrate_switch=True, data=data
            )
            try:
                self._bus.send(message, timeout=0)
            except (can.CanError, ValueError):
                self.unsent += 1

    def fileno(self) -> int:
        """The interface's file descriptor, or -1 where it has none."""
        try:
            return self._bus.fileno()
        except NotImplementedError:
            return -1

    def close(self) -> None:
        """Shuts the interface down."""
        if not self.closed:
            self.closed = True
            self._bus.shutdown()

    def _take(self, message: can.Message, frames: Frames) -> None:
        can_id = message.arbitration_id
        if message.is_error_frame:
            can_id |= _ERROR_FRAME
        if message.is_extended_id and not message.is_error_frame:
            can_id |= _EXTENDED
        if message.is_remote_frame:
            can_id |= _REMOTE
        frames.append(can_id, bytes(message.data))


def python_can(interface: str, channel: str, **settings: Any) -> PythonCanAdapter:
    """Opens an interface of python-can in CAN FD mode.

    Args:
        interface: its name there: "virtual", "pcan", "kvaser", "udp_multicast", ...
        channel: as that interface names its channels.
        settings: anything else that `can.Bus` takes.

    Raises:
        AdapterError: it cannot be opened.
    """
    try:
        bus = can.Bus(interface=interface, channel=channel, fd=True, **settings)
    except (can.CanError, OSError, ValueError, TypeError, ImportError) as error:
        remedy = "See python-can's documentation of that interface for channel names and settings"
        raise AdapterError(f"{interface}:{channel}", str(error), remedy) from error
    return PythonCanAdapter(bus)
