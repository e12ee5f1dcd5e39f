"""Cost and punctuality of the whole live daemon at several rates, beside a bare C loop in the same run.

Rounds alternate: a C loop with clock_nanosleep under the daemon's own scheduling, then the daemon with the
simulated machine. Figures are medians over the rounds.
"""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.errors import ConfigError
from ..runtime.live.children import run_tied
from ..runtime.live.interrupts import held
from .jitter import Round, in_process
from .recorded import BenchError

COMPUTE = ("mean", "p50", "p99", "p999", "max")
STAGES = ("mean", "p99")
PLANT_STEP_HZ = 3000.0
"""Steps of the simulated plant, whatever the rate of the daemon."""


def at_rate(loaded: Loaded, rate: float, folder: Path) -> Path:
    """A copy of a configuration with another rate; the plant's steps stay about as long as they were.

    A slower machine takes longer to come up, and so does the hand to press the dead-man switch.
    """
    slower = max(1.0, loaded.config.loop.rate / rate)
    text = re.sub(r'(?m)^rate = ".*?"', f'rate = "{rate:g} Hz"', loaded.text, count=1)
    press = r'(?m)^(dead_man = \[\{ at = ")([\d.]+) s"'
    text = re.sub(press, lambda found: f'{found[1]}{slower * float(found[2]):g} s"', text)
    text = re.sub(r"(?m)^substeps = \d+", f"substeps = {max(1, round(PLANT_STEP_HZ / rate))}", text)
    path = folder / f"{Path(loaded.source).stem}-{rate:g}.toml"
    path.write_text(text, encoding="utf-8")
    (folder / loaded.model_source).write_text(loaded.model_text, encoding="utf-8")
    return path


def daemon(path: Path, seconds: float) -> dict[str, Any]:
    """One round of the daemon: its summary."""
    log = path.with_suffix(".mcap")
    log.unlink(missing_ok=True)
    options = ["--duration", str(seconds), "--log", str(log), "--json"]
    command = [sys.executable, "-m", "hapticd.runtime", "run", str(path), *options]
    done = run_tied(command, signal.SIGTERM, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        raise BenchError(f"the daemon ended with {done.returncode}:\n{done.stderr}")
    return dict(json.loads(done.stdout))


def summarise(rate: float, bare: Sequence[Round], live: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Medians over the rounds; ticks and missed periods add up over all of them."""
    return {
        "rate_hz": rate,
        "rounds": len(live),
        "ticks": sum(r["ticks"] + r["shed"] for r in live),
        "missed": sum(r["skipped"] for r in live),
        "c_loop_ticks": sum(count for r in bare for _, count in r.latenesses),
        "c_loop_missed": sum(r.missed for r in bare),
        "compute_us": {c: median(r["compute_us"][c] for r in live) for c in COMPUTE},
        "lateness_us": {c: median(r["lateness_us"][c] for r in live) for c in COMPUTE},
        "stages_us": {
            stage: {c: median(r["stages_us"][stage][c] for r in live) for c in STAGES}
            for stage in live[0]["stages_us"]
        },
    }


def table(found: dict[str, Any]) -> str:
    """The figures of a rate for people."""
    missed = 100.0 * found["missed"] / (found["ticks"] + found["missed"])
    bare = 100.0 * found["c_loop_missed"] / (found["c_loop_ticks"] + found["c_loop_missed"])
    lines = [
        f"{found['rate_hz']:g} Hz: {found['ticks']} ticks in {found['rounds']} rounds;"
        f" missed {missed:.2f} %, bare C loop {bare:.2f} %",
        f"{'us':14}" + "".join(f"{c:>9}" for c in COMPUTE),
    ]
    for name in ("lateness", "compute"):
        lines.append(f"{name:14}" + "".join(f"{found[f'{name}_us'][c]:9.1f}" for c in COMPUTE))
    for stage, row in found["stages_us"].items():
        lines.append(f"  {stage:12}{row['mean']:9.1f}{'':9}{row['p99']:9.1f}")
    return "\n".join(lines)


def _require_fit(name: str, rate: float, path: Path) -> None:
    try:
        build(config.load(str(path)))
    except ConfigError as error:
        raise BenchError(f"{name} does not run at {rate:g} Hz: {error.findings[0]}") from error


def run(name: str, rates: Sequence[float], rounds: int, seconds: float, as_json: bool) -> None:
    """Measure and print, a rate at a time; with ``as_json`` one object a line."""
    loaded = config.load(name)
    with held(), tempfile.TemporaryDirectory() as folder:
        paths = {rate: at_rate(loaded, rate, Path(folder)) for rate in rates}
        for rate, path in paths.items():
            _require_fit(name, rate, path)
        for rate, path in paths.items():
            bare, live = [], []
            for k in range(rounds):
                print(f"{rate:g} Hz: round {k + 1} of {rounds}", file=sys.stderr)
                bare.append(in_process("c_loop", rate, round(seconds * rate)))
                live.append(daemon(path, seconds))
            found = summarise(rate, bare, live)
            print(json.dumps(found) if as_json else table(found), flush=True)
