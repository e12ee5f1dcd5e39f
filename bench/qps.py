"""Times QP solvers on suites of QPs in files, such as those that the project qpsolvers publishes.

A suite is a folder, searched for .npz files with P, q, G, h, A, b, lb and ub, and for .mat files with P, q,
A, l and u.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..hqp import HqpError, UnboundedError, solve_qp
from .figures import progress
from .recorded import BenchError

Array = NDArray[np.float64]
LARGEST = 300
"""Variables of a QP that is taken."""
INFINITE = 1e20
AGREES = 1e-6
"""Times 1 + |objective|: how far from the best objective an answer may be."""
MET = 1e-6
"""Times 1 + |bound|: how far a constraint may be missed."""


class Qp(NamedTuple):
    """Minimise 1/2 x^T P x + q^T x with lower <= rows x <= upper."""

    name: str
    P: Array
    q: Array
    rows: Array
    lower: Array
    upper: Array


class Found(NamedTuple):
    """Seconds, and x; no x: the solver gave up, or refused the QP as none that it is for."""

    seconds: float
    x: Array | None
    refused: bool = False


def hapticd(qp: Qp) -> Found:
    """Ours: the whole call."""
    equal, below, above = qp.lower == qp.upper, np.isfinite(qp.lower), np.isfinite(qp.upper)
    below, above = below & ~equal, above & ~equal
    G = np.vstack([qp.rows[above], -qp.rows[below]])
    h = np.concatenate([qp.upper[above], -qp.lower[below]])
    A, b = qp.rows[equal], qp.lower[equal]
    start = time.perf_counter()
    try:
        found = solve_qp(qp.P, qp.q, G, h, A, b)
    except HqpError as error:
        return Found(time.perf_counter() - start, None, not isinstance(error, UnboundedError))
    return Found(time.perf_counter() - start, found.x if found.found else None)


def daqp(qp: Qp) -> Found:
    """DAQP, by its own count of its time."""
    import daqp

    upper, lower = np.minimum(qp.upper, 1e30), np.maximum(qp.lower, -1e30)
    sense = np.where(qp.lower == qp.upper, 5, 0).astype(np.intc)
    x, _, flag, info = daqp.solve(qp.P, qp.q, qp.rows, upper, lower, sense)
    return Found(info["setup_time"] + info["solve_time"], np.asarray(x) if flag > 0 else None)


def quadprog(qp: Qp) -> Found:
    """quadprog, where P is positive definite."""
    import quadprog

    equal, below, above = qp.lower == qp.upper, np.isfinite(qp.lower), np.isfinite(qp.upper)
    below, above = below & ~equal, above & ~equal
    rows = np.vstack([qp.rows[equal], qp.rows[below], -qp.rows[above]])
    least = np.concatenate([qp.lower[equal], qp.lower[below], -qp.upper[above]])
    start = time.perf_counter()
    try:
        x = quadprog.solve_qp(qp.P, -qp.q, np.ascontiguousarray(rows.T), least, int(equal.sum()))[0]
    except ValueError:
        return Found(time.perf_counter() - start, None)
    return Found(time.perf_counter() - start, np.asarray(x))


SOLVERS: dict[str, Callable[[Qp], Found]] = {"hapticd": hapticd, "daqp": daqp, "quadprog": quadprog}


def load(folder: Path) -> Iterator[Qp]:
    """The QPs of a folder, by name, of up to LARGEST variables.

    Raises:
        BenchError: no such folder, or no file of these kinds in it.
    """
    paths = sorted(path for path in folder.rglob("*") if path.suffix in (".npz", ".mat"))
    if not paths:
        raise BenchError(f"{folder} has no .npz or .mat file with a QP; clone a suite and name its folder")
    for path in paths:
        qp = _npz(path) if path.suffix == ".npz" else _mat(path)
        if qp and len(qp.q) <= LARGEST:
            yield qp


def _npz(path: Path) -> Qp | None:
    parts = {}
    with np.load(path, allow_pickle=False) as data:
        for name in data.files:
            try:
                parts[name] = np.array(data[name], dtype=float)
            except ValueError:  # a None, which only a pickle can hold: absent
                continue
    if not {"P", "q"} <= set(parts):
        return None
    n = len(parts["q"])
    rows, lower, upper = [np.empty((0, n))], [np.empty(0)], [np.empty(0)]
    for matrix, below, above in (("G", None, "h"), ("A", "b", "b"), (None, "lb", "ub")):
        if not {matrix, below, above} & set(parts):
            continue
        rows.append(np.eye(n) if matrix is None else parts[matrix])
        lower.append(parts.get(below or "", np.full(len(rows[-1]), -np.inf)))
        upper.append(parts.get(above, np.full(len(rows[-1]), np.inf)))
    return _qp(path, parts["P"], parts["q"], np.vstack(rows), np.concatenate(lower), np.concatenate(upper))


def _mat(path: Path) -> Qp | None:
    from scipy.io import loadmat

    data = loadmat(path)
    if not {"P", "q", "A", "l", "u"} <= set(data) or data["P"].shape[0] > LARGEST:
        return None
    dense = (
        np.asarray(part.toarray() if hasattr(part, "toarray") else part) for part in (data["P"], data["A"])
    )
    P, A = dense
    return _qp(path, P, data["q"].ravel(), A, data["l"].ravel(), data["u"].ravel())


def _qp(path: Path, P: Array, q: Array, rows: Array, lower: Array, upper: Array) -> Qp:
    lower = np.where(lower < -INFINITE / 2, -np.inf, lower).astype(float)
    upper = np.where(upper > INFINITE / 2, np.inf, upper).astype(float)
    symmetric = np.ascontiguousarray(0.5 * (P + P.T), dtype=float)
    return Qp(path.stem, symmetric, q.astype(float), np.ascontiguousarray(rows, dtype=float), lower, upper)


def is_feasible(qp: Qp, x: Array) -> bool:
    """Whether x meets the constraints to MET, and to what rounding can tell."""
    value = qp.rows @ x
    rounding = 1e-12 * np.linalg.norm(qp.rows, axis=1) * np.linalg.norm(x)
    least = qp.lower - MET * (1.0 + np.abs(np.nan_to_num(qp.lower))) - rounding
    most = qp.upper + MET * (1.0 + np.abs(np.nan_to_num(qp.upper))) + rounding
    return bool(((value >= least) & (value <= most)).all())


def judge(qp: Qp, answers: dict[str, Found]) -> dict[str, str]:
    """Per solver "right" (feasible, and as good as the best that is), "wrong", "unsolved" or "refused"."""
    objective = {
        name: float(0.5 * found.x @ qp.P @ found.x + qp.q @ found.x)
        for name, found in answers.items()
        if found.x is not None and is_feasible(qp, found.x)
    }
    best = min(objective.values(), default=np.inf)
    return {
        name: "refused"
        if found.refused
        else "unsolved"
        if found.x is None
        else "right"
        if name in objective and objective[name] <= best + AGREES * (1.0 + abs(best))
        else "wrong"
        for name, found in answers.items()
    }


def run(folders: Sequence[Path], rounds: int, as_json: bool) -> None:
    """Time the suites and print, per suite and peer, how our time compares.

    Args:
        folders: of suites.
        rounds: how often the solvers take turns; a time is the median over the rounds.
        as_json: print {suite: figures}.

    Raises:
        BenchError: a folder without QPs.
    """
    solvers = {name: solve for name, solve in SOLVERS.items() if name == "hapticd" or find_spec(name)}
    figures = {folder.name: suite(list(load(folder)), solvers, rounds) for folder in folders}
    if as_json:
        json.dump(figures, sys.stdout, indent=2)
        print()
        return
    for name, found in figures.items():
        print(f"{name}: {found['qps']} QPs of up to {LARGEST} variables")
        for key, value in found.items():
            print(
                f"  {key.replace('_', ' ')}: {value:.3g}" if isinstance(value, float) else f"  {key}: {value}"
            )


def suite(
    qps: Sequence[Qp], solvers: dict[str, Callable[[Qp], Found]], rounds: int
) -> dict[str, float | int | list[str]]:
    """Geometric means of our time over that of each peer, where both are right; and who was not."""
    ratios: dict[str, list[float]] = {name: [] for name in solvers if name != "hapticd"}
    found: dict[str, float | int | list[str]] = {"qps": len(qps)}
    listed: dict[str, list[str]] = {
        f"{name} {kind}": [] for name in solvers for kind in ("wrong", "unsolved", "refused")
    }
    for k in progress("QPs", range(len(qps)), len(qps)):
        taken = [{name: solve(qps[k]) for name, solve in solvers.items()} for _ in range(rounds)]
        verdict = judge(qps[k], taken[-1])
        seconds = {name: float(np.median([answers[name].seconds for answers in taken])) for name in solvers}
        for name, kind in verdict.items():
            if kind != "right":
                listed[f"{name} {kind}"].append(qps[k].name)
        for name in ratios:
            if verdict["hapticd"] == verdict[name] == "right":
                ratios[name].append(seconds["hapticd"] / seconds[name])
    for name, of_peer in ratios.items():
        if of_peer:
            found[f"time over {name}'s"] = float(np.exp(np.mean(np.log(of_peer))))
    return {**found, **{name: names for name, names in listed.items() if names}}
