"""The data of a quadratic program, looked at: what they are as arrays, or what is wrong with them."""

from numbers import Real
from operator import index
from typing import Any, NamedTuple

import numpy as np

from ._qp import NOT_CONVEX, NOT_SYMMETRIC
from .problem import Array, HqpError, real_numbers

MOST = 1e100  # in size, of any number but an infinite bound
MOST_VARIABLES, MOST_ROWS = 1024, 8192


class QpData(NamedTuple):
    """A QP as arrays, with nothing absent but perhaps the box and the start.

    Attributes:
        P: (n, n); q: (n,); G: (m, n); h: (m,); A: (k, n); b: (k,).
        lb: (n,), or None; ub: the same.
        initvals: the same.
    """

    P: Array
    q: Array
    G: Array
    h: Array
    A: Array
    b: Array
    lb: Array | None
    ub: Array | None
    initvals: Array | None


def checked(
    P: Any,
    q: Any,
    G: Any,
    h: Any,
    A: Any,
    b: Any,
    lb: Any,
    ub: Any,
    initvals: Any,
    max_iterations: Any,
    time_limit: Any,
) -> QpData:
    """The arguments of solve_qp as arrays.

    Raises:
        HqpError: something among them that solve_qp does not take.
    """
    _check_limits(max_iterations, time_limit)
    q = _finite("q", real_numbers("q", q, 1))
    n = len(q)
    if not 1 <= n <= MOST_VARIABLES:
        raise HqpError("q", f"has {n} entries", f"a QP has 1 to {MOST_VARIABLES} variables")
    P = _finite("P", real_numbers("P", P, 2, (n, n)))
    G, h = _pair("Gh", G, h, n)
    A, b = _pair("Ab", A, b, n)
    if len(G) + len(A) > MOST_ROWS:
        raise HqpError("G and A", f"have {len(G) + len(A)} rows", f"{MOST_ROWS} is the most")
    for name, rows in (("G", G), ("A", A), ("b", b)):
        _finite(name, rows)
    bounds = {
        name: None if v is None else real_numbers(name, v, 1, (n,)) for name, v in (("lb", lb), ("ub", ub))
    }
    for name, bound, none in (("h", h, np.inf), ("lb", bounds["lb"], -np.inf), ("ub", bounds["ub"], np.inf)):
        if bound is not None and (bound == -none).any():
            raise HqpError(name, f"has an entry that is {-none:g}: no x meets it", f"{none:g} is no bound")
        if bound is not None:
            _finite(name, bound[bound != none])
    start = None if initvals is None else _finite("initvals", real_numbers("initvals", initvals, 1, (n,)))
    return QpData(P, q, G, h, A, b, bounds["lb"], bounds["ub"], start)


def _check_limits(max_iterations: Any, time_limit: Any) -> None:
    try:
        is_good = 0 <= index(max_iterations) <= np.iinfo(np.int32).max
    except TypeError:
        is_good = False
    if not is_good:
        most = np.iinfo(np.int32).max
        raise HqpError(
            "max_iterations", f"is {max_iterations!r}", f"pass a whole number up to {most}; 0: automatic"
        )
    try:
        is_good = isinstance(time_limit, Real) and float(time_limit) >= 0.0
    except OverflowError as error:
        raise HqpError("time_limit", f"is no number of seconds: {error}", "0: none") from error
    if not is_good:
        raise HqpError("time_limit", f"is {time_limit!r}", "pass seconds; 0: none")


def refuse(ends: int, P: Array) -> HqpError:
    """Why a QP of checked data is not solved."""
    if ends == NOT_SYMMETRIC:
        return HqpError("P", "is not symmetric", "pass (P + P.T) / 2, which has the same objective")
    if ends == NOT_CONVEX:
        least = float(np.linalg.eigvalsh(P)[0])
        why = f"has the eigenvalue {least:.1e}: it is not positive semidefinite"
        return HqpError("P", why, "the QP is not convex, and this solver is for convex ones")
    return HqpError("the QP", f"has numbers too small to be squared or too large (status {ends})", "scale it")


def _finite(name: str, array: Array) -> Array:
    if not (np.abs(array) <= MOST).all():
        raise HqpError(name, f"has an entry that is infinite or beyond {MOST:g}", "scale it")
    return array


def _pair(names: str, matrix: Any, vector: Any, n: int) -> tuple[Array, Array]:
    """Rows and their bounds; none of either where both are None."""
    if matrix is None and vector is None:
        return np.empty((0, n)), np.empty(0)
    if matrix is None or vector is None:
        raise HqpError(" and ".join(names), "are given one without the other", "give both or none")
    rows = real_numbers(names[0], matrix, 2)
    if rows.shape[1] != n:
        raise HqpError(names[0], f"has {rows.shape[1]} columns and q has {n} entries", "one per variable")
    return rows, real_numbers(names[1], vector, 1, (len(rows),))
