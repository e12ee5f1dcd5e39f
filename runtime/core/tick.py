"""What a tick depends on, and what it leaves behind."""

from __future__ import annotations

from dataclasses import dataclass, field

from ...devices.frames import CAPACITY, Frames
from ...safety import PASS, Verdict
from .events import Event
from .modes import Command


@dataclass(slots=True)
class Inputs:
    """Everything a tick depends on besides the state of the cycle.

    Attributes:
        frames: received since the last tick, in the order they are consumed.
        tick: index on the phase grid.
        skipped: ticks before this one that did not run.
        commands: given by a person since the last tick.
    """

    frames: Frames = field(default_factory=lambda: Frames(2 * CAPACITY))
    tick: int = 0
    skipped: int = 0
    commands: Command = Command.NONE


@dataclass(slots=True)
class Outputs:
    """What a tick leaves behind, filled anew by each.

    Attributes:
        frames: to send.
        verdict: the strongest of what the layers said.
        events: what people should know; none in most ticks.
    """

    frames: Frames = field(default_factory=Frames)
    verdict: Verdict = PASS
    events: list[Event] = field(default_factory=list)

    def clear(self) -> None:
        """A tick begins."""
        self.frames.clear()
        self.events.clear()
        self.verdict = PASS
