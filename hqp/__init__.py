"""Hierarchical least squares with inequalities over a C active-set core.

Level p asks for A x + w = b and lb <= C x + v <= ub, with |w|^2 + |v|^2 least among the minimisers of the
levels before it.
"""

from .multipliers import Conflict, Multipliers, conflicts, multipliers
from .problem import HqpError, Level
from .qp import QpSolution, UnboundedError, solve_qp
from .solver import Solution, Solver, Status, solve

__all__ = [
    "Conflict",
    "HqpError",
    "Level",
    "Multipliers",
    "QpSolution",
    "Solution",
    "Solver",
    "Status",
    "UnboundedError",
    "conflicts",
    "multipliers",
    "solve",
    "solve_qp",
]
