"""Whether a quadratic program falls for ever: a ray seen in other units, and a point for it to begin from."""

import numpy as np

from ._qp import INFEASIBLE, NOT_PROVEN, UNBOUNDED
from .problem import Array
from .qp_data import QpData
from .qp_scaled import solve_scaled, solve_within, units
from .qp_solution import QpSolution

BENT = 1e-9  # of the largest entry of P: what a flat ray may leave of P ray, in these units
LEFT = 1e-11  # of the length of a row: what of a ray it may see, in these units
FALLS = 1e-10  # of the terms of q^T ray: by more it falls, as in hqp_qp.c


def is_ray(data: QpData, ray: Array) -> bool:
    """Whether the objective falls for ever along `ray`, (n,), inside the constraints.

    Each variable is measured by what P and the rows see of it: 1e-9 of one unit may be 1 of another.
    """
    unit = units(data)
    within = ray / unit
    within /= np.linalg.norm(within)
    bent, tilts = unit * (data.P @ (unit * within)), unit * data.q * within
    bends = np.abs(unit[:, None] * data.P * unit).max(initial=0.0)
    if not (np.abs(bent).max() <= BENT * bends and tilts.sum() < -FALLS * np.abs(tilts).sum()):
        return False
    of_A, of_G = _seen(data.A * unit, within), _seen(data.G * unit, within)
    ends = [np.abs(of_A), of_G[np.isfinite(data.h)]]
    if data.ub is not None:
        ends.append(within[np.isfinite(data.ub)])
    if data.lb is not None:
        ends.append(-within[np.isfinite(data.lb)])
    return not any((part > LEFT).any() for part in ends)


def _seen(rows: Array, ray: Array) -> Array:
    """What each row sees of a ray, for rows of length 1."""
    seen: Array = rows @ ray / np.maximum(np.linalg.norm(rows, axis=1), 1e-300)
    return seen


def unless_infeasible(
    data: QpData, found: QpSolution, ends: int, max_iterations: int, until: float
) -> tuple[QpSolution, int]:
    """What to say of a QP that has a ray or no proof: whether its constraints contradict each other.

    Args:
        data: the QP.
        found: what the solve of it found.
        ends: how that ended, UNBOUNDED, NOT_PROVEN or at a cap.
        max_iterations: as of solve_qp.
        until: as of solve_scaled.

    Returns:
        The conflict of the constraints and INFEASIBLE; or `found` and `ends`, for a ray only if there is a
        point to begin from; or how the search for one ended.
    """
    n = len(data.q)
    constraints = data._replace(P=np.eye(n), q=np.zeros(n), initvals=None)
    point, of_point = solve_within(constraints, max_iterations, until)
    if of_point == NOT_PROVEN:
        point, of_point = solve_scaled(constraints, max_iterations, until)
    if of_point == INFEASIBLE:
        return point, INFEASIBLE
    if ends == UNBOUNDED and not point.found:  # a ray is no x
        point.objective = float(0.5 * point.x @ data.P @ point.x + data.q @ point.x)
        return point, of_point
    return found, ends
