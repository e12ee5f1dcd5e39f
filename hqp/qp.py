"""Quadratic programs, in the words of those who come from QP solvers."""

from typing import Any, Final

import numpy as np

from ._qp import INFEASIBLE, ITERATION_CAP, SOLVED, TIME_LIMIT, UNBOUNDED
from ._qp import solve as _solve
from .problem import Array
from .qp_levels import nearest, solve_by_levels
from .qp_solution import QpSolution, UnboundedError
from .solver import Status

_LIMITS: Final = {ITERATION_CAP: Status.ITERATION_CAP, TIME_LIMIT: Status.TIME_LIMIT}
_SOLVED: Final = Status.SOLVED  # of an enumeration it takes longer to read


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
        ends, x, multipliers, iterations, objective, k, m = _solve(
            P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit
        )
    except (TypeError, ValueError, OverflowError):  # solve_by_levels says what is wrong
        return solve_by_levels(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit)
    if ends == SOLVED:
        return QpSolution(x, _SOLVED, True, iterations, objective, [], multipliers, k, m)
    if ends == UNBOUNDED:
        raise UnboundedError(x)
    if ends in _LIMITS and (max_iterations or time_limit):
        return QpSolution(x, _LIMITS[ends], False, iterations, objective, [], None, k, m)
    if ends == INFEASIBLE:
        nearest_x, status = nearest(len(x), G, h, A, b, lb, ub)
        conflict = _conflict(multipliers, k, m)
        return QpSolution(nearest_x, status, False, iterations, np.nan, conflict, None, k, m)
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
