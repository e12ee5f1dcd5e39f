"""The problem: levels of rows over one vector x, and the error of this package."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class HqpError(Exception):
    """A problem that cannot be posed as asked.

    Attributes:
        what: the thing that is wrong, e.g. "C".
        why: what was found and what was expected.
        mend: what to do instead.
    """

    def __init__(self, what: str, why: str, mend: str) -> None:
        super().__init__(what, why, mend)  # what a copy in another process is made of
        self.what, self.why, self.mend = what, why, mend

    def __str__(self) -> str:
        return f"{self.what} {self.why}; {self.mend}"


PARTS = {"A": 2, "b": 1, "C": 2, "lb": 1, "ub": 1, "weights": 1}
"""The arrays of a level and their numbers of dimensions."""
NO_BOUND = {"lb": -np.inf, "ub": np.inf}
LARGEST, CLOSED = 1e100, 1e-9
"""Of a number that is no bound; of lb and ub, what lb may be more by. A solver has the same."""


def _absent() -> Array:
    return np.empty((0, 0))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Level:
    """One level: A x + w = b and lb <= C x + v <= ub, |w|^2 + |v|^2 to be least. Either part may be absent.

    Bounds without C are bounds on x itself.

    The arrays are kept, not copied: write new numbers into them between solves. Of a subclass of ndarray its
    memory is kept; masked arrays are refused, as the mask would be lost.

    Attributes:
        A: (equalities, n), float64 and C-contiguous like all of them.
        b: (equalities,).
        C: (inequalities, n).
        lb: (inequalities,), -inf where there is no bound.
        ub: (inequalities,), +inf where there is no bound.
        weights: (equalities + inequalities,) of the squares in |w|^2 and then |v|^2, positive; absent: all 1.

    Raises:
        HqpError: an array of another type, shape, byte order, alignment or memory order.
    """

    A: Array = field(default_factory=_absent)
    b: Array = field(default_factory=_absent)
    C: Array = field(default_factory=_absent)
    lb: Array = field(default_factory=_absent)
    ub: Array = field(default_factory=_absent)
    weights: Array = field(default_factory=_absent)

    def __post_init__(self) -> None:
        given = [bound for bound in (self.lb, self.ub) if np.ndim(bound) == 1]
        if np.shape(self.C) == (0, 0) and given:
            object.__setattr__(self, "C", np.eye(len(given[0])))
        for name, ndim in PARTS.items():
            value = getattr(self, name)
            if isinstance(value, np.ndarray) and value.shape == (0, 0):  # absent: as wide as the other part
                n = max(np.shape(self.A)[-1:] + np.shape(self.C)[-1:], default=0)
                object.__setattr__(self, name, np.empty((0, n) if ndim == 2 else 0))
            else:
                object.__setattr__(self, name, _plain(name, value, ndim))
        self.check()

    def check(self) -> None:
        """Check again what was checked first: numpy lets shape and dtype of an array change in place.

        Raises:
            HqpError: an array is not, or no longer, of a shape and type that fits the others.
        """
        for name, ndim in PARTS.items():
            _check(name, getattr(self, name), ndim)
        if self.A.shape[1] != self.C.shape[1]:
            raise HqpError(
                "C", f"has {self.C.shape[1]} columns and A has {self.A.shape[1]}", "both have one per x_i"
            )
        if self.A.shape[1] == 0:
            raise HqpError(
                "Level", "has neither A nor C", "give at least one of them, if need be of shape (0, n)"
            )
        if len(self.lb) != len(self.ub):
            bounds = f"has {len(self.ub)} entries and lb has {len(self.lb)}"
            raise HqpError("ub", bounds, "give both, with -inf and inf where there is no bound")
        for matrix, vector in (("A", "b"), ("C", "lb"), ("C", "ub")):
            rows, entries = len(getattr(self, matrix)), len(getattr(self, vector))
            if rows != entries:
                raise HqpError(
                    vector, f"has {entries} entries and {matrix} has {rows} rows", "give one per row"
                )

        if len(self.weights) not in (0, sum(self.rows)):
            raise HqpError(
                "weights",
                f"has {len(self.weights)} entries and the level has {sum(self.rows)} rows",
                "give one for each row of A, then of C, or none",
            )

    @property
    def n(self) -> int:
        """Number of variables."""
        return int(self.A.shape[1])

    @property
    def rows(self) -> tuple[int, int]:
        """Numbers of equality and of inequality rows."""
        return len(self.A), len(self.C)


def _plain(name: str, value: Array, ndim: int) -> Array:
    """The array itself, or what a subclass keeps its numbers in."""
    _check(name, value, ndim)
    _refuse_mask(name, value)
    return value if type(value) is np.ndarray else value.view(np.ndarray)


def _check(name: str, value: object, ndim: int) -> None:
    if not isinstance(value, np.ndarray) or value.dtype != np.float64:
        is_complex = isinstance(value, np.ndarray) and value.dtype.kind == "c"
        kind = f"{value.dtype} array" if isinstance(value, np.ndarray) else type(value).__name__
        dense = f"{name}.toarray()" if hasattr(value, "toarray") else name
        converted = f"pass np.ascontiguousarray({dense}, dtype=np.float64)"
        raise HqpError(name, f"is of type {kind}", "its numbers must be real" if is_complex else converted)
    if value.ndim != ndim:
        raise HqpError(name, f"has shape {value.shape}", f"it must have {ndim} dimension{'s' * (ndim > 1)}")
    if not value.flags.c_contiguous:
        raise HqpError(name, "is not C-contiguous", f"pass np.ascontiguousarray({name})")
    if not value.flags.aligned:
        raise HqpError(name, "is not aligned to its type in memory", f"pass {name}.copy()")


def _refuse_mask(name: str, value: object) -> None:
    if isinstance(value, np.ma.MaskedArray):
        raise HqpError(name, "is a masked array", f"fill it, {name}.filled(...), or leave masked rows out")


def real_numbers(name: str, value: Any, ndim: int, shape: tuple[int, ...] | None = None) -> Array:
    """Real numbers as C reads them, without NaN and of this shape.

    Raises:
        HqpError: it is something else.
    """
    _refuse_mask(name, value)
    if value is None:
        raise HqpError(name, "is missing", "pass an array of real numbers")
    try:
        given = np.asarray(value)
        if given.dtype.kind not in "biufO":
            raise TypeError(f"its type is {given.dtype}")
        if given.dtype.kind == "O" and any(not isinstance(entry, Real) for entry in given.flat):
            raise TypeError("it holds other objects")
        array = np.ascontiguousarray(given, dtype=np.float64).reshape(given.shape)
    except (TypeError, ValueError, OverflowError) as error:
        mend = f"pass {name}.toarray()" if hasattr(value, "toarray") else "pass a dense array"
        raise HqpError(name, f"is not an array of real numbers: {error}", mend) from error
    if array.ndim != ndim or (shape is not None and array.shape != shape):
        expected = f"must have shape {shape}" if shape else f"must have {ndim} dimension{'s' * (ndim > 1)}"
        raise HqpError(name, f"has shape {array.shape}", f"it {expected}")
    if np.isnan(array).any():
        raise HqpError(name, "has an entry that is NaN", "look where it comes from")
    return array


def check_levels(levels: object) -> None:
    """Check what a function takes for the levels of a problem.

    Raises:
        HqpError: it is no sequence of at least one Level.
    """
    mend = "pass the levels of a problem, a list of Level"
    if not isinstance(levels, Sequence):
        raise HqpError("levels", f"is of type {type(levels).__name__}", mend)
    if not levels:
        raise HqpError("levels", "is empty", mend)
    for level in levels:
        if not isinstance(level, Level):
            raise HqpError("levels", f"has an entry of type {type(level).__name__}", mend)
        if level.n != levels[0].n:
            raise HqpError("levels", f"have {levels[0].n} and {level.n} columns", "they are about one x")


def check_point(x: object, n: int, finite: bool = True) -> None:
    """Check a point of n variables that a function takes to judge it.

    Raises:
        HqpError: it is no array of n numbers, or of n that are `finite`.
    """
    mend = f"pass the x of a solution, an array of shape ({n},)"
    _refuse_mask("x", x)
    if not isinstance(x, np.ndarray) or x.dtype.kind not in "fiu":
        raise HqpError("x", f"is of type {getattr(x, 'dtype', type(x).__name__)}", mend)
    if x.shape != (n,):
        raise HqpError("x", f"has shape {x.shape}", mend)
    if finite and not np.isfinite(x).all():
        raise HqpError("x", "has entries that are not finite", mend)


def _refused(name: str, array: Array) -> NDArray[np.bool_]:
    """Entries of a part of a level that a solver refuses."""
    if name in NO_BOUND:
        refused = ~np.isfinite(array) & (array != NO_BOUND[name])
    elif name == "weights":
        refused = ~((array > 0.0) & (array <= LARGEST))
    else:
        refused = ~(np.abs(array) <= LARGEST)
    return np.asarray(refused)


def check_numbers(levels: Sequence[Level]) -> None:
    """Check for numbers, each by itself, that a solver would refuse.

    Raises:
        HqpError: NaN; an infinite or absurd number that is no bound; a weight of 0 or less; or bounds that
            contradict each other.
    """
    for p, level in enumerate(levels):
        for name in PARTS:
            array = getattr(level, name)
            refused = _refused(name, array)
            if refused.any():
                mend = "give one in (0, 1e100]" if name == "weights" else "look where it comes from"
                raise HqpError(f"{name} of level {p}", f"has the entry {array[refused].flat[0]}", mend)
        lb, ub = 0.5 * level.lb, 0.5 * level.ub  # the difference of the largest two doubles is none
        crossed = np.flatnonzero(lb - ub > CLOSED * (0.5 + np.abs(lb) + np.abs(ub)))
        for row in crossed[:1]:
            problem = f"is {level.lb[row]} in row {row}, more than ub, {level.ub[row]}"
            raise HqpError(f"lb of level {p}", problem, "exchange them, or look where they come from")


def check_tolerance(tolerance: object) -> None:
    """Check how far from a bound a row may be that counts as active.

    Raises:
        HqpError: it is no number in [0, 1).
    """
    if not isinstance(tolerance, Real) or not 0.0 <= float(tolerance) < 1.0:
        raise HqpError("tolerance", f"is {tolerance!r}", "take one from 0 to less than 1")
