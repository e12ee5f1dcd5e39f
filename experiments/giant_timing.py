"""HapticGiant, the timing paragraph of VII-A: period, computation, and the share of the hierarchical QP."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import msgspec

from ..runtime.live.children import run_tied
from .outcome import ExperimentError, Outcome, Progress, Row

TITLE = "period and computation of the controller (VII-A), live"
SECONDS = 20.0
PAPER = {"period": 1003.0, "mean": 529.0, "p999": 616.0, "max": 707.0, "solve": 92.6}
"""Mean period, computation [us], and the share of it that the solver takes [%]."""


def live(seconds: float) -> dict[str, Any]:
    """The summary of a live session of the giant on its simulated plant.

    Raises:
        ExperimentError: the session failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        options = ["--duration", f"{seconds:g}", "--log", str(Path(folder) / "timing.mcap"), "--json"]
        command = [sys.executable, "-m", "hapticd.runtime", "run", "giant", *options]
        done = run_tied(command, signal.SIGTERM, stderr=subprocess.PIPE, text=True)
    try:
        return dict(msgspec.json.decode(done.stdout))
    except msgspec.DecodeError as error:
        raise ExperimentError(f"the live session ended with {done.returncode}:\n{done.stderr}") from error


def figures(summary: dict[str, Any]) -> dict[str, float]:
    """What the paper prints of its controller, by the names of ``PAPER``, and the share of missed periods."""
    ran, missed = summary["ticks"] + summary["shed"], summary["skipped"]
    compute = summary["compute_us"]
    solve = summary["stages_us"]["solve"]["mean"]
    return {
        "period": 1e6 / summary["rate_hz"] * (ran + missed) / ran,
        **{name: compute[name] for name in ("mean", "p999", "max")},
        "solve": 100.0 * solve / compute["mean"],
        "missed": 100.0 * missed / (ran + missed),
    }


def run(progress: Progress) -> Outcome:
    """A live session; everything in it is a timing of this host."""
    progress(f"live for {SECONDS:g} s")
    summary = live(SECONDS)
    found = figures(summary)
    preempts = "PREEMPT_RT" in os.uname().version
    host = (
        f"measured on a host {'with' if preempts else 'without'} PREEMPT_RT; the plant is simulated beside it"
    )
    rows = [
        Row(
            "mean period [us]",
            f"{PAPER['period']:g}",
            f"{found['period']:.1f}",
            f"{host}; missed {found['missed']:.2f} % of the periods",
            timing=True,
        ),
        Row(
            "computation, mean / p99.9 / max [us]",
            "{mean:g} / {p999:g} / {max:g}".format(**PAPER),
            "{mean:.0f} / {p999:.0f} / {max:.0f}".format(**found),
            "the whole tick: bus, estimation, safety and log, too; the maximum is the host's",
            timing=True,
        ),
        Row(
            "of it in the hierarchical QP [%]",
            f"{PAPER['solve']:g}",
            f"{found['solve']:.1f}",
            "mean",
            timing=True,
        ),
    ]
    stages = {name: times["mean"] for name, times in summary["stages_us"].items()}

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        axes.barh(list(stages), list(stages.values()), color="tab:blue")
        axes.invert_yaxis()
        axes.set(xlabel="mean duration [us]", ylabel="stage of the tick")

    return Outcome(rows, found, draw, (7.0, 4.0))
