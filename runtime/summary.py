"""What a session came to: ticks, punctuality, cost, modes, and the limits it touched."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import Any

import msgspec
import numpy as np

from ..safety import Reaction
from .cycle import END
from .forensics import KEPT, LateTick
from .histogram import Histogram
from .machine import LimitSpec, MachineLimits
from .modes import Mode
from .stages import Stage
from .vitals import Vitals
from .watch import Overstay

NEAR = 5e-3
"""A measured value this close to a limit touches it [rad, m or N m]."""


@dataclass(slots=True)
class Extent:
    """The range a measured value covered, against its limit."""

    spec: LimitSpec
    low: float = inf
    high: float = -inf

    def add(self, value: float) -> None:
        """Take one measurement."""
        if value < self.low:
            self.low = value
        if value > self.high:
            self.high = value

    @property
    def touched(self) -> str:
        """Which ends were reached: "", "lower", "upper" or "both"."""
        lower, upper = self.low <= self.spec.lower + NEAR, self.high >= self.spec.upper - NEAR
        return "both" if lower and upper else "lower" if lower else "upper" if upper else ""

    @property
    def excess(self) -> float:
        """How far beyond its limits the value went; negative where it stayed inside."""
        return max(self.spec.lower - self.low, self.high - self.spec.upper)


class LimitReport(msgspec.Struct, frozen=True):
    """A limit in the summary; lengths and angles in the unit named."""

    name: str
    unit: str
    low: float
    high: float
    lower: float | None
    upper: float | None
    touched: str
    excess: float | None


class OverstayReport(msgspec.Struct, frozen=True):
    """A callback that took longer than it may: how often, and the worst time [us]."""

    where: str
    count: int
    worst_us: float
    budget_us: float


class Report(msgspec.Struct, frozen=True):
    """The summary of a session as data; durations in microseconds."""

    ticks: int
    skipped: int
    shed: int
    rate_hz: float
    lateness_us: dict[str, float]
    compute_us: dict[str, float]
    stages_us: dict[str, dict[str, float]]
    iterations: dict[str, float]
    solves: dict[str, float]
    modes: dict[str, int]
    stop: str
    coupling_mm: float
    coupling_mrad: float
    frames_missing: int
    clamped: int
    late: int
    late_ticks: list[LateTick]
    overstays: list[OverstayReport]
    vitals: Vitals
    limits: list[LimitReport]


@dataclass(slots=True)
class Count:
    """Mean and maximum of a small number over the ticks that were solved."""

    total: int = 0
    most: int = 0
    ticks: int = 0

    def add(self, value: int) -> None:
        """Take one tick's."""
        self.total += value
        self.most = max(self.most, value)
        self.ticks += 1

    def summary(self) -> dict[str, float]:
        """Mean and max."""
        return {"mean": round(self.total / self.ticks, 4) if self.ticks else 0.0, "max": self.most}


@dataclass(slots=True)
class Summary:
    """Collects a session, tick by tick.

    Attributes:
        limits: what the machine may touch.
        rate: of the loop [Hz].
        expected: devices that should answer in every tick.
    """

    limits: MachineLimits
    rate: float
    expected: int
    ticks: int = 0
    skipped: int = 0
    stop: str = ""
    coupling: tuple[float, float] = (0.0, 0.0)
    missing: int = 0
    clamped: int = 0
    last: np.void | None = None
    lateness: Histogram = field(default_factory=Histogram)
    compute: Histogram = field(default_factory=Histogram)
    stages: list[Histogram] = field(default_factory=lambda: [Histogram() for _ in Stage])
    iterations: Count = field(default_factory=Count)
    solves: Count = field(default_factory=Count)
    modes: Counter[int] = field(default_factory=Counter)
    late: int = 0
    late_ticks: deque[LateTick] = field(default_factory=lambda: deque(maxlen=KEPT))
    overstays: dict[str, OverstayReport] = field(default_factory=dict)
    vitals: Vitals = field(default_factory=Vitals)
    extents: list[Extent] = field(init=False)

    def __post_init__(self) -> None:
        self.extents = [Extent(spec) for spec in self.limits.specs]

    def add(self, fixed: np.void) -> None:
        """Take the fixed part of a tick's record."""
        self.last = fixed
        self.ticks += 1
        self.skipped += int(fixed["skipped"])
        mode = int(fixed["mode"])
        self.modes[mode] += 1
        self.lateness.add(int(fixed["lateness_ns"]))
        self.compute.add(int(fixed["compute_ns"]))
        if mode in (Mode.BRINGUP, Mode.FAILED):
            return
        self.missing += self.expected - int(fixed["working_counter"])
        self.clamped += int(fixed["reaction"]) == Reaction.SANITISE
        reason = fixed["reason"].decode()
        self.stop = reason if fixed["latched"] and reason != END else ""
        state = fixed["state"]
        if mode in (Mode.ENGAGING, Mode.ACTIVE):
            for histogram, ns in zip(self.stages, fixed["stage_ns"].tolist(), strict=True):
                histogram.add(ns)
            self.iterations.add(int(state["iterations"]))
            self.solves.add(int(state["solves"]))
            distance, angle = self.limits.coupling(state)
            self.coupling = (max(self.coupling[0], distance), max(self.coupling[1], angle))
        for extent, value in zip(self.extents, self.limits.values(state), strict=True):
            extent.add(value)

    def add_late(self, late: LateTick) -> None:
        """Take a late tick."""
        self.late += 1
        self.late_ticks.append(late)

    def add_overstay(self, overstay: Overstay) -> bool:
        """Take a callback that overstayed; whether it is the first of its kind."""
        known = self.overstays.get(overstay.where)
        count, worst = (known.count, known.worst_us) if known else (0, 0.0)
        self.overstays[overstay.where] = OverstayReport(
            overstay.where, count + 1, max(worst, overstay.us), overstay.budget_us
        )
        return known is None

    def report(self, shed: int) -> Report:
        """The session so far; ``shed`` records did not reach this summary."""
        return Report(
            ticks=self.ticks,
            skipped=self.skipped,
            shed=shed,
            rate_hz=float(self.rate),
            lateness_us=self.lateness.summary(),
            compute_us=self.compute.summary(),
            stages_us={stage.name.lower(): self.stages[stage].summary() for stage in Stage},
            iterations=self.iterations.summary(),
            solves=self.solves.summary(),
            modes={Mode(mode).name: count for mode, count in sorted(self.modes.items())},
            stop=self.stop,
            coupling_mm=round(1e3 * self.coupling[0], 3),
            coupling_mrad=round(1e3 * self.coupling[1], 3),
            frames_missing=self.missing,
            clamped=self.clamped,
            late=self.late,
            late_ticks=list(self.late_ticks),
            overstays=list(self.overstays.values()),
            vitals=self.vitals,
            limits=[_limit_report(extent) for extent in self.extents if extent.low <= extent.high],
        )


def _limit_report(extent: Extent) -> LimitReport:
    spec = extent.spec
    return LimitReport(
        name=spec.name,
        unit=spec.unit,
        low=extent.low,
        high=extent.high,
        lower=float(spec.lower) if isfinite(spec.lower) else None,
        upper=float(spec.upper) if isfinite(spec.upper) else None,
        touched=extent.touched,
        excess=extent.excess if isfinite(extent.excess) else None,
    )


def table(report: Report) -> str:
    """The summary for people."""
    lines = [
        f"{report.ticks} ticks at {report.rate_hz:g} Hz, {report.skipped} skipped"
        + (f", {report.shed} not recorded" if report.shed else "")
        + f"; {report.frames_missing} frames missing, {report.clamped} ticks sanitised",
    ]
    if report.compute_us["max"]:  # virtual time has neither lateness nor cost
        lines += _timing_lines(report)
        lines += _lateness_lines(report)
    lines.append(
        f"HQP iterations {report.iterations['mean']:.3g} a tick (most {report.iterations['max']:g}),"
        f" solves {report.solves['mean']:.3g} (most {report.solves['max']:g});"
        f" coupling error at most {report.coupling_mm:g} mm, {report.coupling_mrad:g} mrad"
    )
    lines.append("modes: " + ", ".join(f"{mode} {count}" for mode, count in report.modes.items()))
    if report.limits:
        lines.append(f"{'limit':20}{'lowest':>10}{'highest':>10}   {'allowed':20}{'touched':9}worst excess")
        lines += map(_limit_line, report.limits)
    if report.stop:
        lines.append(f"stopped: {report.stop}")
    return "\n".join(lines)


def _timing_lines(report: Report) -> Iterator[str]:
    yield f"{'':14}{'mean':>9}{'p50':>9}{'p99':>9}{'p99.9':>9}{'max':>10}"
    stages = [(f"  {name}", row) for name, row in report.stages_us.items()]
    for name, row in [("lateness us", report.lateness_us), ("compute us", report.compute_us), *stages]:
        columns = "".join(f"{row[key]:9.1f}" for key in ("mean", "p50", "p99", "p999"))
        yield f"{name:14}{columns}{row['max']:10.1f}"


def _lateness_lines(report: Report) -> Iterator[str]:
    if report.late:
        causes = Counter(late.cause for late in report.late_ticks)
        listed = "; ".join(f"{count} x {cause}" for cause, count in causes.most_common(4))
        shown = f" (of the last {KEPT})" if report.late > KEPT else ""
        yield f"{report.late} ticks came or ended late{shown}: {listed}"
    for o in report.overstays:
        yield f"overstayed: {o.where}, {o.count} times, at most {o.worst_us:.0f} us of {o.budget_us:.0f} us"
    v = report.vitals
    yield (
        f"{v.minor_faults} minor and {v.major_faults} major page faults since arming,"
        f" memory grew by {v.rss_growth_kib} KiB, {v.threads} thread{'s' * (v.threads > 1)}"
    )


def _limit_line(limit: LimitReport) -> str:
    small = f"m{limit.unit}"
    lower = "-inf" if limit.lower is None else f"{limit.lower:g}"
    upper = "inf" if limit.upper is None else f"{limit.upper:g}"
    excess = f"{1e3 * limit.excess:.2f} {small}" if limit.touched and limit.excess is not None else ""
    return (
        f"{limit.name:20}{limit.low:10.3f}{limit.high:10.3f}   "
        f"{f'{lower} to {upper} {limit.unit}':20}{limit.touched or '-':9}{excess}"
    )


def as_json(report: Report, **extra: Any) -> str:
    """The summary as one JSON object."""
    return msgspec.json.encode({**msgspec.to_builtins(report), **extra}).decode()
