"""How a cold solve grows with the number of variables and of levels, on random dense hierarchies."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..hqp import Solver
from ..hqp.certificate import certificate
from ..hqp.generate import problem
from .contenders import Answer
from .figures import TOLERANCES, Figures, progress, summary
from .picture import pyplot, save

SIZES = (8, 12, 16, 20, 24, 30, 36, 42, 48, 54, 60)
LEVELS = (2, 3, 4, 6, 8, 10, 12)
FIXED_LEVELS, FIXED_N = 6, 30
SEEDS = 60
SOLVER = "hapticd cold"

Growth = dict[str, dict[str, Figures]]


def growth(rounds: int) -> Growth:
    """Figures of {"n=8": {solver: ...}, ..., "levels=2": ...}.

    The problems of n=... are dense ones of FIXED_LEVELS levels, those of levels=... have FIXED_N variables.
    `exponent` is that of the power law fitted to all medians, `exponent_upper_half` to the larger half.
    Wrong is what its certificate refutes.
    """
    cases = {f"n={n}": (n, FIXED_LEVELS) for n in SIZES}
    cases |= {f"levels={count}": (FIXED_N, count) for count in LEVELS}
    print(f"growth: {SEEDS} dense problems of each size", file=sys.stderr)
    sets = {name: [_Case(n, count, seed) for seed in range(SEEDS)] for name, (n, count) in cases.items()}
    taken: dict[str, list[list[Answer]]] = {name: [] for name in cases}
    for _ in progress("rounds", range(rounds), rounds):
        for name, problems in sets.items():
            taken[name].append([case.solve() for case in problems])
    found = {
        name: {SOLVER: {**summary(taken[name]), **_refuted(problems)}} for name, problems in sets.items()
    }
    for kind in ("n", "levels"):
        of_kind = _of_kind(found, kind)
        sizes, medians = list(of_kind), [values["median_us"] for values in of_kind.values()]
        half = len(sizes) // 2
        for values in of_kind.values():
            values["exponent"] = exponent(sizes, medians)
            values["exponent_upper_half"] = exponent(sizes[half:], medians[half:])
    return found


def exponent(sizes: list[float], times: list[float]) -> float:
    """The k of the power law time ~ size^k nearest to the times in their logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


class _Case:
    def __init__(self, n: int, levels: int, seed: int) -> None:
        self.levels = problem("dense", seed, n, levels)
        self.solver = Solver(n, [level.rows for level in self.levels])
        self.worst = np.inf

    def solve(self) -> Answer:
        self.solver.reset()
        start = time.perf_counter_ns()
        solution = self.solver.solve(self.levels)
        us = 1e-3 * (time.perf_counter_ns() - start)
        return Answer(us, solution.x, solution.iterations, solution.status == 0)


def _refuted(problems: list[_Case]) -> Figures:
    worst = np.array([certificate(case.levels, case.solver.solution.x).max() for case in problems])
    return {name: float(np.sum(~(worst <= tolerance))) for name, tolerance in TOLERANCES.items()}


def _of_kind(found: Growth, kind: str) -> dict[float, Figures]:
    return {
        float(name.removeprefix(f"{kind}=")): figures[SOLVER]
        for name, figures in found.items()
        if name.startswith(f"{kind}=")
    }


def lines_of_growth(found: Growth) -> Iterator[str]:
    """A table for people."""
    for name, figures in found.items():
        values = figures[SOLVER]
        yield (
            f"{name:>10}  median {values['median_us']:8.1f} us  p99 {values['p99_us']:8.1f} us"
            f"  iterations {values['iterations_mean']:5.1f}, at most {values['iterations_max']:3.0f}"
        )
    for kind, fixed in (("n", f"{FIXED_LEVELS} levels"), ("levels", f"n = {FIXED_N}")):
        for values in list(_of_kind(found, kind).values())[:1]:
            all_sizes, upper = values["exponent"], values["exponent_upper_half"]
            yield f"cold median ~ {kind}^{all_sizes:.2f} at {fixed}; over the larger half {kind}^{upper:.2f}"


def plot(found: Growth, path: Path) -> None:
    """Draw the medians and p99 over n and over the levels, both axes logarithmic.

    Raises:
        BenchError: matplotlib is not installed, or the file cannot be written.
    """
    figure, axes = pyplot().subplots(1, 2, figsize=(9, 4), sharey=True, layout="constrained")
    for ax, kind, fixed in zip(
        axes, ("n", "levels"), (f"{FIXED_LEVELS} levels", f"n = {FIXED_N}"), strict=True
    ):
        of_kind = _of_kind(found, kind)
        sizes, figures = list(of_kind), list(of_kind.values())
        medians, k = [values["median_us"] for values in figures], figures[0]["exponent"]
        at = np.exp(np.mean(np.log(medians)) - k * np.mean(np.log(sizes)))
        ax.loglog(sizes, medians, "o-", label="median")
        ax.loglog(sizes, [values["p99_us"] for values in figures], "s--", label="p99")
        ax.loglog(sizes, at * np.array(sizes) ** k, ":", color="black", label=f"{kind}$^{{{k:.2f}}}$")
        ax.set(xlabel=f"{kind}, at {fixed}", ylabel="cold solve [us]")
        ax.set_xticks(sizes, [f"{size:g}" for size in sizes])
        ax.minorticks_off()
        ax.legend()
        ax.grid(alpha=0.3)
    save(figure, path)
