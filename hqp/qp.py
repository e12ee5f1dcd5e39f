"""Quadratic programs, in the words of those who come from QP solvers."""

from operator import index
from time import monotonic
from typing import Any, Final

import numpy as np

from ._qp import INFEASIBLE, ITERATION_CAP, NOT_PROVEN, TIME_LIMIT, UNBOUNDED
from .qp_data import QpData, checked, refuse
from .qp_nearest import nearest
from .qp_scaled import is_conflict, solve_scaled
from .qp_solution import QpSolution, UnboundedError
from .qp_unbounded import is_ray, unless_infeasible
from .solver import Status

_LIMITS: Final = {ITERATION_CAP: Status.ITERATION_CAP, TIME_LIMIT: Status.TIME_LIMIT}
_SOLVED: Final = Status.SOLVED  # of an enumeration it takes longer to read
_solve: Final = QpSolution.solve
_FAINT = 1e-12  # of the hardest pull in a conflict: what rounding makes of a row that has no part in it


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

    A dual active-set method solves it, with proximal steps where P is singular. What it cannot prove it
    solves once more in units in which P has the diagonal 1. n is at most 1024, and m + k 8192.

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
        max_iterations: rows added to the working set and released at most, and working sets tried for the x
            that breaks contradicting constraints least; 0: automatic, of the former 128 + 64 (n + m + k).
        time_limit: seconds, looked at with each change of the working set, after the factorisation of P;
            0: none. Ctrl-C waits for the end of a solve.

    Returns:
        A QpSolution; look at `found`.

    Raises:
        HqpError: sizes that do not fit, data that are not real numbers, or P that is not symmetric or not
            positive semidefinite.
        UnboundedError: the objective has no minimum.
    """
    began, found = monotonic() if time_limit else 0.0, None
    try:
        found = _solve(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit, _SOLVED)
    except (TypeError, ValueError, OverflowError):
        pass  # what is wrong, or must be converted, is seen below
    if found is not None and found.found:
        return found
    data = checked(P, q, G, h, A, b, lb, ub, initvals, max_iterations, time_limit)
    if found is None:
        found = _solve(*data, index(max_iterations), float(time_limit), _SOLVED)
    ends, is_limited = found._ends, bool(max_iterations or time_limit)
    until = began + time_limit if time_limit else np.inf
    is_seeming = ends == UNBOUNDED and not is_ray(data, found.x)
    if ends == NOT_PROVEN or is_seeming or (ends in _LIMITS and not is_limited):
        found, ends = solve_scaled(data, index(max_iterations), until)
        if ends == UNBOUNDED and not is_ray(data, found.x):
            ends = NOT_PROVEN
    is_open = ends in (UNBOUNDED, NOT_PROVEN) or (ends in _LIMITS and not is_limited)
    if is_open and not found.found:
        found, ends = unless_infeasible(data, found, ends, index(max_iterations), until)
    if ends == INFEASIBLE:
        found.x, found.status = nearest(data, index(max_iterations), until)
    return found if found.found else _without_answer(found, ends, data)


def _without_answer(found: QpSolution, ends: int, data: QpData) -> QpSolution:
    if ends < 0:
        raise refuse(ends, data.P)
    if ends == UNBOUNDED:
        raise UnboundedError(found.x)
    if ends == INFEASIBLE:
        found.objective = np.nan
        if is_conflict(data, found):
            found.conflict = _conflict(found, data)
        else:
            found.status = Status.NOT_PROVEN
    else:
        found.status = _LIMITS.get(ends, Status.NOT_PROVEN)
    found._multipliers = None
    return found


def _conflict(found: QpSolution, data: QpData) -> list[tuple[str, int, float]]:
    """Rows that add up to 0 x < 0, the one with the largest multiplier, 1, first."""
    parts = {"A": (found.y, data.A), "G": (found.z, data.G), "box": (found.z_box, np.eye(len(data.q)))}
    pulls = {name: np.abs(part) * np.linalg.norm(rows, axis=1) for name, (part, rows) in parts.items()}
    least = _FAINT * max(pull.max(initial=0.0) for pull in pulls.values())
    largest = max(np.abs(part).max(initial=0.0) for part, _ in parts.values())
    rows = [
        (name, int(i), float(part[i] / largest))
        for name, (part, _) in parts.items()
        for i in np.flatnonzero((part != 0.0) & (pulls[name] >= least))
    ]
    if len(rows) == 1 and rows[0][0] == "box" and data.lb is not None and data.ub is not None:
        i = rows[0][1]  # one bound alone contradicts nothing: it is its other one
        return [("box", i, 1.0), ("box", i, -1.0)]
    return sorted(rows, key=lambda row: -abs(row[2]))
