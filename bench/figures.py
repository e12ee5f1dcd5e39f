"""Figures of a solver on a data set: percentiles of its times, iterations, and how often it is wrong."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..hqp.certificate import certificate, slack_norms
from ..hqp.reference import first_mismatch
from .contenders import Answer
from .recorded import Recording

TOLERANCES = {"wrong_1e6": 1e-6, "wrong_1e4": 1e-4, "wrong_1e2": 1e-2}
PERCENTILES = {"median_us": 50.0, "p99_us": 99.0, "p999_us": 99.9, "max_us": 100.0}
TITLES = {
    "median_us": "median us",
    "p99_us": "p99",
    "p999_us": "p99.9",
    "max_us": "max",
    "iterations_mean": "iterations",
    "iterations_max": "most",
    "ticks": "of",
}
WIDTHS = (11, 9, 9, 9, 11, 6, 6)  # beside a name of 17 letters, on 80 columns
FAULTS = {
    **{name: f"wrong by 1e-{name[-1]}" for name in TOLERANCES},
    "better": "better than recorded",
    "not_solved": "not solved",
    "failed": "failed",
}

Figures = dict[str, float]


def summary(rounds: Sequence[Sequence[Answer]]) -> Figures:
    """Percentiles of the times, mean and largest number of iterations; NaN without answers.

    The time of a problem is its median over the rounds: what else the machine does hits others in each round.

    Args:
        rounds: the answers to the same problems, time and again.
    """
    times = np.median([[answer.us for answer in answers] or [np.nan] for answers in rounds], axis=0)
    iterations = [float(answer.iterations) for answer in rounds[-1]] or [np.nan]
    return {
        **{name: float(np.percentile(times, q)) for name, q in PERCENTILES.items()},
        "iterations_mean": float(np.mean(iterations)),
        "iterations_max": float(np.max(iterations)),
        "not_solved": float(sum(not answer.solved for answer in rounds[-1])),
    }


def count_wrong(recording: Recording, points: dict[int, NDArray[np.float64]]) -> Figures:
    """Ticks whose slack norms differ from the recorded ones, for x by tick.

    Where they are lexicographically smaller, and the certificate of x is smaller than that of the recorded
    point, it is the recording that is not optimal: such ticks are counted as `better`, not as wrong.
    """
    wrong = dict.fromkeys(TOLERANCES, 0.0)
    better = 0.0
    for tick, x in points.items():
        levels, expected = recording.levels(tick), recording.norms[tick]
        norms = slack_norms(levels, x)
        at = first_mismatch(norms, expected, 1e-6)
        if at is None:
            continue
        proven = certificate(levels, x).max() < certificate(levels, recording.x[tick]).max()
        if norms[at] < expected[at] and proven:
            better += 1
            continue
        for name, tolerance in TOLERANCES.items():
            wrong[name] += first_mismatch(norms, expected, tolerance) is not None
    return {**wrong, "better": better}


def table(solvers: dict[str, Figures]) -> Iterator[str]:
    """A line for each solver, and one for each that is not right on every tick."""
    yield " " * 19 + "".join(
        f"{title:>{width}}" for title, width in zip(TITLES.values(), WIDTHS, strict=True)
    )
    for solver, values in solvers.items():
        yield f"  {solver:17}" + "".join(map(_cell, TITLES, (values[key] for key in TITLES), WIDTHS))
    for solver, values in solvers.items():
        faults = [f"{values[key]:.0f} {fault}" for key, fault in FAULTS.items() if values[key]]
        if faults:
            yield f"  {solver}: {', '.join(faults)}"


def _cell(key: str, value: float, width: int) -> str:
    return f"{value:{width}.{1 if key.endswith(('us', 'mean')) else 0}f}"


def progress(what: str, items: Iterable[int], count: int) -> Iterator[int]:
    """The items, with a line on standard error that says how far they are."""
    for done, item in enumerate(items, start=1):
        yield item
        if sys.stderr.isatty() or done == count:
            print(f"\r  {what} {done}/{count}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
