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
from zipfile import BadZipFile

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
    """Minimise 1/2 x^T P x + q^T x with lower <= rows x <= upper and lb <= x <= ub."""

    name: str
    P: Array
    q: Array
    rows: Array
    lower: Array
    upper: Array
    lb: Array
    ub: Array

    @property
    def is_boxed(self) -> bool:
        """Whether a variable has a bound of its own."""
        return bool(np.isfinite(self.lb).any() or np.isfinite(self.ub).any())


class Found(NamedTuple):
    """Seconds of the whole call, and x; no x: the solver gave up, or refused the QP as none that it is for.

    inside: seconds by the solver's own count, without its Python binding, where it has one.
    """

    seconds: float
    x: Array | None
    refused: bool = False
    inside: float | None = None


def hapticd(qp: Qp) -> Found:
    """Ours."""
    equal, below, above = _kinds(qp)
    G = np.vstack([qp.rows[above], -qp.rows[below]])
    h = np.concatenate([qp.upper[above], -qp.lower[below]])
    A, b = qp.rows[equal], qp.lower[equal]
    lb, ub = (qp.lb, qp.ub) if qp.is_boxed else (None, None)
    start = time.perf_counter()
    try:
        found = solve_qp(qp.P, qp.q, G, h, A, b, lb, ub)
    except HqpError as error:
        return Found(time.perf_counter() - start, None, not isinstance(error, UnboundedError))
    return Found(time.perf_counter() - start, found.x if found.found else None)


def daqp(qp: Qp) -> Found:
    """DAQP. Bounds that are more than rows are the box."""
    import daqp

    lower, upper = qp.lower, qp.upper
    if qp.is_boxed:
        lower, upper = np.concatenate([qp.lb, lower]), np.concatenate([qp.ub, upper])
    sense = np.where(lower == upper, 5, 0).astype(np.intc)
    lower, upper = np.maximum(lower, -1e30), np.minimum(upper, 1e30)
    start = time.perf_counter()
    x, _, flag, info = daqp.solve(qp.P, qp.q, qp.rows, upper, lower, sense)
    seconds = time.perf_counter() - start
    return Found(seconds, np.asarray(x) if flag > 0 else None, inside=info["setup_time"] + info["solve_time"])


def quadprog(qp: Qp) -> Found:
    """quadprog, where P is positive definite. It has no box."""
    import quadprog

    equal, below, above = _kinds(qp)
    box, low, high = np.eye(len(qp.q)), np.isfinite(qp.lb), np.isfinite(qp.ub)
    rows = np.vstack([qp.rows[equal], qp.rows[below], -qp.rows[above], box[low], -box[high]])
    least = np.concatenate([qp.lower[equal], qp.lower[below], -qp.upper[above], qp.lb[low], -qp.ub[high]])
    columns = np.ascontiguousarray(rows.T)
    start = time.perf_counter()
    try:
        x = quadprog.solve_qp(qp.P, -qp.q, columns, least, int(equal.sum()))[0]
    except ValueError:
        return Found(time.perf_counter() - start, None)
    return Found(time.perf_counter() - start, np.asarray(x))


def _kinds(qp: Qp) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Rows that are equalities, and the others that have a lower and an upper bound."""
    equal = qp.lower == qp.upper
    return equal, np.isfinite(qp.lower) & ~equal, np.isfinite(qp.upper) & ~equal


SOLVERS: dict[str, Callable[[Qp], Found]] = {"hapticd": hapticd, "daqp": daqp, "quadprog": quadprog}


def load(folder: Path) -> Iterator[Qp]:
    """The QPs of a folder, by name, of up to LARGEST variables.

    Raises:
        BenchError: no such folder, no file of these kinds in it, or one that cannot be read.
    """
    paths = sorted(path for path in folder.rglob("*") if path.suffix in (".npz", ".mat"))
    if not paths:
        raise BenchError(f"{folder} has no .npz or .mat file with a QP; clone a suite and name its folder")
    for path in paths:
        try:
            qp = _npz(path) if path.suffix == ".npz" else _mat(path)
        except (OSError, EOFError, ValueError, TypeError, IndexError, AttributeError, BadZipFile) as error:
            problem = f"{path} is no QP: {error}; mend it, or take it out of the folder"
            raise BenchError(problem) from error
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
    for matrix, below, above in (("G", None, "h"), ("A", "b", "b")):
        if matrix in parts and above in parts:
            rows.append(parts[matrix])
            lower.append(parts.get(below or "", np.full(len(rows[-1]), -np.inf)))
            upper.append(parts[above])
    lb, ub = parts.get("lb", np.full(n, -np.inf)), parts.get("ub", np.full(n, np.inf))
    bounds = (np.concatenate(lower), np.concatenate(upper), lb, ub)
    return _qp(path, parts["P"], parts["q"], np.vstack(rows), *bounds)


def _mat(path: Path) -> Qp | None:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        data = loadmat(path)
    except MatReadError as error:
        raise ValueError(error) from error
    if not {"P", "q", "A", "l", "u"} <= set(data) or data["P"].shape[0] > LARGEST:
        return None
    dense = (
        np.asarray(part.toarray() if hasattr(part, "toarray") else part) for part in (data["P"], data["A"])
    )
    P, A = dense
    lower, upper, n = data["l"].ravel(), data["u"].ravel(), len(P)
    if not np.array_equal(A[-n:], np.eye(n)):
        return _qp(path, P, data["q"].ravel(), A, lower, upper, np.full(n, -np.inf), np.full(n, np.inf))
    bounds = (lower[:-n], upper[:-n], lower[-n:], upper[-n:])
    return _qp(path, P, data["q"].ravel(), A[:-n], *bounds)


def _qp(path: Path, P: Array, q: Array, rows: Array, *bounds: Array) -> Qp:
    symmetric = np.ascontiguousarray(0.5 * (P + P.T), dtype=float)
    numbers = (np.ascontiguousarray(part, dtype=float) for part in (q, rows, *map(_endless, bounds)))
    return Qp(path.stem, symmetric, *numbers)


def _endless(bounds: Array) -> Array:
    """Bounds with infinity where a file has a large number for it."""
    return np.where(np.abs(bounds) > INFINITE / 2, np.copysign(np.inf, bounds), bounds)


def is_feasible(qp: Qp, x: Array) -> bool:
    """Whether x meets the constraints to MET, and to what rounding can tell."""
    value = np.concatenate([qp.rows @ x, x])
    norm = np.concatenate([np.linalg.norm(qp.rows, axis=1), np.ones(len(x))])
    lower, upper = np.concatenate([qp.lower, qp.lb]), np.concatenate([qp.upper, qp.ub])
    rounding = 1e-12 * norm * np.linalg.norm(x)
    least = lower - MET * (1.0 + np.abs(np.nan_to_num(lower))) - rounding
    most = upper + MET * (1.0 + np.abs(np.nan_to_num(upper))) + rounding
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
    """Geometric means of our time over that of each peer, where both are right; and who was not.

    Ours is that of the whole call; a peer's is, too, and once more what it counts itself.
    """
    ratios: dict[str, list[float]] = {}
    found: dict[str, float | int | list[str]] = {"qps": len(qps)}
    listed: dict[str, list[str]] = {
        f"{name} {kind}": [] for name in solvers for kind in ("wrong", "unsolved", "refused")
    }
    for k in progress("QPs", range(len(qps)), len(qps)):
        taken = [{name: solve(qps[k]) for name, solve in solvers.items()} for _ in range(rounds)]
        verdict = judge(qps[k], taken[-1])
        for name, kind in verdict.items():
            if kind != "right":
                listed[f"{name} {kind}"].append(qps[k].name)
        ours = np.median([answers["hapticd"].seconds for answers in taken])
        for name in solvers:
            if name == "hapticd" or not verdict["hapticd"] == verdict[name] == "right":
                continue
            for kind, theirs in _seconds([answers[name] for answers in taken]).items():
                ratios.setdefault(f"time over {name}'s {kind}", []).append(float(ours / theirs))
    means = {name: float(np.exp(np.mean(np.log(of_peer)))) for name, of_peer in ratios.items()}
    return {**found, **means, **{name: names for name, names in listed.items() if names}}


def _seconds(answers: Sequence[Found]) -> dict[str, float]:
    """Medians of the call, and of what the solver counts itself."""
    inside = [answer.inside for answer in answers if answer.inside is not None]
    call = {"call": float(np.median([answer.seconds for answer in answers]))}
    return {**call, "own count": float(np.median(inside))} if inside else call
