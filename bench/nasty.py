"""Solves random hierarchies of every nasty kind and judges the answers by their certificates alone."""

from __future__ import annotations

import json
import sys

import numpy as np

from ..hqp import Solver
from ..hqp.certificate import certificate
from ..hqp.generate import KINDS, jump, problem
from .figures import TOLERANCES, Figures, progress

TICKS = 3
TITLES = {"ended": "ended", "solved": "solved", **{name: name.replace("_", " ") for name in TOLERANCES}}


def run(count: int, as_json: bool) -> int:
    """Solve `count` problems of each kind, cold, then warm as targets jump, and print what certificates say.

    Returns:
        How many were not solved, or are wrong by more than 1e-6.
    """
    figures = {kind: sweep(kind, count) for kind in KINDS}
    if as_json:
        json.dump(figures, sys.stdout, indent=2)
        print()
    else:
        print(f"{'':20}{'worst':>9}" + "".join(f"{title:>10}" for title in TITLES.values()))
        for kind, found in figures.items():
            print(f"{kind:20}{found['worst']:9.1e}" + "".join(f"{found[name]:10.0f}" for name in TITLES))
    return round(sum(count - found["solved"] + found["wrong_1e6"] for found in figures.values()))


def sweep(kind: str, count: int) -> Figures:
    """Problems of one kind: how many end with a usable x, are solved, and are refuted, on any tick."""
    worst, statuses = np.zeros(count), np.zeros(count)
    for seed in progress(kind, range(count), count):
        rng, levels = np.random.default_rng(seed), problem(kind, seed)
        solver = Solver(levels[0].n, [level.rows for level in levels])
        for _ in range(TICKS):
            solution = solver.solve(levels)
            statuses[seed] = solution.status or statuses[seed]
            worst[seed] = np.maximum(worst[seed], certificate(levels, solution.x).max())
            jump(rng, levels)
    return {
        "ended": float(np.sum(statuses >= 0)),
        "solved": float(np.sum(statuses == 0)),
        "worst": float(worst.max(initial=0.0)),
        **{name: float(np.sum(~(worst <= tolerance))) for name, tolerance in TOLERANCES.items()},
    }
