"""Quadratic programs, in the words of those who come from QP solvers."""

from typing import Any, Final

import numpy as np

from ._hqp import ffi, lib
from .problem import Array
from .qp_levels import nearest, solve_by_levels
from .qp_solution import QpSolution, UnboundedError
from .solver import Status

_FLOAT: Final = np.dtype(np.float64)
_LIMITS: Final = {
    lib.HQP_QP_ITERATION_CAP: Status.ITERATION_CAP,
    lib.HQP_QP_TIME_LIMIT: Status.TIME_LIMIT,
}
_SOLVED: Final = Status.SOLVED  # of an enumeration it takes longer to read
NULL: Final = ffi.NULL
_KEPT: Final = 8  # as many threads find their memory again
_contiguous, _view, _empty, _call = np.ascontiguousarray, ffi.from_buffer, np.empty, lib.hqp_qp_call


class _Memory:
    """What a solve works in: memory of C for QPs of up to n variables and so many rows."""

    __slots__ = ("found", "n", "rows", "solver")

    def __init__(self) -> None:
        self.n = self.rows = -1
        self.found = ffi.new("hqp_qp_answer *")
        self.solver: Any = None

    def grow(self, n: int, rows: int) -> None:
        """Make room.

        Raises:
            ValueError: sizes out of range.
        """
        self.solver, self.n, self.rows = None, max(n, self.n), max(rows, self.rows)
        made = lib.hqp_qp_create(self.n, self.rows)
        if made == NULL:
            self.n = self.rows = -1
            raise ValueError
        self.solver = ffi.gc(made, lib.hqp_qp_destroy)


_memories: list[_Memory] = []
"""Memory that nobody works in. To pop and to append is safe beside other threads."""


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
    try:  # written out, for speed: of a small QP most of the time goes into this function
        q = _contiguous(q, _FLOAT)
        n = len(q)
        P = _contiguous(P, _FLOAT)
        if P.shape != (n, n) or q.ndim != 1:
            raise ValueError
        k = m = 0
        equalities = values = rows = bounds = NULL
        if A is not None:
            k = len(b)
            A, b = _contiguous(A, _FLOAT), _contiguous(b, _FLOAT)
            if A.shape != (k, n) or b.ndim != 1:
                raise ValueError
            if k:
                equalities, values = _view(A), _view(b)
        elif b is not None:
            raise ValueError
        if G is not None:
            m = len(h)
            G, h = _contiguous(G, _FLOAT), _contiguous(h, _FLOAT)
            if G.shape != (m, n) or h.ndim != 1:
                raise ValueError
            if m:
                rows, bounds = _view(G), _view(h)
        elif h is not None:
            raise ValueError
        if n > memory.n or k + m > memory.rows:
            memory.grow(n, k + m)
        out = _empty(n + k + m + n)
        found = memory.found
        ends = _call(
            memory.solver,
            n,
            k,
            m,
            _view(P),
            _view(q),
            equalities,
            values,
            rows,
            bounds,
            NULL if lb is None else _view_of(lb, (n,)),
            NULL if ub is None else _view_of(ub, (n,)),
            NULL if initvals is None else _view_of(initvals, (n,)),
            max_iterations,
            time_limit,
            _view(out),
            found,
        )
        if ends == 0:
            return QpSolution(out[:n], _SOLVED, True, found.iterations, found.objective, [], out, k, m)
        iterations, objective = found.iterations, found.objective
    except (TypeError, ValueError, OverflowError):  # solve_by_levels says what is wrong
        return solve_by_levels(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit)
    finally:
        if len(_memories) < _KEPT:
            _memories.append(memory)
    if ends == lib.HQP_QP_UNBOUNDED:
        raise UnboundedError(out[:n])
    if ends in _LIMITS and (max_iterations or time_limit):
        return QpSolution(out[:n], _LIMITS[ends], False, iterations, objective, [], None, k, m)
    if ends == lib.HQP_QP_INFEASIBLE:
        x, status = nearest(n, G, h, A, b, lb, ub)
        return QpSolution(x, status, False, iterations, np.nan, _conflict(out[n:], k, m), None, k, m)
    return solve_by_levels(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit)


def _view_of(value: Any, shape: tuple[int, ...]) -> Any:
    array = _contiguous(value, _FLOAT)
    if array.shape != shape:
        raise ValueError
    return _view(array)


def _conflict(multipliers: Array, equalities: int, inequalities: int) -> list[tuple[str, int, float]]:
    """Rows that add up to 0 x < 0, the one with the largest multiplier, 1, first."""
    box = equalities + inequalities
    largest = np.abs(multipliers).max()
    rows = []
    for i in np.flatnonzero(multipliers):
        part, start = ("A", 0) if i < equalities else ("G", equalities) if i < box else ("box", box)
        rows.append((part, int(i) - start, float(multipliers[i] / largest)))
    return sorted(rows, key=lambda row: -abs(row[2]))
