"""A quadratic program in other units, for one that could not be proven in its own.

With x = unit x' the diagonal of P becomes about 1, and rows and objective get about the length 1. All factors
are powers of 2, so that nothing is rounded. What is found there is proven once more in the caller's units.
"""

from time import monotonic

import numpy as np

from ._qp import INFEASIBLE, NOT_PROVEN, TIME_LIMIT, UNBOUNDED, is_proven
from .problem import Array
from .qp_data import QpData
from .qp_solution import QpSolution
from .solver import Status

ATTEMPTS = 2  # the second from where the first ended
GRAIN = 1e-15  # of the largest: a smaller part of an answer is rounding
FAR = 1e4  # times 1 + |x|: rows of a conflict are met nowhere nearer, as in hqp_qp.c


def solve_scaled(data: QpData, max_iterations: int, until: float) -> tuple[QpSolution, int]:
    """The answer in the data's own units, and how the solve ended.

    Args:
        data: the QP.
        max_iterations: as of solve_qp.
        until: when, by monotonic(), to give up [s]; may be infinite.
    """
    unit = units(data)
    P, q, A, G = unit[:, None] * data.P * unit, unit * data.q, data.A * unit, data.G * unit
    weight = float(_power_of_2(np.abs(P).max(initial=0.0) or np.abs(q).max(initial=0.0)))
    of_A, of_G = 1.0 / _power_of_2(np.linalg.norm(A, axis=1)), 1.0 / _power_of_2(np.linalg.norm(G, axis=1))
    rows = of_G[:, None] * G, of_G * data.h, of_A[:, None] * A, of_A * data.b
    lb, ub, start = (None if x is None else x / unit for x in (data.lb, data.ub, data.initvals))
    scaled = QpData(P / weight, q / weight, *rows, lb, ub, start)
    for _ in range(ATTEMPTS):
        found, ends = solve_within(scaled, max_iterations, until)
        if ends != NOT_PROVEN:
            break
        scaled = scaled._replace(initvals=found.x)
    if ends == NOT_PROVEN and _is_proven_clean(scaled, found):
        ends, found.found, found.status = int(Status.SOLVED), True, Status.SOLVED
    with np.errstate(over="ignore", invalid="ignore"):
        found.x = found.x * unit / (np.linalg.norm(found.x * unit) if ends == UNBOUNDED else 1.0)
        found.objective = float(0.5 * found.x @ data.P @ found.x + data.q @ found.x)
    if ends < 0 or not np.isfinite(found.objective):  # in one of these units it is too large
        found.x, found.objective = np.zeros(len(unit)), 0.0
        return found, NOT_PROVEN
    multipliers = np.concatenate([of_A * found.y, of_G * found.z, found.z_box / unit])
    if ends != INFEASIBLE:
        multipliers = weight * multipliers
    found._multipliers = multipliers
    if ends == INFEASIBLE and not is_conflict(data, found):
        ends = NOT_PROVEN
    if found.found and not is_proven(*data._replace(initvals=found.x), multipliers):
        ends, found.found, found.status = NOT_PROVEN, False, Status.NOT_PROVEN
    return found, TIME_LIMIT if ends == NOT_PROVEN and monotonic() > until else ends


def _is_proven_clean(data: QpData, found: QpSolution) -> bool:
    """Whether an answer is optimal without what is rounding beside its largest parts, which is taken out."""
    largest = np.abs(found.x).max(initial=0.0)
    found.x[np.abs(found.x) <= GRAIN * largest] = 0.0
    pull = np.abs(data.P).max(initial=0.0) * largest + np.abs(data.q).max(initial=0.0)
    multipliers = np.concatenate([found.y, found.z, found.z_box])
    multipliers[np.abs(multipliers) <= GRAIN * pull] = 0.0
    found._multipliers = multipliers
    return bool(is_proven(*data._replace(initvals=found.x), multipliers))


def solve_within(data: QpData, max_iterations: int, until: float) -> tuple[QpSolution, int]:
    """The answer in the units at hand, and how the solve ended, which gives up at `until`."""
    found = QpSolution.solve(*data, max_iterations, seconds_left(until), Status.SOLVED)
    return found, found._ends


def seconds_left(until: float) -> float:
    """What is left until then as a time limit: not 0, which is none."""
    return max(until - monotonic(), 1e-9) if until < np.inf else 0.0


def is_conflict(data: QpData, found: QpSolution) -> bool:
    """Whether the rows with multipliers add up to 0 x < 0 in these units, or are met far away from x only."""
    if data.lb is not None and data.ub is not None and (data.lb > data.ub)[found.z_box != 0.0].any():
        return True
    total = found.y @ data.A + found.z @ data.G + found.z_box
    acts = found.z != 0.0  # h of others may be infinite
    bound = found.y @ data.b + found.z[acts] @ data.h[acts]
    for side, limit in ((found.z_box > 0.0, data.ub), (found.z_box < 0.0, data.lb)):
        bound += found.z_box[side] @ limit[side] if limit is not None else 0.0
    return bool(bound < -FAR * np.abs(total).max(initial=0.0) * (1.0 + np.abs(found.x).sum()))


def units(data: QpData) -> Array:
    """One for each variable: by its own P, or where it has none by the rows it is in, or by its bounds."""
    bend = np.sqrt(np.maximum(np.diag(data.P), 0.0))
    rows = np.vstack([data.A, data.G])
    length = np.linalg.norm(rows, axis=1)
    share = np.abs(rows[length > 0.0] / length[length > 0.0, None]).max(axis=0, initial=0.0)
    bounds = [
        np.where(np.isfinite(bound), np.abs(bound), 0.0) for bound in (data.lb, data.ub) if bound is not None
    ]
    reach = np.max([np.zeros(len(bend)), *bounds], axis=0)
    by_rows = np.where(share > 0.0, 1.0 / np.maximum(share, 1e-300), np.where(reach > 0.0, reach, 1.0))
    return _power_of_2(np.where(bend > 0.0, 1.0 / np.maximum(bend, 1e-300), by_rows))


def _power_of_2(sizes: Array | float) -> Array:
    """The nearest, of each; 1 of 0."""
    return np.exp2(np.round(np.log2(np.where(np.asarray(sizes) > 0.0, sizes, 1.0))))
