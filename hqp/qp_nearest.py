"""Where the constraints of a quadratic program contradict each other: the x that breaks them least."""

import numpy as np

from .problem import Array, Level
from .qp_data import QpData
from .qp_scaled import seconds_left
from .solver import Solver, Status


def nearest(data: QpData, max_iterations: int, until: float) -> tuple[Array, Status]:
    """The x with the least sum of squares of its distances to the constraints, and how sure that is.

    Args:
        data: the QP.
        max_iterations: working sets that may be tried; 0: automatic.
        until: as of solve_scaled.
    """
    n = len(data.q)
    box = np.eye(n)[: 0 if data.lb is None and data.ub is None else n]
    lower = np.full(n, -np.inf) if data.lb is None else data.lb
    upper = np.full(n, np.inf) if data.ub is None else data.ub
    are_crossed = lower > upper  # of the two distances the squares are least in the middle
    middle = 0.5 * (lower[are_crossed] + upper[are_crossed])
    lower, upper = lower[: len(box)].copy(), upper[: len(box)].copy()
    lower[are_crossed[: len(box)]] = upper[are_crossed[: len(box)]] = middle
    level = Level(
        A=data.A,
        b=data.b,
        C=np.vstack([data.G, box]),
        lb=np.concatenate([np.full(len(data.G), -np.inf), lower]),
        ub=np.concatenate([data.h, upper]),
        weights=_normalising(np.vstack([data.A, data.G, box])),
    )
    solver = Solver(n, [level.rows], max_iterations=max_iterations, time_limit=seconds_left(until))
    found = solver.solve([level])
    return found.x.copy(), found.status


def _normalising(rows: Array) -> Array:
    """Weights with which each row counts as one of length 1."""
    squares = np.einsum("ij,ij->i", rows, rows)
    return np.where(squares > 1e-60, 1.0 / np.maximum(squares, 1e-60), 1.0)
