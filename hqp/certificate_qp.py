"""What solve_qp says of a quadratic program, judged by the program's data alone."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .problem import Array
from .qp_solution import QpSolution


def parts_of(qp: Mapping[str, Any]) -> list[Array]:
    """P, q, G, h, A, b, lb, ub with nothing absent."""
    n = len(qp["q"])
    rows, none = np.empty((0, n)), np.empty(0)
    absent = {
        **{"G": rows, "h": none, "A": rows, "b": none},
        **{"lb": np.full(n, -np.inf), "ub": np.full(n, np.inf)},
    }
    return [np.asarray({**absent, **qp}[name], dtype=float) for name in ("P", "q", *absent)]


def faults(qp: Mapping[str, Any], found: QpSolution) -> dict[str, float]:
    """The worst by which each condition of Karush, Kuhn and Tucker is missed, relative to its parts."""
    P, q, G, h, A, b, lb, ub = parts_of(qp)
    x, y, z, box = found.x, found.y, found.z, found.z_box
    bent, pulled = P @ x, A.T @ y + G.T @ z + box
    terms = np.abs(P) @ np.abs(x) + np.abs(A).T @ np.abs(y) + np.abs(G).T @ np.abs(z)  # rounded one by one
    parts = np.abs(bent) + np.abs(q) + np.abs(pulled)
    parts += 1e-6 * parts.max(initial=0.0) + 1e-7 * terms
    over, size_A, size_G, size_box = G @ x - h, _size(A, x, b), _size(G, x, h), 1.0 + np.abs(x)
    reach = np.where(box > 0.0, x - ub, np.where(box < 0.0, lb - x, 0.0))
    return {
        "gradient": _most(np.abs(bent + q + pulled), parts),
        "A": _most(np.abs(A @ x - b), size_A),
        "G": _most(over, size_G),
        "box": max(_most(x - ub, size_box), _most(lb - x, size_box)),
        "sign": _most(-z, 1.0),
        "slack of G": _most(np.abs(np.where(z > 0.0, over, 0.0)), size_G),
        "slack of the box": _most(np.abs(reach), size_box),
    }


def contradiction(qp: Mapping[str, Any], conflict: Sequence[tuple[str, int, float]]) -> tuple[float, float]:
    """What is left of the rows of a conflict, over the largest of them, and what their bounds come to.

    Of a conflict nothing is left, and the bounds come to less than 0; infinite where a sign is wrong.
    """
    _, _, G, h, A, b, lb, ub = parts_of(qp)
    n = len(lb)
    total, largest, bound = np.zeros(n), 0.0, 0.0
    for part, row, weight in conflict:
        if part == "G" and weight < 0.0:
            return np.inf, np.inf
        pulled = weight * {"A": A, "G": G, "box": np.eye(n)}[part][row]
        total, largest = total + pulled, max(largest, float(np.abs(pulled).max()))
        bound += weight * float({"A": b, "G": h, "box": ub if weight > 0.0 else lb}[part][row])
    return _most(np.abs(total), largest), bound


def ray_faults(qp: Mapping[str, Any], ray: Array) -> dict[str, float]:
    """By how much a ray fails to be one along which the objective falls for ever; its slope is to be < 0."""
    P, q, G, h, A, _, lb, ub = parts_of(qp)
    acts = np.isfinite(h)
    bent, most_bent = np.abs(P @ ray), (np.abs(P) @ np.abs(ray)).max() + 1e-3 * np.abs(P).max()
    return {
        "slope": float(q @ ray),
        "P": _most(bent, most_bent),
        "A": _most(np.abs(A @ ray), np.linalg.norm(A, axis=1)),
        "G": _most((G @ ray)[acts], np.linalg.norm(G, axis=1)[acts]),
        "box": max(_most(ray[np.isfinite(ub)], 1.0), _most(-ray[np.isfinite(lb)], 1.0)),
    }


def _size(rows: Array, x: Array, bound: Array) -> Array:
    norm = np.linalg.norm(rows, axis=1)
    own = np.where(norm > 0.0, np.minimum(norm, 1.0), 1.0)
    finite = np.where(np.isfinite(bound), np.abs(bound), 0.0)
    return np.asarray(own + finite + 1e-3 * np.abs(rows) @ np.abs(x))


def _most(values: Array, sizes: Array | float) -> float:
    return float(np.max(values / (np.asarray(sizes) + 1e-290), initial=0.0))
