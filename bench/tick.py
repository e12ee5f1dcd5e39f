"""Cost and punctuality of the whole live daemon, beside a bare C loop in the same run.

    python bench/tick.py [--rounds N] [--seconds S] [--json]

Rounds alternate: a C loop with clock_nanosleep under the daemon's own scheduling, then the daemon with the
simulated giant. Figures are medians over the rounds.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

C_LOOP = """
import json, sys
from hapticd.runtime.histogram import nanosleep_loop
from hapticd.runtime.realtime import DAEMON_PRIORITY, become_realtime
become_realtime(DAEMON_PRIORITY)
ticks = int(sys.argv[1])
histogram, missed = nanosleep_loop(1_000_000, ticks)
print(json.dumps({"ticks": ticks, "missed": missed, "lateness_us": histogram.summary()}))
"""
COLUMNS = ("mean", "p50", "p99", "p999", "max")


def c_loop(seconds: float) -> dict[str, Any]:
    """One round of the bare loop at 1 kHz."""
    command = [sys.executable, "-c", C_LOOP, str(round(seconds * 1000))]
    return dict(json.loads(subprocess.run(command, check=True, capture_output=True).stdout))


def daemon(seconds: float, folder: Path) -> dict[str, Any]:
    """One round of the daemon at 1 kHz."""
    options = ["--duration", str(seconds), "--log", str(folder / "bench.mcap"), "--json"]
    command = [sys.executable, "-m", "hapticd.runtime", "run", "giant", *options]
    done = subprocess.run(command, check=False, capture_output=True)
    if done.returncode:
        raise SystemExit(done.stderr.decode())
    return dict(json.loads(done.stdout))


def summarise(bare: list[dict[str, Any]], live: list[dict[str, Any]]) -> dict[str, Any]:
    """Medians over the rounds; missed ticks as a share of all."""
    return {
        "rounds": len(live),
        "ticks": sum(r["ticks"] for r in live),
        "missed": median(r["skipped"] / (r["ticks"] + r["skipped"]) for r in live),
        "c_loop_missed": median(r["missed"] / r["ticks"] for r in bare),
        "compute_us": {c: median(r["compute_us"][c] for r in live) for c in COLUMNS},
        "solve_us": {c: median(r["solve_us"][c] for r in live) for c in COLUMNS},
        "lateness_us": {c: median(r["lateness_us"][c] for r in live) for c in COLUMNS},
        "c_loop_lateness_us": {c: median(r["lateness_us"][c] for r in bare) for c in COLUMNS},
    }


def main() -> None:
    """Run the rounds and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    bare, live = [], []
    with tempfile.TemporaryDirectory() as folder:
        for k in range(options.rounds):
            print(f"round {k + 1} of {options.rounds}", end="\r", file=sys.stderr)
            bare.append(c_loop(options.seconds))
            live.append(daemon(options.seconds, Path(folder)))
    found = summarise(bare, live)
    if options.json:
        print(json.dumps(found))
        return
    print(
        f"{found['ticks']} ticks in {found['rounds']} rounds; missed {100 * found['missed']:.2f} %,", end=" "
    )
    print(f"bare C loop {100 * found['c_loop_missed']:.2f} %")
    print(f"{'us':20}" + "".join(f"{c:>9}" for c in COLUMNS))
    for name in ("compute_us", "solve_us", "lateness_us", "c_loop_lateness_us"):
        print(f"{name.removesuffix('_us'):20}" + "".join(f"{found[name][c]:9.1f}" for c in COLUMNS))


if __name__ == "__main__":
    main()
