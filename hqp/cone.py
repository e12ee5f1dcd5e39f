"""How far a vector is from a cone, with more than double precision where the machine has that.

Multipliers of 1e9 and more leave the rounding of all that they pull at: in doubles a distance of nothing
comes out as 1e-4.
"""

import numpy as np
from numpy.typing import NDArray

Extended = NDArray[np.longdouble]

INDEPENDENT = 1e-9
"""Part of a row that is left without the ones before; less is none."""
SLIGHT = 1e-12
"""Times the distance: a pull that brings nothing nearer."""
ROUNDING = 100.0 * np.finfo(np.longdouble).eps
"""Times the length of what is added up: that is none of it."""


def distance(target: NDArray[np.float64], free: NDArray[np.float64], cone: NDArray[np.float64]) -> float:
    """Distance of the target from {free^T y + cone^T z: z >= 0}, by the method of Lawson and Hanson.

    It is that of multipliers that were found, so it is never less than the true one but for rounding.

    Args:
        target: (n,).
        free: rows of length 1, (free rows, n).
        cone: the same, (cone rows, n).
    """
    basis = _basis(free.astype(np.longdouble))
    rest = _without(target.astype(np.longdouble)[None], basis)[0]
    rows = _without(cone.astype(np.longdouble), basis)
    lengths = _lengths(rows)
    clear = lengths > INDEPENDENT
    return _non_negative(rest, rows[clear] / lengths[clear, None])


def _lengths(rows: Extended) -> Extended:
    return np.asarray(np.sqrt(np.sum(rows * rows, axis=1)))


def _without(rows: Extended, basis: Extended) -> Extended:
    """The rows without what lies in the span of the basis."""
    for _ in range(2):  # of a row a billionth may be left, and once leaves the rounding of all of it
        rows = rows - (rows @ basis.T) @ basis
    return rows


def _basis(rows: Extended) -> Extended:
    """Orthonormal rows with the span of these, the clearest first."""
    basis = np.zeros((0, rows.shape[1]), dtype=np.longdouble)
    rest, left = rows, _lengths(rows)
    while len(rest) and left.max() > INDEPENDENT:
        clearest = rest[[int(np.argmax(left))]]
        clearest = _without(clearest, basis)
        basis = np.vstack([basis, clearest / _lengths(clearest)[:, None]])
        rest = rest - np.outer(rest @ basis[-1], basis[-1])
        left = _lengths(rest)
    return basis


def _multipliers(rows: Extended, target: Extended) -> Extended:
    """Those of the least |target - rows^T z|, 0 of a row that depends on those before it."""
    count = len(rows)
    basis, triangle = np.zeros_like(rows), np.zeros((count, count), dtype=np.longdouble)
    for i, row in enumerate(rows):
        left = _without(row[None], basis[:i])[0]
        triangle[:i, i] = basis[:i] @ row
        length = np.sqrt(left @ left)
        if length > ROUNDING:
            triangle[i, i], basis[i] = length, left / length
        else:
            triangle[i, i] = 1.0  # and its multiplier 0
    z = basis @ target
    for i in reversed(range(count)):
        z[i] = (z[i] - triangle[i, i + 1 :] @ z[i + 1 :]) / triangle[i, i]
    return np.asarray(z)


def _non_negative(target: Extended, rows: Extended) -> float:
    """The least |target - rows^T z| with z >= 0."""
    held: list[int] = []
    z, rest = np.zeros(0, dtype=np.longdouble), target
    barred: set[int] = set()
    nothing = ROUNDING * np.sqrt(target @ target)
    for _ in range(3 * len(rows)):
        pull = rows @ rest
        pull[[*held, *barred]] = 0.0
        add = int(np.argmax(pull))
        if not pull[add] > max(SLIGHT * np.sqrt(rest @ rest), nothing):
            break
        now, of_now = _step([*held, add], np.append(z, np.longdouble(0.0)), rows, target)
        left = target - of_now @ rows[now]
        if left @ left < rest @ rest:
            held, z, rest = now, of_now, left
            barred.clear()
        else:
            barred.add(add)
    return float(np.sqrt(rest @ rest))


def _step(held: list[int], z: Extended, rows: Extended, target: Extended) -> tuple[list[int], Extended]:
    """Towards the least with these rows held, without those whose multiplier turns negative on the way."""
    while held:
        wanted = _multipliers(rows[held], target)
        if wanted.min() >= 0.0:
            return held, wanted
        falling = np.flatnonzero(wanted < 0.0)
        shares = z[falling] / (z[falling] - wanted[falling])
        out, share = int(falling[np.argmin(shares)]), shares.min()
        z = np.delete(z + share * (wanted - z), out)
        held = held[:out] + held[out + 1 :]
    return held, z
