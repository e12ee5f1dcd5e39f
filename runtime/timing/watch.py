"""Times everything that runs on the loop between the ticks, and names what overstays its budget."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from contextvars import Context
from functools import partial
from types import CodeType
from typing import Any, TypeVarTuple

import msgspec
import uvloop

from .._rt import lib

BUDGET_NS = 100_000
"""Budget of a callback between two ticks, unless it asked for another."""
KEPT_NS = 20_000
"""Shorter callbacks cannot make a tick late."""

Ts = TypeVarTuple("Ts")


class Overstay(msgspec.Struct, frozen=True):
    """A callback that took longer than it may.

    Attributes:
        where: source line and name.
        us: how long it took.
        budget_us: how long it may take.
    """

    where: str
    us: float
    budget_us: float


class Watch:
    """Stopwatch of the callbacks.

    Attributes:
        ran: source and duration [ns] of what ran since ``take``, the very short ones left out.
    """

    def __init__(self, overstayed: Callable[[Overstay], None] = lambda _: None) -> None:
        """``overstayed`` is told at once."""
        self._overstayed = overstayed
        self.ran: list[tuple[str, int]] = []

    def time(self, callback: Callable[..., Any], *arguments: Any) -> Any:
        """Call, and account for the time."""
        line = _resumed_at(callback)
        start = lib.rt_now()
        try:
            return callback(*arguments)
        finally:
            self.account(callback, line, int(lib.rt_now() - start), BUDGET_NS)

    def account(self, callback: object, line: int, ns: int, budget_ns: int) -> None:
        """Something ran for a time; ``line`` is where it was resumed, 0 for its beginning."""
        if ns < KEPT_NS:
            return
        where = source(callback, line)
        self.ran.append((where, ns))
        if ns > budget_ns:
            self._overstayed(Overstay(where, ns / 1e3, budget_ns / 1e3))

    def take(self) -> list[tuple[str, int]]:
        """What ran since the last call."""
        ran, self.ran = self.ran, []
        return ran


class WatchedLoop(uvloop.Loop):
    """uvloop with every callback timed, but for the tick's own.

    Attributes:
        watch: the stopwatch.
    """

    watch: Watch = Watch()

    def add_tick(self, fd: int, callback: Callable[[], None]) -> None:
        """``add_reader`` for the tick: it keeps its own time."""
        super().add_reader(fd, callback)

    def add_reader(self, fd: Any, callback: Callable[[*Ts], object], *args: *Ts) -> None:
        """See ``asyncio``."""
        return super().add_reader(fd, self._timed, callback, *args)

    def add_signal_handler(self, sig: int, callback: Callable[[*Ts], object], *args: *Ts) -> None:
        """See ``asyncio``."""
        return super().add_signal_handler(sig, self._timed, callback, *args)

    def call_soon(
        self, callback: Callable[[*Ts], object], *args: *Ts, context: Context | None = None
    ) -> asyncio.Handle:
        """See ``asyncio``."""
        return super().call_soon(self._timed, callback, *args, context=context)

    def call_soon_threadsafe(
        self, callback: Callable[[*Ts], object], *args: *Ts, context: Context | None = None
    ) -> asyncio.Handle:
        """See ``asyncio``."""
        return super().call_soon_threadsafe(self._timed, callback, *args, context=context)

    def call_later(
        self, delay: float, callback: Callable[[*Ts], object], *args: *Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """See ``asyncio``; ``call_at`` comes through here, too."""
        return super().call_later(delay, self._timed, callback, *args, context=context)

    def _timed(self, callback: Callable[..., Any], *arguments: Any) -> None:
        self.watch.time(callback, *arguments)


def source(callback: object, line: int = 0) -> str:
    """Source line and name of a callback or coroutine, for people."""
    while isinstance(callback, partial):
        callback = callback.func
    coroutine = _coroutine(callback)
    code = getattr(coroutine, "cr_code", None) or getattr(callback, "__code__", None)
    if not isinstance(code, CodeType):
        return getattr(callback, "__qualname__", repr(callback))
    # not pathlib: it interns the parts, and what it leaves in the table of interned strings adds up, within
    # half an hour, to a resize of milliseconds and page faults in a tick
    path = "/".join(code.co_filename.rsplit("/", 2)[-2:])
    name = getattr(coroutine or callback, "__qualname__", code.co_name)
    return f"{path}:{line or code.co_firstlineno} {name}"


def _resumed_at(callback: object) -> int:
    """Line at which a task's coroutine goes on, 0 for other callbacks."""
    frame = getattr(_coroutine(callback), "cr_frame", None)
    return frame.f_lineno if frame else 0


def _coroutine(callback: object) -> object:
    """The coroutine that a callback is or that the task behind it runs, None where there is none."""
    if isinstance(callback, Coroutine):
        return callback
    task = getattr(callback, "__self__", None)
    return task.get_coro() if isinstance(task, asyncio.Task) else None
