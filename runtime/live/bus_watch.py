"""What a bus drops, told to people."""

from __future__ import annotations

from collections.abc import Callable

from ...devices.adapter import Adapter
from ...devices.image import COUNTERS, ProcessImage
from ..core.events import Event, EventKind
from ..timing.slack import pause

LOOK_S = 0.5
"""Between two looks at what the bus dropped."""
NOTEWORTHY = tuple(name for name in COUNTERS if name not in ("frames", "misses"))
"""Counters that a person hears of; missing frames have their own words."""


async def watch_bus(bus: Adapter, image: ProcessImage, tell: Callable[[Event], None]) -> None:
    """Supervisory work: what the bus dropped, and why, is told as it happens."""
    columns = [COUNTERS.index(name) for name in NOTEWORTHY]
    names = ("unsent", "malformed", *NOTEWORTHY)
    before = [0] * len(names)
    while True:
        counters = image.counters.tolist()
        now = [bus.unsent, bus.malformed, *(counters[k] for k in columns)]
        if now != before:
            moved = zip(names, now, before, strict=True)
            losses = [f"{new - old} {name}" for name, new, old in moved if new != old]
            tell(EventKind.BUS_LOSSES(losses=losses))
            before = now
        await pause(LOOK_S)
