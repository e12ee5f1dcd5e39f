"""The daemon's end of the recorder: what is to be recorded or shown goes in, the summary comes out."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import time_ns

import msgspec

from ..core.events import Event
from ..recording.log_file import cut_short
from ..recording.ring import Drain, Ring
from ..recording.summary import Report
from ..timing.forensics import LateTick
from ..timing.slack import pause
from ..timing.vitals import Vitals
from ..timing.watch import Overstay
from .children import CHILD_LIMIT_S, Child, end, last_words, reap, spawn, until_ready
from .outcome import Ending
from .recorder import (
    CUT_SHORT,
    EVENT,
    FINISH,
    HIDE,
    LATE,
    LED,
    OVERSTAY,
    SAY,
    SHOW,
    TICK,
    TORN,
    VITALS,
    Shown,
)

RECORDER_S = 0.2
"""Between two looks at the recorder."""
HUNG_LOOKS = 10
"""Looks without a record taken out of the ring after which the recorder counts as hung: the ring holds more
than twice as long, and a busy disk or host may keep a sound recorder for a second."""
RING_S = 8.0
"""Of ticks that the ring holds."""


class RecorderLink:
    """A recorder process and the ring to it.

    Attributes:
        log: the file that it writes.
        child: the process, None before its start.
    """

    def __init__(self, log: Path, bytes_per_s: float = 0.0) -> None:
        """The ring to a recorder that will write this log; ``bytes_per_s`` is what the ticks bring."""
        self.log = log
        self._ring = Ring.create(round(RING_S * bytes_per_s))
        self.child: Child | None = None
        self._control = -1

    def start(self, configuration: str, shown: Shown, duration: float) -> None:
        """Start the process; duration in s, 0 without an end."""
        theirs, self._control = os.pipe()
        arguments = [
            configuration,
            str(self.log),
            str(self._ring.fd),
            str(theirs),
            str(time_ns()),
            shown.name,
            str(duration),
        ]
        self.child = spawn("recorder", arguments, [self._ring.fd, theirs])
        os.close(theirs)

    async def ready(self) -> None:
        """Wait until it has started.

        Raises:
            ChildError: it did not.
        """
        assert self.child
        await until_ready("recorder", self.child)

    def tick(self, record: bytes) -> None:
        """A tick's record."""
        self._ring.push(TICK + record)

    def event(self, tick: int, event: Event) -> None:
        """What happened, for the log and for people."""
        self._push(EVENT, tick, msgspec.json.encode(event))

    def late(self, late: LateTick) -> None:
        """A tick that came or ended late."""
        self._push(LATE, late.tick, msgspec.json.encode(late))

    def overstay(self, tick: int, overstay: Overstay) -> None:
        """A callback that took too long."""
        self._push(OVERSTAY, tick, msgspec.json.encode(overstay))

    def vitals(self, found: Vitals) -> None:
        """Send the vital signs of this process, at its end."""
        self._ring.push(VITALS + msgspec.json.encode(found))

    def led(self, endless: bool) -> None:
        """A person leads the hand; ``endless``: until that person ends the session."""
        self._ring.push(LED + bytes([endless]))

    def say(self, text: str) -> None:
        """For the screen alone."""
        self._ring.push(SAY + text.encode())

    def show(self, lines: bool) -> None:
        """Whether lines stay on the screen."""
        self._ring.push(SHOW if lines else HIDE)

    async def watch(self, lost: Callable[[str], None]) -> None:
        """Supervisory work: tells once that the session is not recorded as a whole, and why."""
        drain = Drain(self._ring, HUNG_LOOKS)
        while not (why := self.fault(drain)):
            await pause(RECORDER_S)
        lost(why)

    def fault(self, drain: Drain) -> str:
        """Why the session is not recorded any more, or not completely; "" where it is."""
        assert self.child
        if self.child.poll() is not None:
            return "the recorder died: this session is not recorded any more"
        if self._ring.dropped:
            return "the recorder is too slow: records were lost"
        if drain.stuck():
            return f"the recorder hangs: nothing was recorded for {HUNG_LOOKS * RECORDER_S:g} s"
        return ""

    @property
    def left_alone(self) -> str:
        """What becomes of the log where nobody waits for the recorder."""
        return f"there is no summary; the recorder goes on to complete the log {self.log}"

    async def collect(self, ending: Ending, patience_s: float, rate: float) -> Report | None:
        """The summary that the recorder gives once it is told to finish; None where it does not.

        Args:
            ending: is told what became of the log.
            patience_s: less than that of a child makes the recorder go on alone where it takes longer.
            rate: of the loop [Hz].
        """
        assert self.child
        try:
            with suppress(BrokenPipeError):  # it is gone; its last words may be there
                os.write(self._control, FINISH)
            words = await last_words(self.child, patience_s)
            await reap(self.child, patience_s)
            report = msgspec.json.decode(words, type=Report)
            if self.child.returncode in (CUT_SHORT, TORN):
                whole = self.child.returncode == CUT_SHORT
                ending.failed = cut_short(self.log, report.ticks / rate, whole)
            return report
        except TimeoutError:
            if patience_s < CHILD_LIMIT_S:
                ending.unrecorded = self.left_alone
            else:
                end(self.child)
        except (OSError, msgspec.DecodeError):
            end(self.child)
        finally:
            os.close(self._control)
        return None

    def _push(self, kind: bytes, tick: int, rest: bytes) -> None:
        self._ring.push(kind + tick.to_bytes(8, "little") + rest)
