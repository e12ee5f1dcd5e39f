"""Hierarchical least squares with inequalities over a C active-set core.

Level p asks for A x + w = b and lb <= C x + v <= ub, with |w|^2 + |v|^2 least among the minimisers of the
levels before it.
"""

from .multipliers import Conflict, Multipliers, conflicts, multipliers
from .problem import HqpError, Level
from .qp import solve_qp
from .qp_solution import QpSolution, UnboundedError
from .slacks import Slacks
from .solver import REMARKS, Solution, Solver, Status, solve

__all__ = [
    "REMARKS",
    "Conflict",
    "HqpError",
    "Level",
    "Multipliers",
    "QpSolution",
    "Slacks",
    "Solution",
    "Solver",
    "Status",
    "UnboundedError",
    "conflicts",
    "multipliers",
    "solve",
    "solve_qp",
]
