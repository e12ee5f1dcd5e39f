"""Random quadratic programs of nasty kinds, and what an answer to them must meet."""

import numpy as np

INF = np.inf
KINDS = (
    "plain",
    "singular",
    "linear",
    "scaled",
    "doubled",
    "degenerate",
    "equal",
    "boxed",
    "free",
    "near",
)


def qp_of(kind, seed):
    """A feasible QP with an optimum, as arguments of solve_qp by name."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    n = int(rng.integers(1, 25))
    rank = {"singular": int(rng.integers(0, n + 1)), "linear": 0, "near": max(1, n // 2)}.get(kind, n)
    root = rng.normal(size=(rank, n))
    P = root.T @ root + (np.diag(10.0 ** rng.uniform(-9, -5, n)) if kind == "near" else 0.0)
    x = rng.normal(size=n)
    equalities = 0 if kind in ("boxed", "free") else int(rng.integers(0, n // 2 + 1))
    inequalities = 0 if kind in ("equal", "boxed", "free") else int(rng.integers(0, 3 * n + 1))
    A, G = rng.normal(size=(equalities, n)), rng.normal(size=(inequalities, n))
    if kind == "degenerate":
        G, A = np.round(G), np.round(A)
        x = np.round(x)
    if kind == "doubled":
        A = np.vstack([A, 2.0 * A, A[:1] + A[-1:]])
        G = np.vstack([G, -0.5 * G, A[:2], G[:3] * (1.0 + 1e-9)])
    slack = np.where(rng.random(len(G)) < (0.9 if kind == "degenerate" else 0.3), 0.0, rng.exponential(size=len(G)))
    h = G @ x + slack
    h[rng.random(len(h)) < 0.05] = INF
    lb = x - rng.exponential(2.0, size=n) * (rng.random(n) < 0.8)
    ub = x + rng.exponential(2.0, size=n) * (rng.random(n) < 0.8)
    if kind in ("plain", "boxed", "doubled", "scaled", "degenerate"):
        lb[rng.random(n) < 0.4], ub[rng.random(n) < 0.4] = -INF, INF
    qp = {"P": P, "q": 3.0 * rng.normal(size=n), "G": G, "h": h, "A": A, "b": A @ x, "lb": lb, "ub": ub}
    if kind in ("free", "equal"):
        del qp["lb"], qp["ub"]
    if kind == "free":
        del qp["G"], qp["h"], qp["A"], qp["b"]
    return scaled(qp, rng) if kind == "scaled" else qp


def scaled(qp, rng):
    """The QP in other units: rows and variables by factors of 1e-3 to 1e3 each."""
    n = len(qp["q"])
    unit, of_A, of_G = (10.0 ** rng.uniform(-3, 3, size) for size in (n, len(qp["b"]), len(qp["h"])))
    return {
        "P": unit[:, None] * qp["P"] * unit,
        "q": unit * qp["q"],
        "G": of_G[:, None] * qp["G"] * unit,
        "h": of_G * qp["h"],
        "A": of_A[:, None] * qp["A"] * unit,
        "b": of_A * qp["b"],
        "lb": qp["lb"] / unit,
        "ub": qp["ub"] / unit,
    }


def parts_of(qp):
    """P, q, G, h, A, b, lb, ub with nothing absent."""
    n = len(qp["q"])
    absent = {
        "G": np.empty((0, n)),
        "h": np.empty(0),
        "A": np.empty((0, n)),
        "b": np.empty(0),
        "lb": np.full(n, -INF),
        "ub": np.full(n, INF),
    }
    return [np.asarray({**absent, **qp}[name], dtype=float) for name in ("P", "q", "G", "h", "A", "b", "lb", "ub")]


def faults(qp, found):
    """The worst of each condition of Karush, Kuhn and Tucker, in parts of the terms that it sums.

    A row counts by its terms, too: |row| |x| and its bound.
    """
    P, q, G, h, A, b, lb, ub = parts_of(qp)
    x, y, z, box = found.x, found.y, found.z, found.z_box
    terms = np.abs(q) + np.abs(P) @ np.abs(x) + np.abs(A.T) @ np.abs(y) + np.abs(G.T) @ z + np.abs(box)
    gradient = P @ x + q + A.T @ y + G.T @ z + box
    above, below = np.where(ub < INF, x - ub, -INF), np.where(lb > -INF, lb - x, -INF)
    over = np.where(h < INF, G @ x - h, -INF)
    size_A, size_G = row_size(A, x, b), row_size(G, x, h)
    size_box = 1.0 + np.abs(x)
    reach = np.where(box > 0.0, above, np.where(box < 0.0, below, 0.0))
    return {
        "stationary": largest(np.abs(gradient) / (terms + 1e-4 * terms.max(initial=0.0) + 1e-300)),
        "A": largest(np.abs(A @ x - b) / size_A),
        "G": largest(over / size_G),
        "box": max(largest(above / size_box), largest(below / size_box)),
        "sign": largest(-z),
        "slack": largest(np.abs(np.where(z > 0.0, over, 0.0)) / size_G),
        "box slack": largest(np.abs(reach) / size_box),
    }


def row_size(rows, x, bound):
    norm = np.linalg.norm(rows, axis=1)
    return np.minimum(norm, 1.0) + np.where(np.isfinite(bound), np.abs(bound), 0.0) + norm * np.linalg.norm(x)*1e-3 + 1e-300


def largest(values):
    return float(np.max(values, initial=0.0))
