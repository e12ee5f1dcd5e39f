"""Random quadratic programs of nasty kinds."""

import numpy as np

from .problem import Array

INF = np.inf
KINDS = ("plain", "singular", "linear", "scaled", "doubled", "degenerate", "equal", "boxed", "free", "near")
Qp = dict[str, Array]
"""Arguments of solve_qp by name."""


def qp_of(kind: str, seed: int) -> Qp:
    """A feasible QP with an optimum, of 1 to 24 variables.

    Args:
        kind: of KINDS: P singular, zero or nearly singular, units far apart, rows twice, many rows through
            one vertex, equalities alone, a box alone, nothing at all.
        seed: which of them.
    """
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
        G, A, x = np.round(G), np.round(A), np.round(x)
    if kind == "doubled":
        A = np.vstack([A, 2.0 * A, A[:1] + A[-1:]])
        G = np.vstack([G, -0.5 * G, A[:2], G[:3] * (1.0 + 1e-9)])
    tight = rng.random(len(G)) < (0.9 if kind == "degenerate" else 0.3)
    h = G @ x + np.where(tight, 0.0, rng.exponential(size=len(G)))
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
    return _scaled(qp, rng) if kind == "scaled" else qp


def infeasible_qp(seed: int) -> Qp:
    """A QP some rows of which contradict each other: with positive weights they add up to 0 x < 0."""
    rng = np.random.default_rng([len(KINDS), seed])
    qp = qp_of("plain", seed)
    n, k = len(qp["q"]), int(rng.integers(1, 4))
    clash = rng.normal(size=(k, n))
    last = -rng.uniform(0.2, 2.0, size=k) @ clash
    point = rng.normal(size=n)
    h = np.append(clash @ point, last @ point - rng.uniform(0.1, 2.0))
    return {**qp, "G": np.vstack([qp["G"], clash, last]), "h": np.concatenate([qp["h"], h])}


def unbounded_qp(seed: int) -> Qp:
    """A QP with a direction d: P d = 0, q d < 0, and no constraint ends it."""
    rng = np.random.default_rng([len(KINDS) + 1, seed])
    n = int(rng.integers(1, 15))
    d = rng.normal(size=n)
    d /= np.linalg.norm(d)
    root = rng.normal(size=(int(rng.integers(0, n + 1)), n))
    root -= np.outer(root @ d, d)
    G = rng.normal(size=(int(rng.integers(0, 2 * n)), n))
    G -= np.outer(np.maximum(G @ d, 0.0) * rng.uniform(1.0, 2.0), d)
    A = rng.normal(size=(int(rng.integers(0, n // 2 + 1)), n))
    A -= np.outer(A @ d, d)
    x, q = rng.normal(size=n), rng.normal(size=n)
    q -= (q @ d + rng.uniform(0.1, 1.0)) * d
    lb, ub = np.where(d >= 0.0, x - 1.0, -INF), np.where(d <= 0.0, x + 1.0, INF)
    return {"P": root.T @ root, "q": q, "G": G, "h": G @ x + 0.1, "A": A, "b": A @ x, "lb": lb, "ub": ub}


def fit_qp(seed: int) -> Qp:
    """A fit of few data of two decimals by as many coefficients or more: P sees only some of its variables.

    The loss is Huber's, the one of quantiles, a hinge, or the square of what exceeds a tolerance; it is never
    below 0, so it has a minimum.
    """
    rng = np.random.default_rng([len(KINDS) + 2, seed])
    loss = rng.choice(["huber", "quantile", "hinge", "tolerant"])
    m = int(rng.integers(2, 7))
    X, y = rng.normal(size=(m, m + int(rng.integers(0, 4)))).round(2), rng.normal(size=m).round(2)
    k, own = X.shape[1], np.eye(m)
    bend, weight, slack = np.zeros(k), np.zeros(k), np.full(k, -INF)
    if loss == "huber":  # |X c - y| <= a + e, a <= 1: a^2 + 2 e
        G, h = np.block([[X, -own, -own], [-X, -own, -own]]), np.append(y, -y)
        bend, weight = np.append(bend, [2.0] * m + [0.0] * m), np.append(weight, [0.0] * m + [2.0] * m)
        slack = np.append(slack, np.zeros(2 * m))
        ub = np.concatenate([np.full(k, INF), np.ones(m), np.full(m, INF)])
        return {"P": np.diag(bend), "q": weight, "G": G, "h": h, "lb": slack, "ub": ub}
    if loss == "quantile":  # X c + e - d = y: .3 e + .7 d
        A = np.block([[X, own, -own]])
        weight, slack = np.append(weight, [0.3] * m + [0.7] * m), np.append(slack, np.zeros(2 * m))
        return {"P": np.zeros((k + 2 * m,) * 2), "q": weight, "A": A, "b": y, "lb": slack}
    slack = np.append(slack, np.zeros(m))
    if loss == "tolerant":  # |X c - y| <= .1 + e: e^2 / 2
        G, h = np.block([[X, -own], [-X, -own]]), np.append(y, -y) + 0.1
        return {"P": np.diag(np.append(bend, np.ones(m))), "q": np.zeros(k + m), "G": G, "h": h, "lb": slack}
    sign = np.where(y > 0.0, 1.0, -1.0)  # sign X c >= 1 - e: c' c / 2, or a little of it or none, + cost e
    G = np.hstack([-sign[:, None] * X, -own])
    bend[:-1] = rng.choice([0.0, 1e-6, 1.0])
    cost = np.append(weight, np.full(m, rng.choice([1.0, 100.0])))
    return {"P": np.diag(np.append(bend, np.zeros(m))), "q": cost, "G": G, "h": np.full(m, -1.0), "lb": slack}


def curve_qp(seed: int) -> Qp:
    """A cubic spline through few points that grows, convex, then concave; P hardly sees some coefficients."""
    rng = np.random.default_rng([len(KINDS) + 3, seed])
    n = int(rng.integers(5, 22))
    at = rng.random(int(rng.integers(n // 2, 3 * n))) * (n - 1)
    away = np.abs(at[:, None] - np.arange(n))
    near, far = 2.0 / 3.0 - away**2 + away**3 / 2.0, (2.0 - away) ** 3 / 6.0
    X = np.where(away < 1.0, near, np.where(away < 2.0, far, 0.0))
    y = np.tanh(4.0 * at / (n - 1) - 2.0) + 0.1 * rng.normal(size=len(at))
    grows, bends = np.diff(np.eye(n), axis=0), np.diff(np.eye(n), n=2, axis=0)
    G = np.vstack([-grows, -bends[: n // 2], bends[n // 2 :]])
    return {"P": X.T @ X, "q": -X.T @ y, "G": G, "h": np.zeros(len(G))}


def _scaled(qp: Qp, rng: np.random.Generator) -> Qp:
    """The QP in other units: variables and rows by factors of 1e-3 to 1e3 each."""
    unit, of_A, of_G = (10.0 ** rng.uniform(-3, 3, len(qp[name])) for name in ("q", "b", "h"))
    return _in_units(qp, unit, of_A, of_G, 1.0)


def _in_units(qp: Qp, unit: Array, of_A: Array, of_G: Array, weight: float) -> Qp:
    P = weight * unit[:, None] * qp["P"] * unit
    return {
        "P": (P + P.T) / 2.0,
        "q": weight * unit * qp["q"],
        "G": of_G[:, None] * qp["G"] * unit,
        "h": of_G * qp["h"],
        "A": of_A[:, None] * qp["A"] * unit,
        "b": of_A * qp["b"],
        "lb": qp["lb"] / unit,
        "ub": qp["ub"] / unit,
    }


def rough_qp(seed: int) -> tuple[Qp, bool]:
    """A QP of 1 to 12 variables for the worst of circumstances, and whether it surely has a feasible x.

    P of any rank and of eigenvalues down to 1e-14, or none; q in its range or not; rows twice, opposite to
    each other, nearly parallel, of zeros; fixed variables; contradictions by 1e-9 to 100; units of variables,
    rows and objective over many orders of magnitude.
    """
    rng = np.random.default_rng([77, seed])
    n = int(rng.integers(1, 13))
    P = _rough_objective(rng, n)
    q = rng.normal(size=n) * rng.choice([0.0, 1.0, 1.0, 1e3, 1e-3])
    if rng.random() < 0.4:
        q = P @ rng.normal(size=n) * 10.0 ** rng.uniform(-2, 2)
    x = rng.normal(size=n)
    if rng.random() < 0.3:
        x = np.round(x)
    A, G = _rough_rows(rng, n)
    tight = rng.random(len(G)) < rng.choice([0.1, 0.5, 0.95])
    h, b = G @ x + np.where(tight, 0.0, rng.exponential(size=len(G))), A @ x
    lb, ub = _rough_box(rng, x)
    is_feasible = bool(rng.random() < 0.85)
    if not is_feasible:
        where = rng.choice(["h", "b", "box", "zeros"])
        if where == "h" and len(h):
            h[rng.integers(len(h))] -= 10.0 ** rng.uniform(-9, 2)
        elif where == "b" and len(b):
            b[rng.integers(len(b))] += 10.0 ** rng.uniform(-9, 2)
        elif where == "box":
            lb = np.where(rng.random(n) < 0.3, np.where(np.isfinite(ub), ub, x) - rng.exponential(size=n), lb)
        else:
            G, h = (
                np.vstack([G, np.zeros(n)]),
                np.append(h, rng.choice([0.0, 1.0, -1.0, -1.5e-7, -1e-12, 1e-9])),
            )
    qp = {"P": P, "q": q, "G": G, "h": h, "A": A, "b": b, "lb": lb, "ub": ub}
    return (_in_other_units(qp, rng) if rng.random() < 0.5 else qp), is_feasible


def _rough_objective(rng: np.random.Generator, n: int) -> Array:
    kind = rng.choice(["dense", "spectrum", "rank", "none", "diagonal", "whole", "kernel"])
    if kind == "none":
        return np.zeros((n, n))
    if kind == "diagonal":
        return np.diag(rng.choice([0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3], n))
    if kind == "kernel":
        at = rng.uniform(-1.0, 1.0, n)
        return np.asarray(np.exp(-((at[:, None] - at) ** 2) * 10.0 ** rng.uniform(-2, 2)))
    if kind == "spectrum":
        basis = np.linalg.qr(rng.normal(size=(n, n)))[0]
        P = (basis * 10.0 ** rng.uniform(-14, 0, n)) @ basis.T
        return np.asarray((P + P.T) / 2.0)
    rows = n if kind == "dense" else int(rng.integers(0, n + 1))
    root = (
        rng.integers(-2, 3, size=(rows, n)).astype(float) if kind == "whole" else rng.normal(size=(rows, n))
    )
    return np.asarray(root.T @ root)


def _rough_rows(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    equalities, inequalities = int(rng.integers(0, n // 2 + 1)), int(rng.integers(0, 3 * n + 1))
    A, G = rng.normal(size=(equalities, n)), rng.normal(size=(inequalities, n))
    if rng.random() < 0.3:
        A, G = np.round(A), np.round(G)
    half = len(G) // 2
    if rng.random() < 0.2 and half:
        G[:half] = -G[half : 2 * half]
    if rng.random() < 0.2 and len(A):
        A = np.vstack([A, A[:1] * rng.choice([-2.0, 1.0, 1.0 + 1e-9, 1e-3])])
    if rng.random() < 0.2 and len(G):
        angle = rng.choice([0.0, 1e-12, 1e-8, 1e-5])
        G = np.vstack([G, G[:1] * (1.0 + angle * rng.normal(size=n))])
    return A, G


def _rough_box(rng: np.random.Generator, x: Array) -> tuple[Array, Array]:
    n, share = len(x), rng.choice([0.0, 0.5, 0.7, 1.0])
    lb, ub = (
        np.where(
            rng.random(n) < share, x + sign * rng.exponential(size=n) * (rng.random(n) < 0.7), sign * INF
        )
        for sign in (-1.0, 1.0)
    )
    fixed = rng.random(n) < 0.3 * (share == 0.7)
    lb[fixed] = ub[fixed] = x[fixed]
    return lb, ub


def _in_other_units(qp: Qp, rng: np.random.Generator) -> Qp:
    n = len(qp["q"])
    alike = np.full(n, 10.0 ** rng.uniform(-5, 5))
    unit = 10.0 ** rng.uniform(-3, 3, n) if rng.random() < 0.5 else alike
    weight = 10.0 ** rng.uniform(-7, 7)
    of_A, of_G = (10.0 ** rng.uniform(-4, 4, len(qp[name])) for name in ("b", "h"))
    return _in_units(qp, unit, of_A, of_G, weight)
