"""Where the time of a tick goes: durations of its stages, stamped in C."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from functools import partial

from ...configs.members import at_hand
from .._rt import ffi, lib


@at_hand
class Stage(IntEnum):
    """A part of the tick, in the order in which they run."""

    RECEIVE = 0
    DECODE = 1
    ESTIMATE = 2
    MODEL = 3
    ASSEMBLE = 4
    SOLVE = 5
    COMMAND = 6
    SAFETY = 7
    ENCODE = 8
    SEND = 9
    LOG = 10


Mark = Callable[[Stage], None]
"""Tells that a stage has just ended."""

NO_STAGES = bytes(4 * len(Stage))
"""Durations of a tick without a clock."""


def no_mark(_: Stage) -> None:
    """Lockstep and replay have no clock."""


class Stages:
    """Durations of the stages of the running tick.

    A stage that runs in several parts adds them up. LOG is that of the tick before: the record has to be
    written before its own writing is over.

    Attributes:
        mark: a stage has just ended.
    """

    def __init__(self) -> None:
        self._stages = ffi.new("rt_stages *")
        self._ns = ffi.buffer(self._stages.ns)
        self.mark: Mark = partial(lib.rt_stages_mark, self._stages)

    def begin(self) -> int:
        """A tick begins; returns the time [ns]."""
        return int(lib.rt_stages_begin(self._stages))

    @property
    def elapsed_ns(self) -> int:
        """From the beginning of the tick to the last mark."""
        return int(self._stages.last - self._stages.begin)

    @property
    def ns(self) -> tuple[int, ...]:
        """The durations [ns], in the order of ``Stage``."""
        return tuple(self._stages.ns)

    @property
    def packed(self) -> bytes:
        """The durations [ns], 4 bytes each, little endian, as the log keeps them."""
        return bytes(self._ns)
