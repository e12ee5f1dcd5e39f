"""The solver: the C core behind numpy arrays. docs/hqp.md has the algorithm and its guarantees."""

import operator
from collections.abc import Iterable, Sequence
from enum import IntEnum
from itertools import islice
from threading import Lock, get_ident
from typing import Any, Final, NoReturn, SupportsIndex

import numpy as np
from numpy.typing import NDArray

from ..binding import BindError, bind, hold, places, pointer, put
from .core import ffi, lib
from .problem import PARTS, Array, HqpError, Level, real_numbers

MOST_LEVELS = 256
MOST_ITERATIONS = 2**31 - 1
FEW = 8  # levels that a message shows
SIZES = "take n in 1..1024, 1..256 levels, 0..16384 rows of each kind, rows times n up to 2^26"
ITERATIONS = f"take 0 for the usual number, or up to {MOST_ITERATIONS}"


class Status(IntEnum):
    """0: solved. Positive: x is usable, with a remark. Negative: data refused, x is the last good one."""

    SOLVED = lib.HQP_SOLVED
    ITERATION_CAP = lib.HQP_ITERATION_CAP
    REPEATED_SET = lib.HQP_REPEATED_SET
    NOT_PROVEN = lib.HQP_NOT_PROVEN
    TIME_LIMIT = lib.HQP_TIME_LIMIT
    BAD_MATRIX = lib.HQP_BAD_MATRIX
    BAD_BOUNDS = lib.HQP_BAD_BOUNDS
    OVERFLOW = lib.HQP_OVERFLOW

    def __str__(self) -> str:
        return str(ffi.string(lib.hqp_status_name(int(self))).decode())


REMARKS: Final[dict[int, str]] = {int(status): str(status) for status in Status if status}
"""In words, what the solver says where it does not stand by its answer."""
_STATUS: Final[dict[int, Status]] = {int(status): status for status in Status}


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

    __slots__ = ("_held", "_info", "_x", "active", "v", "w", "x")

    x: Array
    w: tuple[Array, ...]
    v: tuple[Array, ...]
    active: tuple[NDArray[np.int8], ...]
    _info: Any
    _x: Any

    def __init__(self, n: int, rows: Sequence[tuple[int, int]], info: Any) -> None:
        equalities = np.cumsum([0, *(r[0] for r in rows)])
        inequalities = np.cumsum([0, *(r[1] for r in rows)])
        x, w, v = np.zeros(n), np.zeros(equalities[-1]), np.zeros(inequalities[-1])
        active = np.zeros(inequalities[-1], dtype=np.int8)
        own = {
            "x": x,
            "w": tuple(np.split(w, equalities[1:-1])),
            "v": tuple(np.split(v, inequalities[1:-1])),
            "active": tuple(np.split(active, inequalities[1:-1])),
            "_info": info,
            "_x": pointer(x, "double", n, name="x"),
            "_held": hold(x),
        }
        for name, value in own.items():
            object.__setattr__(self, name, value)
        sizes = {"equalities": len(w), "inequalities": len(v)}
        bind(lib, info, sizes, w=w, v=v, active=active)

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"{name} of a Solution is the solver's; take a copy to change it")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"{name} of a Solution is the solver's; it cannot be deleted")

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        raise HqpError("Solution", "is a view into its solver", "copy what you need of it, e.g. x.copy()")

    @property
    def status(self) -> Status:
        """How the solve ended."""
        return _STATUS[self._info.status]

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
            0: 48 n, at least 8000.
        time_limit: seconds after which a solve ends, looked at with each working set; 0: none. Where it ends
            a solve the answer depends on the machine.

    Raises:
        HqpError: a size or a setting that is out of range.
    """

    def __init__(
        self,
        n: int,
        rows: Iterable[tuple[int, int]],
        *,
        feasibility: float = 1e-13,
        rank: float = 1e-9,
        rounding: float = 5e-15,
        max_iterations: int = 0,
        time_limit: float = 0.0,
    ) -> None:
        tolerances = {"feasibility": feasibility, "rank": rank, "rounding": rounding}
        _check_settings(tolerances, time_limit)
        iterations = _whole("max_iterations", max_iterations, ITERATIONS)
        if not 0 <= iterations <= MOST_ITERATIONS:
            raise HqpError("max_iterations", f"is {iterations}", ITERATIONS)
        limits = {"max_iterations": iterations, "time_limit": time_limit}
        variables, counts = _whole("n", n, SIZES), _counts(rows)
        try:
            dims = ffi.new("hqp_dims *", {"n": variables, "levels": len(counts)})
            equalities, inequalities = np.array(counts, np.intc).reshape(-1, 2).T.copy()
            bind(lib, dims, equalities=equalities, inequalities=inequalities)
            solver = lib.hqp_create(dims, ffi.new("hqp_settings *", tolerances | limits))
        except (ValueError, OverflowError) as error:
            raise HqpError("Solver", f"cannot be made of this: {error}", SIZES) from error
        if solver == ffi.NULL:
            shown = f"{counts[:FEW]}" if len(counts) <= FEW else f"{counts[:FEW]} and more"
            raise HqpError(f"Solver(n={n}, rows={shown})", "is out of range, or memory is short", SIZES)
        self._n, self._rows = int(dims.n), tuple(counts)
        self._solver = ffi.gc(solver, lib.hqp_destroy)
        self._info = ffi.new("hqp_info *")
        self._levels = ffi.new("hqp_level[]", len(counts))
        self._places = [
            places(
                lib,
                self._levels,
                {"n": self._n, "equalities": eq, "inequalities": ineq, "weights": eq + ineq},
                p,
                PARTS,
            )
            for p, (eq, ineq) in enumerate(counts)
        ]
        self._solution = Solution(self._n, self._rows, self._info)
        self._bound: tuple[Level, ...] = ()
        self._lock = Lock()
        self._thread: int | None = None

    @property
    def n(self) -> int:
        """Number of variables."""
        return self._n

    @property
    def rows(self) -> tuple[tuple[int, int], ...]:
        """Per level its numbers of equality and inequality rows."""
        return self._rows

    @property
    def solution(self) -> Solution:
        """The solver's one Solution; all zero before the first solve."""
        return self._solution

    def solve(self, levels: Iterable[Level]) -> Solution:
        """Solve, starting from the last solution and its working sets.

        The arrays are bound until other Level objects are passed: to change numbers write into the arrays, to
        exchange an array exchange its Level.

        Args:
            levels: one Level per entry of `rows`, of these shapes.

        Returns:
            The solver's one Solution; look at its status: NaN and contradicting bounds raise nothing. Ctrl-C
            waits for the end of a solve.

        Raises:
            HqpError: levels of another number or shape, or a solver that another thread uses.
        """
        return self._solve_from(0, levels)

    def resolve(self, levels: Iterable[Level], first_changed_level: int) -> Solution:
        """Solve again where only levels[first_changed_level:], from 0, have changed since the last call.

        A level above that is another object than in the last call counts as changed, too.

        Raises:
            HqpError: as solve; or first_changed_level is not in 0..len(levels).
        """
        try:
            first = operator.index(first_changed_level)
        except TypeError:
            first = -1
        if not 0 <= first <= len(self._rows):
            raise HqpError(
                "first_changed_level",
                f"is {first_changed_level!r}",
                f"number the levels from 0; {len(self._rows)} says that none has changed",
            )
        return self._solve_from(first, levels)

    def start(self, x: Array) -> None:
        """Let the next solve start from x, and from the rows that are violated or at their bound there.

        What is remembered of the last solve is forgotten. A wrong guess costs time, not accuracy: one of
        length 1e7 or more, of which rounding hides what rows lack, is not used. The solver belongs to the
        thread of its next solve.

        Args:
            x: (n,), finite.

        Raises:
            HqpError: no real numbers, another shape, an entry that is not finite, or it is solving in another
                thread.
        """
        guess = real_numbers("x", x, 1, (self._n,))
        self._take()
        try:
            if not lib.hqp_start(self._solver, pointer(guess, "const double", self._n)):
                raise HqpError("x", "has an entry that is not finite", "start from finite numbers")
            self._thread = None
        finally:
            self._lock.release()

    def reset(self) -> None:
        """Forget the last solution and its working sets: the next solve starts cold, from x = 0.

        The solver belongs to the thread of its next solve.

        Raises:
            HqpError: it is solving in another thread.
        """
        self._take()
        try:
            lib.hqp_reset(self._solver)
            self._thread = None
        finally:
            self._lock.release()

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        raise HqpError("Solver", "cannot be copied or pickled", "make another one of the same n and rows")

    def _solve_from(self, first: int, levels: Iterable[Level]) -> Solution:
        if not self._lock.acquire(False):
            _refuse_call()
        try:
            if get_ident() != self._thread:
                self._own()
            if levels is not self._bound:  # the same tuple holds the same levels
                first = min(first, self._bind(levels))
            lib.hqp_resolve(self._solver, self._levels, first, self._solution._x, self._info)
        finally:
            self._lock.release()
        return self._solution

    def _own(self) -> None:
        if self._thread is not None:
            raise HqpError(
                "Solver", "belongs to another thread", "give each its own, or hand it over with reset()"
            )
        self._thread = get_ident()

    def _take(self) -> None:
        if not self._lock.acquire(False):
            _refuse_call()

    def _bind(self, levels: Iterable[Level]) -> int:
        """Point at the arrays of these levels. Returns the first level that is not the one bound already."""
        count = len(self._rows)
        new = _listed(levels, count)
        if len(new) != count or any(type(level) is not Level for level in new):
            self._refuse(new)
        same = list(map(operator.is_, new, self._bound)) if self._bound else []
        first = same.index(False) if False in same else count if same else 0
        self._bound = ()  # so that nothing passes for bound where a level is refused
        for p in range(first, count):
            if not same or not same[p]:
                self._bind_level(p, new)
        self._bound = new
        return first

    def _bind_level(self, p: int, levels: tuple[Level, ...]) -> None:
        level = levels[p]
        weights = level.weights if level.weights.size else None
        arrays = (level.A, level.b, level.C, level.lb, level.ub, weights)  # as in PARTS
        try:
            put(self._levels, p, self._places[p], arrays)
            return
        except BindError as error:
            problem = error
        self._refuse(levels)
        raise problem

    def _refuse(self, levels: tuple[Level, ...]) -> None:
        """Say what is wrong with these levels, if anything is."""
        _check_types(levels)
        for level in levels:
            level.check()
        shapes = tuple(level.rows for level in levels)
        if shapes != self.rows:
            raise HqpError("levels", f"have rows {shapes}", f"this solver was made for {self.rows}")
        for p, level in enumerate(levels):
            if level.n != self.n:
                raise HqpError(
                    f"level {p}", f"has {level.n} columns", f"this solver was made for n = {self.n}"
                )


def _refuse_call() -> NoReturn:
    raise HqpError("Solver", "is in the middle of a call", "give each thread a Solver of its own")


def _listed(levels: Iterable[Level], most: int) -> tuple[Level, ...]:
    """Up to one more than `most` of the levels: an endless iterable ends, too."""
    if type(levels) is tuple:
        return levels
    try:
        iterator = iter(levels)
    except TypeError as error:
        raise HqpError("levels", f"is of type {type(levels).__name__}", "give a list of Level") from error
    return tuple(islice(iterator, most + 1))


def _check_types(levels: tuple[Level, ...]) -> None:
    for p, level in enumerate(levels):
        if not isinstance(level, Level):
            raise HqpError(f"level {p}", f"is of type {type(level).__name__}", "give a list of Level")


def _whole(name: str, value: object, mend: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise HqpError(name, f"is {value!r}, not a whole number", mend)
    return int(value)


def _counts(rows: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    try:
        pairs = [(equalities, inequalities) for equalities, inequalities in islice(rows, MOST_LEVELS + 1)]
    except (TypeError, ValueError) as error:
        raise HqpError("rows", f"are not pairs (equalities, inequalities): {error}", SIZES) from error
    return [
        (_whole(f"level {p}: equalities", eq, SIZES), _whole(f"level {p}: inequalities", ineq, SIZES))
        for p, (eq, ineq) in enumerate(pairs)
    ]


def _check_settings(tolerances: dict[str, float], time_limit: float) -> None:
    for name, value in {**tolerances, "time_limit": time_limit}.items():
        if isinstance(value, bool) or not isinstance(value, float | int | np.floating | np.integer):
            raise HqpError(name, f"is of type {type(value).__name__}", "give a number")
    for name, value in tolerances.items():
        if not 0.0 < value < 1.0:
            raise HqpError(name, f"is {value}", "take one between 0 and 1")
    if not time_limit >= 0.0:
        raise HqpError("time_limit", f"is {time_limit}", "give seconds, or 0 for none")


def solve(levels: Iterable[Level], **settings: Any) -> Solution:
    """Solve one problem once.

    Args:
        levels: the problem, most important first.
        settings: as of Solver.

    Returns:
        A Solution with buffers of its own.

    Raises:
        HqpError: no level, levels that do not fit each other, or a setting that there is not.
    """
    known = Solver.__init__.__kwdefaults__ or {}
    if unknown := sorted(settings.keys() - known.keys()):
        raise HqpError(unknown[0], "is no setting", f"those are {', '.join(known)}")
    kept = _listed(levels, MOST_LEVELS)
    if not kept:
        raise HqpError("levels", "is empty", "give at least one Level")
    _check_types(kept)
    return Solver(kept[0].n, [level.rows for level in kept], **settings).solve(kept)
