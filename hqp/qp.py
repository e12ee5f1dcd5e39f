"""Quadratic programs, in the words of those who come from QP solvers."""

from typing import Any, Final

import numpy as np

from ._hqp import ffi, lib
from .problem import Array, HqpError
from .qp_levels import nearest, solve_by_levels
from .qp_solution import QpSolution, UnboundedError
from .solver import Status

_FLOAT: Final = np.dtype(np.float64)
_DOUBLES: Final = ffi.typeof("double[]")
_LIMITS: Final = {
    lib.HQP_QP_ITERATION_CAP: Status.ITERATION_CAP,
    lib.HQP_QP_TIME_LIMIT: Status.TIME_LIMIT,
}
_SOLVED, _INFEASIBLE, _UNBOUNDED = lib.HQP_QP_SOLVED, lib.HQP_QP_INFEASIBLE, lib.HQP_QP_UNBOUNDED
NULL: Final = ffi.NULL
_KEPT: Final = 8  # as many threads find their memory again
_contiguous, _view, _empty = np.ascontiguousarray, ffi.from_buffer, np.empty


class _Memory:
    """What a solve works in: memory of C for up to n variables and so many rows."""

    __slots__ = ("answer", "n", "qp", "rows", "solver")

    def __init__(self) -> None:
        self.n = self.rows = -1
        self.qp = ffi.new("hqp_qp *")
        self.answer = ffi.new("hqp_qp_answer *")
        self.solver: Any = None

    def grow(self, n: int, rows: int) -> bool:
        """Make room. Returns False for sizes out of range."""
        n, rows = max(n, self.n), max(rows, self.rows)
        self.solver, self.n = None, -1
        made = lib.hqp_qp_create(n, rows)
        if made == ffi.NULL:
            return False
        self.solver, self.n, self.rows = ffi.gc(made, lib.hqp_qp_destroy), n, rows
        return True

    def solve(
        self,
        P: Any,
        q: Any,
        G: Any,
        h: Any,
        A: Any,
        b: Any,
        lb: Any,
        ub: Any,
        initvals: Any,
        max_iterations: int,
        time_limit: float,
    ) -> tuple[int, Array, int, int, int]:
        """How C ends, what it writes (x and multipliers), n, and the numbers of rows of A and G.

        Raises:
            TypeError, ValueError, OverflowError: for what C cannot read.
        """
        qp = self.qp
        q = _contiguous(q, _FLOAT)
        n = len(q)
        # the views keep the arrays alive, and of their size, while C reads them
        qp.q = _vector = _view(_DOUBLES, q)
        qp.P = _matrix = _pointer(P, (n, n))
        k = m = 0
        if A is not None or b is not None:
            k = len(b)
            qp.A, qp.b = _equalities = _pointer(A, (k, n)), _pointer(b, (k,))
        if G is not None or h is not None:
            m = len(h)
            qp.G, qp.h = _inequalities = _pointer(G, (m, n)), _pointer(h, (m,))
        qp.lb = _lower = NULL if lb is None else _pointer(lb, (n,))
        qp.ub = _upper = NULL if ub is None else _pointer(ub, (n,))
        qp.start = _start = NULL if initvals is None else _pointer(initvals, (n,))
        qp.n, qp.equalities, qp.inequalities = n, k, m
        qp.max_iterations, qp.time_limit = max_iterations, time_limit
        if (n > self.n or k + m > self.rows) and not self.grow(n, k + m):
            raise ValueError("sizes are out of range")
        out = _empty(2 * n + k + m)
        self.answer.x = _written = _view(_DOUBLES, out)
        self.answer.multipliers = _written + n
        return lib.hqp_qp_solve(self.solver, qp, self.answer), out, n, k, m


def _pointer(value: Any, shape: tuple[int, ...]) -> Any:
    array = _contiguous(value, _FLOAT)
    if array.shape != shape:
        raise ValueError
    return _view(_DOUBLES, array)


_memories: list[_Memory] = []
"""Memory that nobody works in. To pop and append is safe beside other threads."""


def solve_qp(
    P: Any,
    q: Any,
    G: Any = None,
    h: Any = None,
    A: Any = None,
    b: Any = None,
    lb: Any = None,
    ub: Any = None,
    *,
    initvals: Any = None,
    max_iterations: int = 0,
    time_limit: float = 0.0,
) -> QpSolution:
    """Minimise 1/2 x^T P x + q^T x subject to G x <= h, A x = b, lb <= x <= ub; names as in qpsolvers.

    A dual active-set method solves it, with proximal steps where P is singular. What it cannot prove is
    solved as a hierarchy of two levels.

    Args:
        P: (n, n), symmetric, positive semidefinite.
        q: (n,).
        G: (m, n); None: no inequalities.
        h: (m,), +inf where there is no bound.
        A: (k, n); None: no equalities.
        b: (k,).
        lb: (n,) or None, -inf where there is no bound.
        ub: (n,) or None, +inf where there is no bound.
        initvals: (n,), x to start from; None: none.
        max_iterations: rows added to the working set and released at most; 0: automatic.
        time_limit: seconds; 0: none.

    Returns:
        A QpSolution; look at `found`.

    Raises:
        HqpError: sizes that do not fit, data that are not numbers, or P that is not symmetric or not positive
            semidefinite.
        UnboundedError: the objective has no minimum.
    """
    try:
        memory = _memories.pop()
    except IndexError:
        memory = _Memory()
    try:
        ends, out, n, k, m = memory.solve(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit)
    except (TypeError, ValueError, OverflowError):  # solve_by_levels says what is wrong
        ends, out, n, k, m = lib.HQP_QP_BAD_DATA, None, 0, 0, 0
    answer = memory.answer
    iterations, objective = answer.iterations, answer.objective
    if len(_memories) < _KEPT:
        _memories.append(memory)
    if ends == _SOLVED:
        return QpSolution(out[:n], Status.SOLVED, True, iterations, objective, [], out[n:], k, m)
    if ends == _UNBOUNDED:
        raise UnboundedError(out[:n])
    if ends in _LIMITS and (max_iterations or time_limit):
        return QpSolution(out[:n], _LIMITS[ends], False, iterations, objective, [], None, k, m)
    if ends == _INFEASIBLE:
        x, status = nearest(n, G, h, A, b, lb, ub)
        return QpSolution(x, status, False, iterations, np.nan, _conflict(out[n:], k, m), None, k, m)
    return solve_by_levels(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit)


def _conflict(multipliers: Array, equalities: int, inequalities: int) -> list[tuple[str, int, float]]:
    """Rows that add up to 0 x < 0, the one with the largest multiplier, 1, first."""
    box = equalities + inequalities
    largest = np.abs(multipliers).max()
    rows = []
    for i in np.flatnonzero(multipliers):
        part, start = ("A", 0) if i < equalities else ("G", equalities) if i < box else ("box", box)
        rows.append((part, int(i) - start, float(multipliers[i] / largest)))
    return sorted(rows, key=lambda row: -abs(row[2]))
