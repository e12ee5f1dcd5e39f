"""Interface of qpsolvers to hapticd-hqp, in the form of the modules in qpsolvers/solvers.

To have it in an installed qpsolvers: ``import hapticd_``; then ``qpsolvers.solve_qp(..., solver="hapticd")``.
"""

import time
import warnings
from typing import Any

import numpy as np
import qpsolvers
from hapticd.hqp import HqpError, UnboundedError, solve_qp
from qpsolvers.exceptions import ProblemError
from qpsolvers.problem import Problem
from qpsolvers.solution import Solution
from qpsolvers.solvers import available_solvers, dense_solvers, solve_function


def hapticd_solve_problem(
    problem: Problem, initvals: np.ndarray | None = None, verbose: bool = False, **kwargs: Any
) -> Solution:
    """Solve a quadratic program with hapticd-hqp.

    Args:
        problem: dense; P may be singular.
        initvals: x to start from.
        verbose: warn with what a solve that found nothing ended with.
        kwargs: of hapticd.hqp.solve_qp, e.g. max_iterations, time_limit.

    Returns:
        The solution; `extras` has status, iterations, and the conflict or the ray of a QP without solution.

    Raises:
        ProblemError: sparse matrices, or a P that is not positive semidefinite.
    """
    if problem.has_sparse:
        raise ProblemError("problem has sparse matrices")
    solution = Solution(problem)
    start = time.perf_counter()
    try:
        found = solve_qp(*problem.unpack_as_dense(), initvals=initvals, **kwargs)
    except UnboundedError as error:
        solution.found, solution.extras = False, {"ray": error.ray}
        return solution
    except HqpError as error:
        raise ProblemError(str(error)) from error
    solution.solve_time = time.perf_counter() - start
    solution.extras = {"status": found.status, "iterations": found.iterations, "conflict": found.conflict}
    solution.found = found.found
    if not found.found:
        if verbose:
            warnings.warn(f"hapticd-hqp: {found.status}, conflict {found.conflict}", stacklevel=2)
        return solution
    has_box = problem.lb is not None or problem.ub is not None
    solution.x, solution.obj = found.x, found.objective
    solution.y, solution.z = found.y, found.z
    solution.z_box = found.z_box if has_box else np.empty(0)
    return solution


solve_function["hapticd"] = hapticd_solve_problem
for names in (available_solvers, dense_solvers, qpsolvers.available_solvers, qpsolvers.dense_solvers):
    if "hapticd" not in names:
        names.append("hapticd")
