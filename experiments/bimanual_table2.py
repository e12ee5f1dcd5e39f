"""Bimanual, Table II: the task of the user study in its three modes, by a scripted person in simulation."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from itertools import repeat
from typing import Any

import numpy as np

from .outcome import Outcome, Progress, Row
from .peg_trial import Mode, Trial, peg_trial
from .workers import pool_of

TITLE = "bimanual task with three ways to lead (Table II), in simulation"
TRIALS, FULL = 10, 100
"""Of each mode, in a quick run and in a full one."""
FIRST = 1001
"""Seed of the first one; the person was tuned on others."""
WORKERS = os.cpu_count() or 1
PAPER = {
    Mode.FEEDBACK: ("4/5", "119.0 +- 117.1"),
    Mode.NO_FEEDBACK: ("5/5", "123.0 +- 88.4"),
    Mode.CONTROLLERS: ("3/5", "126.3 +- 25.8"),
}


def run(progress: Progress) -> Outcome:
    """A few trials of each mode."""
    return outcome(trials(TRIALS, progress))


def study(progress: Progress) -> Outcome:
    """As many as say something."""
    return outcome(trials(FULL, progress))


def trials(count: int, progress: Progress) -> dict[Mode, list[Trial]]:
    """So many of each mode, the same seeds in each."""
    seen: dict[Mode, list[Trial]] = {}
    with pool_of(WORKERS) as pool:
        for mode in Mode:
            seen[mode] = []
            each = pool.map if WORKERS > 1 else map
            for trial in each(peg_trial, repeat(mode, count), range(FIRST, FIRST + count)):
                seen[mode].append(trial)
                progress(f"{mode.value}: {len(seen[mode])} of {count}")
    return seen


def outcome(seen: dict[Mode, list[Trial]]) -> Outcome:
    """Rows and plot of trials, by mode."""
    rows = []
    for mode, trials in seen.items():
        success, seconds = PAPER[mode]
        done = [trial for trial in trials if trial.success]
        note = "scripted person, not a user study; limit 300 s"
        rows.append(Row(f"success, {mode.value}", success, f"{len(done)}/{len(trials)}", note))
        rows.append(Row(f"time, {mode.value} [s]", seconds, spread([trial.time for trial in done])))
        rows.append(Row(f"largest force at a hand, {mode.value} [N]", "-", spread([t.peak for t in trials])))
    figures = {mode.name.lower(): [asdict(trial) for trial in trials] for mode, trials in seen.items()}

    def draw(figure: Any) -> None:
        axes = figure.subplots(1, 2)
        labels = [mode.value.replace(" ", "\n", 1) for mode in seen]
        for each, values, name in (
            (axes[0], [[t.time for t in trials if t.success] for trials in seen.values()], "time [s]"),
            (axes[1], [[t.peak for t in trials] for trials in seen.values()], "largest force [N]"),
        ):
            each.boxplot(values, tick_labels=labels, whis=(0, 100))
            each.set(xlabel="led by", ylabel=name, ylim=(0, None))
        axes[0].set_title("until the bar is in, in simulation")
        axes[1].set_title("at a hand")

    return Outcome(rows, {"trials": figures}, draw, (9.0, 4.0))


def spread(values: Sequence[float]) -> str:
    """Mean and standard deviation, as the paper prints them."""
    if not values:
        return "-"
    return f"{np.mean(values):.1f} +- {np.std(values, ddof=1) if len(values) > 1 else 0.0:.1f}"
