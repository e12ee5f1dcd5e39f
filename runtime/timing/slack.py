"""Supervisory work in slices between the ticks."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator
from dataclasses import dataclass
from types import coroutine
from typing import Any

from .._rt import lib
from .watch import BUDGET_NS, Watch

GUARD_NS = 50_000
"""Kept free before the next tick."""
PATIENCE_NS = 1_000_000_000
"""How long work waits for a slice that fits, before it gets one that does not; such slices, of all work
together, keep this distance, too. Rather a late tick a second than a session that nobody supervises."""

Work = Coroutine[float, None, None]
"""An ``async def`` that awaits nothing but ``pause``."""


@coroutine
def pause(rest_s: float = 0.0) -> Generator[float, None, None]:
    """End a slice; the next one comes after a rest [s], when there is time."""
    yield rest_s


@dataclass(slots=True)
class _Task:
    work: Any  # typeshed's Coroutine lacks cr_frame
    budget_ns: int
    due_ns: int


class Slack:
    """The supervisory work of a loop.

    Each slice has a budget: it only starts where the budget fits in before the next tick, and is reported
    where it took longer. Once a second a slice may start that does not fit, so that all work goes on.
    """

    def __init__(self, watch: Watch, failed: Callable[[str, Exception], None] = lambda *_: None) -> None:
        """``failed`` is told of work that raised, and what; the work is dropped, the loop goes on."""
        self._watch, self._failed = watch, failed
        self._tasks: list[_Task] = []
        self._forced_ns = 0

    def add(self, work: Work, budget_ns: int = BUDGET_NS) -> None:
        """Begin work."""
        self._tasks.append(_Task(work, budget_ns, int(lib.rt_now())))

    def serve(self, until_ns: int) -> None:
        """One slice of each piece of work that is due and fits in; the others come first next time.

        Of those that have waited too long for that, one a second gets its slice all the same.
        """
        now = int(lib.rt_now())
        for task in tuple(self._tasks):
            fits = now + task.budget_ns + GUARD_NS <= until_ns
            if now >= task.due_ns and (fits or self._overdue(task, now)):
                self._tasks.remove(task)
                self._tasks.append(task)
                now = self._slice(task, now)
                if not fits:
                    self._forced_ns = now
                    return

    def close(self) -> None:
        """Drop all work."""
        for task in self._tasks:
            task.work.close()
        self._tasks.clear()

    def _overdue(self, task: _Task, now: int) -> bool:
        return now - max(task.due_ns, self._forced_ns) > PATIENCE_NS

    def _slice(self, task: _Task, start: int) -> int:
        work = task.work
        line = work.cr_frame.f_lineno
        rest_s = 0.0
        try:
            rest_s = work.send(None)
        except StopIteration:
            self._tasks.remove(task)
        except Exception as error:  # supervisory work must not stop the machine
            self._tasks.remove(task)
            self._failed(work.__qualname__, error)
        now = int(lib.rt_now())
        task.due_ns = now + round(1e9 * rest_s)
        self._watch.account(work, line, now - start, task.budget_ns)
        return now
