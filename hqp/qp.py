"""Quadratic programs, in the words of those who come from QP solvers."""

from typing import Any, Final

import numpy as np

from ._qp import INFEASIBLE, ITERATION_CAP, TIME_LIMIT, UNBOUNDED
from .qp_levels import nearest, solve_by_levels
from .qp_solution import QpSolution, UnboundedError
from .solver import Status

_LIMITS: Final = {ITERATION_CAP: Status.ITERATION_CAP, TIME_LIMIT: Status.TIME_LIMIT}
_SOLVED: Final = Status.SOLVED  # of an enumeration it takes longer to read
_solve: Final = QpSolution.solve


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
        found = _solve(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit, _SOLVED)
    except (TypeError, ValueError, OverflowError):  # solve_by_levels says what is wrong
        return solve_by_levels(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit)
    if found.found:
        return found
    ends = found._ends
    if ends == UNBOUNDED:
        raise UnboundedError(found.x)
    if ends in _LIMITS and (max_iterations or time_limit):
        found.status, found._multipliers = _LIMITS[ends], None
        return found
    if ends == INFEASIBLE:
        found.conflict = _conflict(found)
        found.x, found.status = nearest(len(found.x), G, h, A, b, lb, ub)
        found.objective, found._multipliers = np.nan, None
        return found
    return solve_by_levels(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit)


def _conflict(found: QpSolution) -> list[tuple[str, int, float]]:
    """Rows that add up to 0 x < 0, the one with the largest multiplier, 1, first."""
    parts = {"A": found.y, "G": found.z, "box": found.z_box}
    largest = max(np.abs(part).max(initial=0.0) for part in parts.values())
    rows = [
        (name, int(i), float(part[i] / largest)) for name, part in parts.items() for i in np.flatnonzero(part)
    ]
    return sorted(rows, key=lambda row: -abs(row[2]))
