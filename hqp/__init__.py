"""Hierarchical least squares with inequalities over a C active-set core.

Level p asks for A x + w = b and lb <= C x + v <= ub, with |w|^2 + |v|^2 least among the minimisers of the
levels before it.
"""

from .problem import HqpError, Level
from .solver import Solution, Solver, Status, solve

__all__ = ["HqpError", "Level", "Solution", "Solver", "Status", "solve"]
