"""A quadratic program as a hierarchy of two levels: the constraints, then the objective as least squares.

This is the slower way, and takes what the dual method could not prove.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .multipliers import conflicts, multipliers
from .problem import Array, HqpError, Level
from .qp_solution import QpSolution, UnboundedError
from .solver import Solution, Solver, Status

CONVEX = 1e-9  # of the largest eigenvalue of P: how far below 0 rounding may take the least one
RANK = 1e-11  # of the largest eigenvalue of P: what counts as 0
INSIDE = 1e-9  # of |q|: what of it may lie outside the range of P
PROXIMITY = 1e-8  # of the largest eigenvalue of P: what is added to a singular P in the end
LESS = 0.1  # times that, with each proximal step
REACH = 1e4  # how far x may go in one proximal step: further away rounding is felt
REPEATS = 200  # proximal steps at most
MET = 1e-8  # times (1 + |bound|): slack of a constraint that counts as none
ROUNDING = 1e-12  # times |row| |x|: the same


def solve_by_levels(
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
) -> QpSolution:
    """As solve_qp. Where P is singular and q reaches outside its range, P + e I is a least-squares problem.

    That is solved about the x of the last solve, time and again until x stays (the proximal point method), e
    falling on the way.
    """
    q = array("q", q, 1)
    n = len(q)
    P = array("P", P, 2, (n, n))
    parts, constraints = _constraints(n, G, h, A, b, lb, ub)
    objective = _least_squares(P, q)
    root, target = objective.rows(objective.shift, np.zeros(n))
    levels = [constraints, Level(A=root, b=target)]
    solver = Solver(n, [level.rows for level in levels], max_iterations=max_iterations, time_limit=time_limit)
    if initvals is not None:
        solver.start(array("initvals", initvals, 1, (n,)))
    found = solver.solve(levels)
    iterations = found.iterations
    status, broken = found.status, _broken(constraints, found)
    if objective.shift and status is Status.SOLVED and not broken:
        status, steps = _approach(P, q, objective, levels, solver)
        iterations += steps
    x = found.x.copy()
    is_found = status is Status.SOLVED and not broken
    return QpSolution(
        x,
        status,
        is_found,
        iterations,
        float(0.5 * x @ P @ x + q @ x),
        _conflict(levels, parts, x) if status is Status.SOLVED and broken else [],
        _multipliers(levels, parts, x) if is_found else None,
        len(constraints.A),
        parts[0][1].stop,
    )


def nearest(n: int, G: Any, h: Any, A: Any, b: Any, lb: Any, ub: Any) -> tuple[Array, Status]:
    """The x that breaks the constraints least, by the squares of its distances, and how sure that is."""
    constraints = _constraints(n, G, h, A, b, lb, ub)[1]
    found = Solver(n, [constraints.rows]).solve([constraints])
    return found.x.copy(), found.status


def array(name: str, value: Any, ndim: int, shape: tuple[int, ...] | None = None) -> Array:
    """Numbers as C reads them, without NaN and of this shape, or an HqpError."""
    try:
        array = np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise HqpError(name, f"is not an array of numbers: {error}", "pass a dense array") from error
    if array.ndim != ndim or (shape is not None and array.shape != shape):
        expected = f"must have shape {shape}" if shape else f"must have {ndim} dimension{'s' * (ndim > 1)}"
        raise HqpError(name, f"has shape {array.shape}", f"it {expected}")
    if np.isnan(array).any():
        raise HqpError(name, "has an entry that is NaN", "look where it comes from")
    return array


def _pair(names: str, matrix: Any, vector: Any, n: int) -> tuple[Array, Array]:
    """Rows and their bounds; none of either where both are None."""
    if matrix is None and vector is None:
        return np.empty((0, n)), np.empty(0)
    if matrix is None or vector is None:
        raise HqpError(" and ".join(names), "are given one without the other", "give both or none")
    rows = array(names[0], matrix, 2)
    if rows.shape[1] != n:
        raise HqpError(names[0], f"has {rows.shape[1]} columns and q has {n} entries", "one per variable")
    return rows, array(names[1], vector, 1, (len(rows),))


def _constraints(
    n: int, G: Any, h: Any, A: Any, b: Any, lb: Any, ub: Any
) -> tuple[list[tuple[str, slice]], Level]:
    """The first level, and which of its inequalities are G's and which the box's."""
    above, most = _pair("Gh", G, h, n)
    equal, value = _pair("Ab", A, b, n)
    lower = np.full(n, -np.inf) if lb is None else array("lb", lb, 1, (n,))
    upper = np.full(n, np.inf) if ub is None else array("ub", ub, 1, (n,))
    box = np.eye(n)[: 0 if lb is None and ub is None else n]
    level = Level(
        A=equal,
        b=value,
        C=np.vstack([above, box]),
        lb=np.concatenate([np.full(len(above), -np.inf), lower[: len(box)]]),
        ub=np.concatenate([most, upper[: len(box)]]),
        weights=_normalising(np.vstack([equal, above, box])),
    )
    return [("G", slice(0, len(above))), ("box", slice(len(above), len(above) + len(box)))], level


def _normalising(rows: Array) -> Array:
    """Weights with which each row counts as one of length 1: constraints that can be met do not mind."""
    squares = np.einsum("ij,ij->i", rows, rows)
    return np.where(squares > 1e-60, 1.0 / np.maximum(squares, 1e-60), 1.0)


@dataclass(frozen=True)
class _Objective:
    """An objective as least squares: root^T root = P, or, with a shift, vectors diag(values) vectors^T = P.

    Attributes:
        shift: what is to be added to P at first; 0: nothing.
    """

    q: Array
    root: Array
    target: Array
    values: Array
    vectors: Array
    shift: float

    def rows(self, shift: float, x: Array) -> tuple[Array, Array]:
        """R and d: |R y - d|^2 / 2 is the objective at y, but for a constant, plus shift |y - x|^2 / 2."""
        if not self.shift:
            return self.root, self.target
        roots = np.sqrt(self.values + shift)
        return np.ascontiguousarray(roots[:, None] * self.vectors.T), np.asarray(
            self.vectors.T @ (shift * x - self.q) / roots
        )


def _least_squares(P: Array, q: Array) -> _Objective:
    size, none = float(np.abs(P).max(initial=0.0)), np.empty(0)
    if np.abs(P - P.T).max(initial=0.0) > 1e-9 * size:
        raise HqpError("P", "is not symmetric", "pass (P + P.T) / 2, which has the same objective")
    root = _cholesky(P)
    if root is not None:
        return _Objective(q, root, np.asarray(-np.linalg.solve(root.T, q)), none, none, 0.0)
    values, vectors = np.linalg.eigh(P)
    largest = max(float(values[-1]), 0.0)
    if values[0] < -CONVEX * largest or (largest == 0.0 and values[0] < 0.0):
        why = f"has the eigenvalue {values[0]:.1e}: it is not positive semidefinite"
        raise HqpError("P", why, "the QP is not convex, and this solver is for convex ones")
    kept = values > RANK * largest
    roots, range_of = np.sqrt(values[kept]), vectors[:, kept]
    inside = range_of.T @ q
    if np.linalg.norm(q - range_of @ inside) <= INSIDE * np.linalg.norm(q):
        root = np.ascontiguousarray(roots[:, None] * range_of.T)
        return _Objective(q, root, np.asarray(-inside / roots), none, none, 0.0)
    shift = max(PROXIMITY * largest, float(np.linalg.norm(q)) / REACH)
    return _Objective(q, none, none, np.maximum(values, 0.0), vectors, shift)


def _cholesky(P: Array) -> NDArray[np.float64] | None:
    """R with R^T R = P, or None where P is singular or close to it."""
    try:
        root = np.linalg.cholesky(P).T
    except np.linalg.LinAlgError:
        return None
    pivots = np.diag(root)
    return np.ascontiguousarray(root) if len(pivots) and pivots.min() > 1e-5 * pivots.max() else None


def _approach(
    P: Array, q: Array, objective: _Objective, levels: list[Level], solver: Solver
) -> tuple[Status, int]:
    """Proximal steps until x, in the solver, stays. Returns how that ended, and the iterations."""
    solution, iterations, shift = solver.solution, 0, objective.shift
    least, step = PROXIMITY * max(float(objective.values[-1]), shift), np.full(len(q), np.inf)
    for _ in range(REPEATS):
        before, last = solution.x.copy(), step
        shift = max(LESS * shift, least)
        levels[1].A[:], levels[1].b[:] = objective.rows(shift, before)
        solver.resolve(levels, 1)
        iterations += solution.iterations
        if solution.status is Status.NOT_PROVEN and shift < objective.shift:  # too far for its rounding
            shift = least = min(shift / LESS**2, objective.shift)
            solver.start(before)
            levels[1].A[:], levels[1].b[:] = objective.rows(shift, before)
            solver.solve(levels)
            iterations += solution.iterations
        if solution.status is not Status.SOLVED:
            return solution.status, iterations
        step = solution.x - before
        moved = np.linalg.norm(step)
        if shift * moved <= 1e-10 * (1.0 + np.linalg.norm(q)):
            return Status.SOLVED, iterations
        if np.linalg.norm(step - last) <= 1e-6 * moved and _is_ray(P, q, levels[0], step / moved):
            raise UnboundedError(step / moved)
    return Status.ITERATION_CAP, iterations


def _is_ray(P: Array, q: Array, constraints: Level, ray: Array) -> bool:
    tiny = 1e-7
    value = constraints.C @ ray
    size = tiny * (1.0 + np.linalg.norm(constraints.C, axis=1))
    keeps = (value <= np.where(np.isfinite(constraints.ub), size, np.inf)) & (
        value >= np.where(np.isfinite(constraints.lb), -size, -np.inf)
    )
    is_flat = np.linalg.norm(P @ ray) <= tiny * max(float(np.abs(P).max(initial=0.0)), 1e-300)
    equal = np.linalg.norm(constraints.A @ ray) <= tiny * (1.0 + np.linalg.norm(constraints.A))
    return bool(q @ ray < 0.0 and is_flat and equal and keeps.all())


def _broken(constraints: Level, found: Solution) -> bool:
    """A constraint is missed by more than MET and rounding."""
    w, v = found.w[0], found.v[0]
    bound = np.where(v > 0.0, constraints.lb, constraints.ub)
    bound = np.concatenate([constraints.b, np.where(np.isfinite(bound), bound, 0.0)])
    lengths = np.linalg.norm(np.vstack([constraints.A, constraints.C]), axis=1)
    most = MET * (1.0 + np.abs(bound)) + ROUNDING * lengths * np.linalg.norm(found.x)
    return bool((np.abs(np.concatenate([w, v])) > most).any())


def _conflict(levels: list[Level], parts: list[tuple[str, slice]], x: Array) -> list[tuple[str, int, float]]:
    rows = []
    for _, part, row, multiplier in conflicts(levels, x, 0):
        if part == "A":
            rows.append(("A", row, multiplier))
            continue
        name, start = next((name, s.start) for name, s in parts if s.start <= row < s.stop)
        rows.append((name, row - start, multiplier))
    return rows


def _multipliers(levels: list[Level], parts: list[tuple[str, slice]], x: Array) -> Array:
    """Those of A, G and the box, one after the other."""
    of_level = multipliers(levels, x, 1)[0]
    box = of_level.C[parts[1][1]]
    return np.concatenate([of_level.A, of_level.C[parts[0][1]], box if len(box) else np.zeros(len(x))])
