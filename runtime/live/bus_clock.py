"""The simulated plant's own clock: a TIME object (CiA 301) once a period, as a device would send it."""

from __future__ import annotations

from ...devices.adapter import Adapter
from ...devices.cia301 import TIME
from ...devices.frames import Frames
from .._rt import lib
from ..timing.loop import now_ns

DRIFT = 50e-6
"""By which its quartz is slow."""
TIME_OF_DAY = bytes(6)
"""Milliseconds since midnight and days since 1984: nobody here asks for the date."""


class BusClock:
    """Sends a TIME object a period, by a timer of its own.

    Attributes:
        fd: readable when one is due.
    """

    def __init__(self, bus: Adapter, period: float) -> None:
        """The period in seconds."""
        period_ns = round(1e9 * period * (1.0 + DRIFT))
        self._bus, self._frames = bus, Frames()
        self._frames.append(TIME, TIME_OF_DAY)
        self.fd = int(lib.rt_timer_open(now_ns() + period_ns, period_ns))

    def send(self) -> None:
        """Send what is due; what was missed is not made up for."""
        if lib.rt_timer_read(self.fd) > 0:
            self._bus.send(self._frames)
