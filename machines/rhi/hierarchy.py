"""Force and posture of a redundant interface as levels of a hierarchical QP.

Over the torques tau and the rendered share alpha of the force F:

0. torque box, 0 <= alpha <= what limits or headroom allow for alpha J^T F and the coupling
1. the hand feels alpha F and nothing else: J#^T tau = alpha F + the coupling force, and the end stop
2. the posture keeps the joint limits, as softly as csrc/guard.h
3. alpha = 1, and the wish of the null space in the M^-1 metric: least
   |w (1 - alpha)|^2 + |L^-1 (tau - alpha J^T F - tau_N)|^2, w = 10 |L^-1 J^T F|: the force counts ten times

Far from box and joint limits this is the projection law (3); at the box the projection can only shrink tau_N
as a whole, while here every motor gives what it has left. Each level has one answer that moves with what it
is asked: next to singular postures, limits that do not give way ask for all the torque there is, one way or
the other, and a force that comes before the posture has its torques jump between corners of the box.
"""

from __future__ import annotations

import numpy as np

from ...hqp import Level, Slacks, Solver, Status
from ...models import Array
from .nullspace import NullSpace

MAX_ITERATIONS = 64
"""Iterations of one solve: the bound on its time."""


LEVELS: tuple[tuple[str, str], ...] = (
    ("torques of the motors", "N m"),
    ("force at the hand", "N"),
    ("limits of joints", "N m"),
    ("force in full, and posture", "N m/sqrt(kg m^2)"),
)
"""Name of every level, and the unit of its slack."""


class Hierarchy:
    """Resolves force and posture with the hierarchical solver; see ``Resolution``.

    Attributes:
        torque: (n,) [N m]; alpha: rendered share of the force.
        iterations, status, levels_done: of the last solve.
    """

    solves, levels = 1, LEVELS

    def __init__(self, space: NullSpace) -> None:
        """Bind to the arrays of a null space."""
        m, n = space.inverse.shape
        self._n, self._space = n, space
        self.torque, self.alpha, self.iterations = np.zeros(n), 1.0, 0
        self._box = Level(C=np.eye(n + 1), lb=np.array([*-space.room, 0.0]), ub=np.array([*space.room, 1.0]))
        self._least, self._most = self._box.lb[:n], self._box.ub[:n]
        force = Level(A=np.zeros((m, n + 1)), b=np.zeros(m))
        guard = space.guard
        limits = Level(C=np.zeros((n, n + 1)), lb=guard.floor, ub=guard.ceiling)
        posture = Level(A=np.zeros((n + 1, n + 1)), b=np.zeros(n + 1))
        self._levels = (self._box, force, limits, posture)
        self._rows = [force.A, force.b, limits.C, posture.A, posture.b]
        rows = [level.rows for level in self._levels]
        self._solver = Solver(n + 1, rows, max_iterations=MAX_ITERATIONS)
        self.status, self.levels_done = int(Status.SOLVED), 0
        self._slacks = Slacks(self._solver.solution, len(LEVELS), range(len(LEVELS)))

    def resolve(self, part: float, gain: float) -> bool:
        """Solve the levels of this tick; False where the solver does not stand by its answer."""
        space, n = self._space, self._n
        self._most[:] = space.room
        np.negative(self._most, out=self._least)
        self._box.ub[n] = space.bearable(part)
        space.level_rows(self._rows, gain)
        solution = self._solver.solve(self._levels)
        self.iterations = solution.iterations
        self.status, self.levels_done = int(solution.status), solution.levels_done
        if solution.status != Status.SOLVED:
            return False
        np.minimum(solution.x[:n], self._most, out=self.torque)  # rounding may pass the box
        np.maximum(self.torque, self._least, out=self.torque)
        self.alpha = float(solution.x[n])
        return True

    def write_slack(self, slack: Array) -> None:
        """How far each level was from being met in the last solve, (levels,)."""
        self._slacks.write(slack)
