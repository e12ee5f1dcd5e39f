"""Punctuality of the daemon's loop beside cyclictest, a bare C loop and plain asyncio.

Each contender runs in a process of its own, one after the other, in several rounds; figures are medians over
the rounds. ``python -m hapticd.bench.jitter NAME HZ TICKS`` is one contender of one round.
"""

from __future__ import annotations

import asyncio
import json
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

import msgspec

from ..runtime.live.children import run_tied
from ..runtime.timing.histogram import Histogram, nanosleep_loop
from ..runtime.timing.loop import FixedRate, now_ns
from ..runtime.timing.realtime import DAEMON_PRIORITY, SPIN_NS, become_realtime, settle_memory, stay_awake
from ..runtime.timing.watch import WatchedLoop
from .picture import pyplot, save

DELAY_NS = 20_000_000
LONGEST_US = 100_000
"""Longest latency in cyclictest's histogram."""
QUANTILES = {"p50_us": 0.5, "p99_us": 0.99, "p999_us": 0.999}
LABELS = {
    "cyclictest": "cyclictest",
    "c_loop": "bare C loop",
    "hapticd": "hapticd",
    "hapticd_spin": "hapticd, spinning",
    "asyncio": "asyncio call_at",
}
LINES = dict(zip(LABELS, ("-", "--", "-.", ":", (0, (6, 1, 1, 1, 1, 1))), strict=True))
"""Told apart without colour, too."""
CYCLICTEST = re.compile(r"^(\d{6}) (\d{6,})$", re.MULTILINE)
OVERFLOWS = re.compile(r"^# Histogram Overflows: (\d+)", re.MULTILINE)
LARGEST = re.compile(r"^# Max Latencies: (\d+)", re.MULTILINE)

Figures = dict[str, float]


class Round(msgspec.Struct):
    """One contender in one round.

    Attributes:
        latenesses: [us] and how often it was that late.
        largest: the worst [us].
        missed: periods without a tick.
        warnings: what the kernel refused.
    """

    latenesses: list[tuple[float, int]]
    largest: float
    missed: int
    warnings: list[str] = []

    def quantile(self, q: float) -> float:
        """Lateness [us] that the share q of the ticks does not exceed."""
        wanted, seen = q * sum(count for _, count in self.latenesses), 0
        for us, count in self.latenesses:
            seen += count
            if seen >= wanted:
                return min(us, self.largest)  # that of a bucket is its upper edge
        return self.largest

    def figures(self) -> Figures:
        """As the JSON report has them."""
        found = {name: self.quantile(q) for name, q in QUANTILES.items()}
        return {**found, "max_us": self.largest, "missed": self.missed}


def _of(histogram: Histogram, missed: int) -> Round:
    return Round(histogram.cells(), histogram.summary()["max"], missed)


def c_loop(rate: float, ticks: int) -> Round:
    """clock_nanosleep on the absolute grid."""
    return _of(*nanosleep_loop(round(1e9 / rate), ticks))


def hapticd(rate: float, ticks: int, spin_ns: int = 0) -> Round:
    """The daemon's loop with an empty tick."""
    histogram, missed = Histogram(), 0

    async def main() -> None:
        nonlocal missed
        loop, done = asyncio.get_running_loop(), asyncio.Event()
        assert isinstance(loop, WatchedLoop)

        def tick() -> None:
            nonlocal missed
            histogram.add(now_ns() - rhythm.deadline_ns)
            missed += rhythm.skipped
            if rhythm.tick >= ticks:
                rhythm.stop(loop.remove_reader)
                done.set()

        rhythm = FixedRate(round(1e9 / rate), tick, spin_ns)
        rhythm.start(loop.add_tick, DELAY_NS)
        await done.wait()

    with asyncio.Runner(loop_factory=WatchedLoop) as runner:
        runner.run(main())
    return _of(histogram, missed)


def hapticd_spin(rate: float, ticks: int) -> Round:
    """The same, woken early and spinning to the deadline."""
    return hapticd(rate, ticks, SPIN_NS)


def plain_asyncio(rate: float, ticks: int) -> Round:
    """What asyncio's own timers give: the next ``call_at`` on the same absolute grid."""
    histogram, missed = Histogram(), 0
    period_ns = round(1e9 / rate)

    async def main() -> None:
        loop, done = asyncio.get_running_loop(), asyncio.Event()
        offset = now_ns() / 1e9 - loop.time()
        start = now_ns() + DELAY_NS
        at = 0

        def tick() -> None:
            nonlocal at, missed
            late = now_ns() - (start + at * period_ns)
            histogram.add(late)
            skipped = max(0, late // period_ns)
            missed += skipped
            at += 1 + skipped
            if at >= ticks:
                done.set()
            else:
                loop.call_at((start + at * period_ns) / 1e9 - offset, tick)

        loop.call_at(start / 1e9 - offset, tick)
        await done.wait()

    asyncio.run(main())
    return _of(histogram, missed)


CONTENDERS: dict[str, Callable[[float, int], Round]] = {
    "c_loop": c_loop,
    "hapticd": hapticd,
    "hapticd_spin": hapticd_spin,
    "asyncio": plain_asyncio,
}


def cyclictest(rate: float, ticks: int) -> Round:
    """Run cyclictest (rt-tests) with one thread, at the daemon's priority where the kernel grants that."""
    try:
        return _cyclictest(rate, ticks, "-m", f"-p{DAEMON_PRIORITY}")
    except subprocess.CalledProcessError:
        found = _cyclictest(rate, ticks)
    found.warnings = ["cyclictest, too, ran without SCHED_FIFO and locked memory"]
    return found


def _cyclictest(rate: float, ticks: int, *privileges: str) -> Round:
    command = ["cyclictest", "-q", *privileges, "-t1", f"-i{round(1e6 / rate)}"]
    done = run_tied([*command, f"-l{ticks}", f"-h{LONGEST_US}"], stderr=subprocess.PIPE, text=True)
    cells = [(float(us), int(count)) for us, count in CYCLICTEST.findall(done.stdout) if int(count)]
    if done.returncode or not cells:
        raise subprocess.CalledProcessError(done.returncode, command, done.stdout, done.stderr)
    overflows = OVERFLOWS.search(done.stdout)
    beyond = int(overflows[1]) if overflows else 0
    largest = LARGEST.search(done.stdout)
    missed = beyond + sum(count for us, count in cells if us >= 1e6 / rate)
    return Round(cells, float(largest[1]) if largest else cells[-1][0], missed)


def in_process(name: str, rate: float, ticks: int) -> Round:
    """One contender in a process of its own."""
    command = [sys.executable, "-m", "hapticd.bench.jitter", name, str(rate), str(ticks)]
    done = run_tied(command)
    done.check_returncode()
    return msgspec.json.decode(done.stdout, type=Round)


def measure(
    rate: float, rounds: int, seconds: float, progress: Callable[[str], None]
) -> dict[str, list[Round]]:
    """All rounds of all contenders that this computer has, in turn."""
    ticks = round(seconds * rate)
    runs: dict[str, Callable[[], Round]] = {}
    if shutil.which("cyclictest"):
        runs["cyclictest"] = lambda: cyclictest(rate, ticks)
    for name in CONTENDERS:
        runs[name] = lambda name=name: in_process(name, rate, ticks)  # type: ignore[misc]
    found: dict[str, list[Round]] = {name: [] for name in runs}
    for k in range(rounds):
        for name, run in runs.items():
            progress(f"round {k + 1} of {rounds}: {LABELS[name]}")
            try:
                found[name].append(run())
            except subprocess.CalledProcessError as error:
                progress(f"{LABELS[name]} failed: {error.stderr or error}\n")
    return {name: done for name, done in found.items() if done}


def summarise(found: dict[str, list[Round]]) -> dict[str, Figures]:
    """Medians over the rounds."""
    return {
        name: {key: median(r.figures()[key] for r in done) for key in done[0].figures()}
        for name, done in found.items()
    }


def table(figures: dict[str, Figures]) -> str:
    """The figures for people, with the ratio to cyclictest, or to the C loop where that is missing."""
    yardstick = "cyclictest" if "cyclictest" in figures else "c_loop"
    titles = f"{'p50':>9}{'p99':>9}{'p99.9':>9}{'max':>9}{'missed':>8}{'p99 / ' + yardstick:>18}"
    lines = [f"{'lateness us':18}{titles}"]
    for name, row in figures.items():
        columns = "".join(f"{row[key]:9.1f}" for key in QUANTILES)
        ratio = row["p99_us"] / max(figures[yardstick]["p99_us"], 1e-3)
        lines.append(f"{LABELS[name]:18}{columns}{row['max_us']:9.1f}{row['missed']:8.0f}{ratio:18.2f}")
    return "\n".join(lines)


def draw(found: dict[str, list[Round]], rate: float, path: Path) -> None:
    """Share of the ticks that were later than a time, all rounds together, as a picture."""
    plt = pyplot()
    figure, axes = plt.subplots(figsize=(8, 5))
    for name, done in found.items():
        cells: Counter[float] = Counter()
        for one in done:
            cells.update(dict(one.latenesses))
        ordered = sorted(cells.items())
        total, left = sum(cells.values()), sum(cells.values())
        x, y = [], []
        for us, count in ordered:
            left -= count
            x.append(max(us, 0.1))
            y.append(max(left, 0.5) / total)
        axes.loglog(x, y, label=LABELS[name], drawstyle="steps-post", ls=LINES[name])
    axes.set(
        xlabel="lateness [us]",
        ylabel="share of the ticks that came later",
        title=f"Punctuality at {rate:g} Hz",
    )
    axes.grid(True, which="major", alpha=0.4)
    axes.legend()
    figure.tight_layout()
    save(figure, path)
    plt.close(figure)


def run(rate: float, rounds: int, seconds: float, plot: Path | None, as_json: bool) -> None:
    """Measure and print."""

    def progress(text: str) -> None:
        sys.stderr.write(f"\r\x1b[K{text}" if sys.stderr.isatty() else f"{text}\n")

    if plot:
        pyplot()  # before the work, not after it
    if not shutil.which("cyclictest"):
        progress("cyclictest is not installed and left out; sudo apt install rt-tests\n")
    found = measure(rate, rounds, seconds, progress)
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K")
    for warning in sorted({w for done in found.values() for r in done for w in r.warnings}):
        print(f"warning: {warning}", file=sys.stderr)
    figures = summarise(found)
    if plot:
        draw(found, rate, plot)
    if as_json:
        print(json.dumps({"rate_hz": rate, "rounds": rounds, **figures}))
        return
    print(f"{rate:g} Hz, {rounds} rounds of {seconds:g} s")
    print(table(figures))
    if plot:
        print(f"plot: {plot}")


def main(arguments: Sequence[str]) -> None:
    """One contender of one round; its ``Round`` goes to standard output."""
    name, rate, ticks = arguments
    settle_memory()
    stay_awake()
    granted = become_realtime(DAEMON_PRIORITY)
    found = CONTENDERS[name](float(rate), int(ticks))
    found.warnings = granted.lost
    sys.stdout.buffer.write(msgspec.json.encode(found))


if __name__ == "__main__":
    main(sys.argv[1:])
