"""The solver: the C core behind numpy arrays. docs/hqp.md has the algorithm and its guarantees."""

from collections.abc import Sequence
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._hqp import ffi, lib
from .problem import Array, HqpError, Level


class Status(IntEnum):
    """0: solved. Positive: x is usable, with a remark. Negative: data refused, x is the last good one."""

    SOLVED = lib.HQP_SOLVED
    ITERATION_CAP = lib.HQP_ITERATION_CAP
    REPEATED_SET = lib.HQP_REPEATED_SET
    BAD_MATRIX = lib.HQP_BAD_MATRIX
    BAD_BOUNDS = lib.HQP_BAD_BOUNDS
    OVERFLOW = lib.HQP_OVERFLOW

    def __str__(self) -> str:
        return str(ffi.string(lib.hqp_status_name(int(self))).decode())


class Solution:
    """What a solve found. The arrays belong to the solver and hold until its next call.

    Attributes:
        x: (n,).
        w: per level (equalities,), b - A x.
        v: per level (inequalities,), the smallest correction that brings C x into [lb, ub].
        active: per level (inequalities,) int8: -1 at or below lb, 1 at or above ub, 0 between. A row with
            lb == ub counts as 1, or as -1 where C x falls short; one that cannot act (all zero, or no bound)
            as 0.
    """

    __slots__ = ("_info", "active", "v", "w", "x")

    def __init__(self, n: int, rows: Sequence[tuple[int, int]], info: Any) -> None:
        equalities = np.cumsum([0, *(r[0] for r in rows)])
        inequalities = np.cumsum([0, *(r[1] for r in rows)])
        w, v = np.zeros(equalities[-1]), np.zeros(inequalities[-1])
        active = np.zeros(inequalities[-1], dtype=np.int8)
        self._info = info
        self.x: Array = np.zeros(n)
        self.w: list[Array] = np.split(w, equalities[1:-1])
        self.v: list[Array] = np.split(v, inequalities[1:-1])
        self.active: list[NDArray[np.int8]] = np.split(active, inequalities[1:-1])
        info.w, info.v = ffi.from_buffer("double[]", w), ffi.from_buffer("double[]", v)
        info.active = ffi.from_buffer("signed char[]", active)

    @property
    def status(self) -> Status:
        """How the solve ended."""
        return Status(self._info.status)

    @property
    def iterations(self) -> int:
        """Working sets tried after the first of each level."""
        return int(self._info.iterations)

    @property
    def levels_done(self) -> int:
        """Levels proven optimal, counted from the first."""
        return int(self._info.levels_done)

    @property
    def unique(self) -> bool:
        """The levels leave x no freedom."""
        return bool(self._info.rank == len(self.x))

    @property
    def bad_level(self) -> int:
        """Level (from 0) of the entry that was refused, or -1."""
        return int(self._info.bad_level)

    def __repr__(self) -> str:
        return f"Solution(status={self.status!r}, iterations={self.iterations}, x={self.x})"


class Solver:
    """Hierarchical least squares with inequalities, warm-started from the last solve.

    Everything is allocated here: solve allocates nothing, and its work is bounded by max_iterations.

    Args:
        n: number of variables.
        rows: per level its numbers of equality and inequality rows.
        feasibility: a row holds when it is met to this times (1 + |bound|), plus rounding.
        rank: a row is dependent on others when less than this part of its norm is left.
        rounding: relative error of row . x; a multiplier that it could have caused counts as zero.
        max_iterations: working sets that may be tried after the first of each level, over the whole solve;
            0: 8 n, at least 64.

    Raises:
        HqpError: a size or a setting that is out of range.
    """

    def __init__(
        self,
        n: int,
        rows: Sequence[tuple[int, int]],
        *,
        feasibility: float = 1e-13,
        rank: float = 1e-9,
        rounding: float = 5e-15,
        max_iterations: int = 0,
    ) -> None:
        self.n, self.rows = n, tuple((int(eq), int(ineq)) for eq, ineq in rows)
        equalities = ffi.new("int[]", [eq for eq, _ in self.rows])
        inequalities = ffi.new("int[]", [ineq for _, ineq in self.rows])
        dims = ffi.new("hqp_dims *", (n, len(self.rows), equalities, inequalities))
        settings = ffi.new("hqp_settings *", (feasibility, rank, rounding, max_iterations))
        solver = lib.hqp_create(dims, settings)
        if solver == ffi.NULL:
            raise HqpError(
                f"Solver(n={n}, rows={self.rows})",
                "is out of range, or memory is short",
                "take n in 1..1024, 1..256 levels, 0..4096 rows of each kind, tolerances in (0, 1)",
            )
        self._solver = ffi.gc(solver, lib.hqp_destroy)
        self._info = ffi.new("hqp_info *")
        self._levels = ffi.new("hqp_level[]", max(len(self.rows), 1))
        self._solution = Solution(n, self.rows, self._info)
        self._x = ffi.from_buffer("double[]", self._solution.x)
        self._bound: Sequence[Level] | None = None
        self._kept: list[Level] = []

    @property
    def solution(self) -> Solution:
        """The solver's one Solution; all zero before the first solve."""
        return self._solution

    def solve(self, levels: Sequence[Level]) -> Solution:
        """Solve, starting from the last solution and its working sets.

        The arrays are bound when `levels` is not the object of the last call: to change numbers write into
        the arrays, to exchange arrays pass a new sequence.

        Args:
            levels: one Level per entry of `rows`, of these shapes.

        Returns:
            The solver's one Solution; look at its status: NaN and contradicting bounds raise nothing.

        Raises:
            HqpError: levels of another number or shape.
        """
        if levels is not self._bound:
            self._bind(levels)
        lib.hqp_solve(self._solver, self._levels, self._x, self._info)
        return self._solution

    def resolve(self, levels: Sequence[Level], first_changed_level: int) -> Solution:
        """Solve again where only levels[first_changed_level:], from 0, have changed since the last call."""
        if levels is not self._bound:
            self._bind(levels)
        lib.hqp_resolve(self._solver, self._levels, first_changed_level, self._x, self._info)
        return self._solution

    def reset(self) -> None:
        """Forget the last solution and its working sets: the next solve starts cold, from x = 0."""
        lib.hqp_reset(self._solver)

    def _bind(self, levels: Sequence[Level]) -> None:
        shapes = tuple(level.rows for level in levels)
        if shapes != self.rows:
            raise HqpError("levels", f"have rows {shapes}", f"this solver was made for {self.rows}")
        for p, level in enumerate(levels):
            if level.n != self.n:
                raise HqpError(
                    f"level {p}", f"has {level.n} columns", f"this solver was made for n = {self.n}"
                )
        for bound, level in zip(self._levels, levels, strict=False):
            for name in ("A", "b", "C", "lb", "ub"):
                setattr(bound, name, ffi.from_buffer("double[]", getattr(level, name)))
        self._bound, self._kept = levels, list(levels)


def solve(levels: Sequence[Level], **settings: Any) -> Solution:
    """Solve one problem once.

    Args:
        levels: the problem, most important first.
        settings: as of Solver.

    Returns:
        A Solution with buffers of its own.

    Raises:
        HqpError: no level, or levels that do not fit each other.
    """
    if not levels:
        raise HqpError("levels", "is empty", "give at least one Level")
    return Solver(levels[0].n, [level.rows for level in levels], **settings).solve(levels)
