"""The optimum of a hierarchy in 90 decimal digits: a judge that knows nothing of the solver, and is slow.

Level by level 1/2 |w|^2 + TINY / 2 |x|^2 is made minimal, w the slacks of the level's rows, by the dual
method of Goldfarb and Idnani (1983). What a level misses then keeps its value, and what it meets holds in all
levels below. A row that a multiplier of 1e-15 holds is held here, where doubles leave it to rounding.
"""

from collections.abc import Sequence
from decimal import Decimal, localcontext

import numpy as np
from hapticd.hqp import Level

DIGITS = 90
TINY = Decimal("1e-30")
DEPENDENT = Decimal("1e-22")  # of a row's length: less than this left of it is none
BROKEN = Decimal("1e-40")  # times length of row (1 + |bound|)
MISSED = Decimal("1e-13")  # times 1 + |value|
POINT = Decimal("1e-9")  # times 1 + |bound|: bounds that differ by less, as by rounding, are one
ZERO, ONE = Decimal(0), Decimal(1)


def optimum(levels: Sequence[Level]) -> tuple[np.ndarray, np.ndarray]:
    """x, and the slack norm of each level, both rounded to double precision.

    Raises:
        ValueError: the method does not end.
    """
    with localcontext() as context:
        context.prec = DIGITS
        n = levels[0].n
        x, norms = np.full(n, ZERO, dtype=object), []
        kept, hard, bounds = [], [], []
        for level in levels:
            rows, lb, ub = _rows(level)
            free = _null_space(kept, n)
            if free.shape[1]:
                x = x + free @ _minimise(rows, lb, ub, x, free, hard, bounds)
            squares = ZERO
            for row, low, high in zip(rows, lb, ub, strict=True):
                value = row @ x
                slack = max(low - value, value - high, ZERO)
                squares += slack * slack
                if low == high or slack > MISSED * (1 + abs(value)):
                    kept.append(row)
                    continue
                hard += [row, -row]
                bounds += [min(low, value), -max(high, value)]
            norms.append(squares.sqrt())
    return x.astype(float), np.array(norms, dtype=float)


def _rows(level: Level) -> tuple[list[np.ndarray], list[Decimal], list[Decimal]]:
    """All rows, each times the root of its weight, and their bounds."""
    weights = level.weights if len(level.weights) else np.ones(sum(level.rows))
    roots = [Decimal(float(weight)).sqrt() for weight in weights]
    matrix, lb, ub = np.vstack([level.A, level.C]), [*level.b, *level.lb], [*level.b, *level.ub]
    rows = [_decimals(row) * root for row, root in zip(matrix, roots, strict=True)]
    low, high = ([Decimal(float(b)) * root for b, root in zip(side, roots, strict=True)] for side in (lb, ub))
    return rows, low, [a if _is_point(a, b) else b for a, b in zip(low, high, strict=True)]


def _is_point(low: Decimal, high: Decimal) -> bool:
    return low.is_finite() and high.is_finite() and high - low <= POINT * (1 + abs(low))


def _decimals(values: np.ndarray) -> np.ndarray:
    return np.array([Decimal(float(value)) for value in values], dtype=object)


def _length(row: np.ndarray) -> Decimal:
    return (row @ row).sqrt()


def _null_space(rows: Sequence[np.ndarray], n: int) -> np.ndarray:
    """(n, k): an orthonormal basis of what the rows leave free, by Gram-Schmidt done twice."""
    units = np.array([[ONE if i == j else ZERO for j in range(n)] for i in range(n)], dtype=object)
    basis: list[np.ndarray] = []
    for of, least in ((rows, DEPENDENT), (units, Decimal("1e-3"))):
        start = len(basis)
        for row in of:
            length = _length(row)
            rest = row / length if length else row
            for _ in range(2):
                for vector in basis:
                    rest = rest - vector * (vector @ rest)
            if _length(rest) > least:
                basis.append(rest / _length(rest))
    return np.array(basis[start:], dtype=object).reshape(-1, n).T


def _minimise(rows, lb, ub, x, free, hard, bounds):
    """The step z, in the basis `free`, to the level's minimum."""
    k, m = free.shape[1], len(rows)
    hessian = np.diag(np.array([TINY] * k + [ONE] * m, dtype=object))
    hessian[hessian == 0] = ZERO
    sides, least = [], []
    none = np.full(m, ZERO, dtype=object)
    for row, bound in zip(hard, bounds, strict=True):
        sides.append(np.concatenate([row @ free, none]))
        least.append(bound - row @ x)
    for i, row in enumerate(rows):
        own = none.copy()
        own[i] = ONE
        along = np.concatenate([row @ free, own])
        sides += [along, -along]
        least += [lb[i] - row @ x, row @ x - ub[i]]
    finite = [i for i, bound in enumerate(least) if bound.is_finite()]
    return _dual_method(hessian, [sides[i] for i in finite], [least[i] for i in finite])[:k]


def _dual_method(hessian, sides, least):
    """argmin 1/2 z H z with sides z >= least, from the minimum without them."""
    z, held, multipliers = np.full(len(hessian), ZERO, dtype=object), [], []
    lengths = [_length(side) for side in sides]
    for _ in range(100 * (1 + len(sides))):
        gaps = [least[i] - sides[i] @ z for i in range(len(sides))]
        open_ones = [
            i
            for i, gap in enumerate(gaps)
            if lengths[i] > DEPENDENT and i not in held and gap > BROKEN * (lengths[i] + abs(least[i]))
        ]
        if not open_ones:
            return z
        worst = max(open_ones, key=lambda i: gaps[i] / lengths[i])
        z, held, multipliers = _hold(hessian, sides, least[worst], worst, z, held, multipliers)
    raise ValueError("the dual method does not end")


def _hold(hessian, sides, bound, row, z, held, multipliers):
    """Bring a broken row to its bound; held rows leave where their multiplier falls to zero."""
    own, n = ZERO, len(z)
    while True:
        size = n + len(held)
        system = np.full((size, size), ZERO, dtype=object)
        system[:n, :n] = hessian
        for j, i in enumerate(held, n):
            system[:n, j] = system[j, :n] = sides[i]
        way = _solved(system, np.concatenate([sides[row], np.full(len(held), ZERO, dtype=object)]))
        step, pull = way[:n], way[n:]
        gain = step @ sides[row]
        moves = gain > DEPENDENT * (sides[row] @ sides[row])
        length = (bound - sides[row] @ z) / gain if moves else Decimal("inf")
        first = None
        for j, share in enumerate(pull):
            if share > 0 and multipliers[j] / share < length:
                length, first = multipliers[j] / share, j
        if not length.is_finite():
            raise ValueError("rows that hold cannot be met")
        if moves:
            z = z + length * step
        own += length
        multipliers = [m - length * share for m, share in zip(multipliers, pull, strict=True)]
        if first is None:
            return z, [*held, row], [*multipliers, own]
        held, multipliers = held[:first] + held[first + 1 :], multipliers[:first] + multipliers[first + 1 :]


def _solved(matrix, rhs):
    """Gaussian elimination with partial pivoting."""
    matrix, x, n = matrix.copy(), rhs.copy(), len(rhs)
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(matrix[i, k]))
        matrix[[k, pivot]], x[[k, pivot]] = matrix[[pivot, k]], x[[pivot, k]]
        for i in range(k + 1, n):
            if matrix[i, k]:
                factor = matrix[i, k] / matrix[k, k]
                matrix[i, k:] = matrix[i, k:] - factor * matrix[k, k:]
                x[i] -= factor * x[k]
    for k in reversed(range(n)):
        x[k] = (x[k] - (matrix[k, k + 1 :] @ x[k + 1 :] if k < n - 1 else ZERO)) / matrix[k, k]
    return x
