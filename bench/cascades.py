"""Cascades of QPs, one after the other for each level, on whatever QP solver is installed.

Each runs in a process of its own, which is replaced when it hangs: some QP solvers do on degenerate sets.
Only the time inside the QP solver counts.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..hqp import Level
from ..hqp.reference import QpError, quadprog_qp, reference
from ..runtime.live.interrupts import end_in_silence, held
from .contenders import Answer

Array = NDArray[np.float64]
HANGS_S = 5.0


class Qp(NamedTuple):
    """A QP solver: its package, and a function like hapticd.hqp.reference.quadprog_qp."""

    package: str
    solve: Callable[[Array, Array, Array, Array], tuple[Array, int]]


def _daqp(H: Array, linear: Array, rows: Array, least: Array) -> tuple[Array, int]:
    import daqp

    upper, sense = np.full(len(least), 1e30), np.zeros(len(least), dtype=np.intc)
    z, _, flag, info = daqp.solve(H, -linear, rows, upper, least, sense)
    if flag < 1:
        raise QpError(f"DAQP ends with {flag}")
    return np.asarray(z), int(info["iterations"])


def _proxqp(H: Array, linear: Array, rows: Array, least: Array) -> tuple[Array, int]:
    from proxsuite import proxqp

    upper = np.full(len(least), 1e20)
    result = proxqp.dense.solve(H, -linear, None, None, rows, least, upper, eps_abs=1e-9)
    return result.x, int(result.info.iter)


def _piqp(H: Array, linear: Array, rows: Array, least: Array) -> tuple[Array, int]:
    import piqp

    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-10
    solver.setup(H, -linear, None, None, rows, least, None, None, None)
    if solver.solve() != piqp.PIQP_SOLVED:
        raise QpError("PIQP gives up")
    return solver.result.x, int(solver.result.info.iter)


def _clarabel(H: Array, linear: Array, rows: Array, least: Array) -> tuple[Array, int]:
    import clarabel
    from scipy.sparse import csc_matrix

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cones = [clarabel.NonnegativeConeT(len(least))]
    solver = clarabel.DefaultSolver(
        csc_matrix(np.triu(H)), -linear, csc_matrix(-rows), -least, cones, settings
    )
    solution = solver.solve()
    return np.array(solution.x), int(solution.iterations)


QPS = {
    "quadprog cascade": Qp("quadprog", quadprog_qp),
    "DAQP cascade": Qp("daqp", _daqp),
    "ProxQP cascade": Qp("proxsuite", _proxqp),
    "PIQP cascade": Qp("piqp", _piqp),
    "Clarabel cascade": Qp("clarabel", _clarabel),
}


class Cascade:
    """One QP for each level, solved in a process of its own."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.hopeless: set[int] = set()
        self._start()

    def _start(self) -> None:
        self._pipe, child = multiprocessing.Pipe()
        self._process = multiprocessing.Process(target=_work, args=(self.name, child), daemon=True)
        with held():
            self._process.start()

    def solve(self, tick: int, levels: Sequence[Level]) -> Answer | None:
        """Solve one tick; None where the QP solver gave up, or hung, now or in an earlier round."""
        if tick in self.hopeless:
            return None
        self._pipe.send(levels)
        if self._pipe.poll(HANGS_S):
            answer: Answer | None = self._pipe.recv()
            return answer
        self.hopeless.add(tick)
        self.close()
        self._start()
        return None

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()


def _work(name: str, pipe: Connection) -> None:
    end_in_silence()
    while True:
        try:
            levels = pipe.recv()
        except EOFError:
            return
        pipe.send(solve_cascade(name, levels))


def solve_cascade(name: str, levels: Sequence[Level]) -> Answer | None:
    """Solve one problem in this process; None where the QP solver gives up."""
    spent_ns, iterations = 0, 0

    def timed(H: Array, linear: Array, rows: Array, least: Array) -> tuple[Array, int]:
        nonlocal spent_ns, iterations
        start = time.perf_counter_ns()
        z, count = QPS[name].solve(H, linear, rows, least)
        spent_ns += time.perf_counter_ns() - start
        iterations += count
        return z, count

    try:
        x = reference(levels, timed, repeats=1)
    except QpError:
        return None
    return Answer(1e-3 * spent_ns, x, iterations, True) if np.isfinite(x).all() else None
