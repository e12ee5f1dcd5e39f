"""What is timed in this process: our solver, the factorisation floor, and DAQP's hierarchical mode."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..binding import pointer
from ..hqp import Level, Solver
from ..hqp.certificate import activity
from ..hqp.core import best
from .recorded import Recording

Array = NDArray[np.float64]
_floor = best("._floor", __package__)


class Answer(NamedTuple):
    """One solve: microseconds, x (n,), iterations, and whether the solver itself is content."""

    us: float
    x: Array
    iterations: int
    solved: bool


class Contender(Protocol):
    """Solves the ticks of one recording, in their order."""

    def solve(self, tick: int, levels: Sequence[Level]) -> Answer:
        """Solve one tick, given in the arrays of every tick."""
        ...


class Ours:
    """Our solver; warm: started from the tick before, where the two are consecutive."""

    def __init__(self, recording: Recording, warm: bool) -> None:
        self.recording, self.warm = recording, warm
        self.solver = Solver(recording.x.shape[1], [level.rows for level in recording.levels(0)])

    def solve(self, tick: int, levels: Sequence[Level]) -> Answer:
        """Solve one tick."""
        if not (self.warm and self.recording.follows(tick)):
            self.solver.reset()
        start = time.perf_counter_ns()
        solution = self.solver.solve(levels)
        us = 1e-3 * (time.perf_counter_ns() - start)
        return Answer(us, solution.x.copy(), solution.iterations, solution.status == 0)


class Floor:
    """A dense hierarchical factorisation and solve, given the rows that are active where our solver ends."""

    def __init__(self, recording: Recording) -> None:
        ours = Ours(recording, warm=True)
        self.n = ours.solver.n
        self.problems = [_active(levels, ours.solve(tick, levels).x) for tick, levels in recording.replay()]
        most = max(len(target) for _, _, target in self.problems)
        self.work = _floor.ffi.new("double[]", _floor.lib.floor_work(self.n, most))
        self.x = np.zeros(self.n)
        self._x = pointer(self.x, "double", self.n)

    def solve(self, tick: int, levels: Sequence[Level]) -> Answer:
        """Solve one tick; an iteration is a factorisation."""
        counts, rows, target = self.problems[tick]
        problem = (
            pointer(counts, "const int", len(levels)),
            pointer(rows, "const double", len(target), self.n),
            pointer(target, "const double", None),
        )
        start = time.perf_counter_ns()
        _floor.lib.floor_solve(self.n, len(levels), *problem, self.work, self._x)
        us = 1e-3 * (time.perf_counter_ns() - start)
        return Answer(us, self.x.copy(), 1, True)


def _active(levels: Sequence[Level], x: Array) -> tuple[NDArray[np.intc], Array, Array]:
    """Number of active rows per level, these rows, and the value each is held or fitted at."""
    counts, rows, target = [], [], []
    for level in levels:
        lower, upper = activity(level, x)
        rows += [level.A, level.C[lower | upper]]
        target += [level.b, np.where(lower, level.lb, level.ub)[lower | upper]]
        counts.append(sum(map(len, target[-2:])))
    return np.array(counts, dtype=np.intc), np.vstack(rows), np.concatenate(target)


class DaqpHierarchical:
    """DAQP's hierarchical mode, cold (a warm start gains it nothing); its own count of its time."""

    INFINITE = 1e30  # what it takes for no bound

    def __init__(self, recording: Recording) -> None:
        import daqp

        self.daqp_solve: Callable[..., Any] = daqp.solve
        self.break_points = np.cumsum([sum(level.rows) for level in recording.levels(0)]).astype(np.intc)

    def solve(self, tick: int, levels: Sequence[Level]) -> Answer:
        """Solve one tick."""
        rows = np.vstack([part for level in levels for part in (level.A, level.C)])
        lower = np.concatenate([part for level in levels for part in (level.b, level.lb)])
        upper = np.concatenate([part for level in levels for part in (level.b, level.ub)])
        lower, upper = np.maximum(lower, -self.INFINITE), np.minimum(upper, self.INFINITE)
        sense = np.zeros(len(rows), dtype=np.intc)
        x, _, flag, info = self.daqp_solve(None, None, rows, upper, lower, sense, self.break_points)
        us = 1e6 * (info["setup_time"] + info["solve_time"])
        return Answer(us, np.asarray(x), info["iterations"], flag > 0)
