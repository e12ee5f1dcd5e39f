"""What a session came to: ticks, punctuality, cost, modes, and the limits it touched."""

from __future__ import annotations

import textwrap
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import inf, isfinite, nan
from typing import Any

import msgspec
import numpy as np

from ...configs.words import counted
from ...safety import Reaction
from ..configuration.session import Session
from ..core.machine import FigureSpec, LimitSpec, MachineFigures, MachineLimits
from ..core.modes import Mode
from ..core.stages import Stage
from ..core.stops import END
from ..timing.forensics import KEPT, LateTick
from ..timing.histogram import Histogram, Histograms
from ..timing.vitals import Vitals
from ..timing.watch import Overstay
from .record import head


@dataclass(slots=True)
class Extent:
    """The range a measured value covered, against its limit."""

    spec: LimitSpec
    low: float = inf
    high: float = -inf
    last: float = nan

    def add(self, value: float) -> None:
        """Take one measurement."""
        self.last = value
        if value < self.low:
            self.low = value
        if value > self.high:
            self.high = value

    @property
    def touching(self) -> bool:
        """Whether the last measurement is at an end."""
        return self.last <= self.spec.lower + self.spec.near or self.last >= self.spec.upper - self.spec.near

    @property
    def touched(self) -> str:
        """Which ends were reached: "", "lower", "upper" or "both"."""
        near = self.spec.near
        lower, upper = self.low <= self.spec.lower + near, self.high >= self.spec.upper - near
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


class FigureReport(msgspec.Struct, frozen=True):
    """A figure of the machine over the ticks that were controlled; in the unit named."""

    name: str
    unit: str
    mean: float
    max: float


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
    figures: list[FigureReport]
    modes: dict[str, int]
    stop: str
    frames_missing: int
    put_right: int
    late: int
    late_ticks: list[LateTick]
    overstays: list[OverstayReport]
    vitals: Vitals
    limits: list[LimitReport]
    led: bool = False


@dataclass(slots=True)
class Figure:
    """Mean and maximum of a number."""

    spec: FigureSpec
    total: float = 0.0
    most: float = -inf
    ticks: int = 0

    def add(self, value: float) -> None:
        """Take one tick's."""
        self.total += value
        self.most = max(self.most, value)
        self.ticks += 1

    def report(self) -> FigureReport:
        """The figure over the ticks so far, at least one."""
        mean = self.total / self.ticks
        return FigureReport(self.spec.name, self.spec.unit, round(mean, 4), round(self.most, 4))


@dataclass(slots=True)
class Summary:
    """Collects a session, tick by tick.

    Attributes:
        limits: what the machine may touch.
        figures: of the machine.
        rate: of the loop [Hz].
        expected: devices that should answer in every tick.
        measured: whether the last tick knew where the machine is; during bring-up none does.
        led: whether a person took the simulated hand from the script.
        blamed: what made ticks late, how many each.
    """

    limits: MachineLimits
    figures: MachineFigures
    rate: float
    expected: int
    ticks: int = 0
    skipped: int = 0
    stop: str = ""
    missing: int = 0
    discarded: int = 0
    put_right: int = 0
    last: np.void | None = None
    measured: bool = False
    led: bool = False
    _mode: int = Mode.BRINGUP
    lateness: Histogram = field(default_factory=Histogram)
    compute: Histogram = field(default_factory=Histogram)
    stages: Histograms = field(default_factory=lambda: Histograms(len(Stage)))
    modes: Counter[int] = field(default_factory=Counter)
    late: int = 0
    blamed: Counter[str] = field(default_factory=Counter)
    late_ticks: deque[LateTick] = field(default_factory=lambda: deque(maxlen=KEPT))
    overstays: dict[str, OverstayReport] = field(default_factory=dict)
    vitals: Vitals = field(default_factory=Vitals)
    extents: list[Extent] = field(init=False)
    counted: list[Figure] = field(init=False)

    def __post_init__(self) -> None:
        self.extents = [Extent(spec) for spec in self.limits.specs]
        self.counted = [Figure(spec) for spec in self.figures.specs]

    @classmethod
    def of(cls, session: Session) -> Summary:
        """An empty one, for this machine."""
        system, config = session.system, session.config
        return cls(
            system.limits(config), system.figures(config), config.loop.rate, session.cycle.image.expected
        )

    def add(self, fixed: np.void) -> None:
        """Take the fixed part of a tick's record."""
        # the tick that ends bring-up has not measured yet
        self.measured = self._mode not in (Mode.BRINGUP, Mode.FAILED)
        self.last = fixed
        self.ticks += 1
        said = head(fixed)
        self.skipped += said["skipped"]
        mode = self._mode = said["mode"]
        self.modes[mode] += 1
        self.discarded += said["discarded"]
        self.lateness.add(said["lateness_ns"])
        self.compute.add(said["compute_ns"])
        if not self.measured:
            return
        self.missing += self.expected - said["working_counter"]
        self.put_right += said["reaction"] == Reaction.SANITISE
        reason = said["reason"].rstrip(b"\0").decode() if said["latched"] else ""
        self.stop = reason if reason != END else ""
        state = fixed["state"]
        if mode in (Mode.ENGAGING, Mode.ACTIVE):
            self.stages.add(said["stage_ns"])
            for figure, value in zip(self.counted, self.figures.values(state), strict=True):
                figure.add(value)
        for extent, value in zip(self.extents, self.limits.values(state), strict=True):
            extent.add(value)

    def add_late(self, late: LateTick) -> None:
        """Take a late tick."""
        self.late += 1
        self.blamed[late.cause] += 1
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
            stages_us={stage.name.lower(): self.stages.each[stage].summary() for stage in Stage},
            figures=[figure.report() for figure in self.counted if figure.ticks],
            modes={Mode(mode).name: count for mode, count in sorted(self.modes.items())},
            stop=self.stop,
            frames_missing=self.missing,
            put_right=self.put_right,
            late=self.late,
            late_ticks=list(self.late_ticks),
            overstays=list(self.overstays.values()),
            vitals=self.vitals,
            limits=[_limit_report(extent) for extent in self.extents if extent.low <= extent.high],
            led=self.led,
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


WIDTH = 79
"""Columns of the summary for people: a terminal has 80."""


def table(report: Report) -> str:
    """The summary for people."""
    lines = [
        f"{counted(report.ticks, 'tick')} at {report.rate_hz:g} Hz, {report.skipped} skipped"
        + (f", {report.shed} not recorded" if report.shed else "")
        + f"; {counted(report.frames_missing, 'frame')} missing, something put right in {report.put_right}"
    ]
    seconds = {mode: count / report.rate_hz for mode, count in report.modes.items()}
    lines.append("modes: " + ", ".join(f"{mode} {span:.4g} s" for mode, span in seconds.items()))
    if report.compute_us["max"]:  # virtual time has neither lateness nor cost
        lines += _timing_lines(report)
        lines += _lateness_lines(report)
    if report.figures:
        lines.append(f"{'per tick':24}{'mean':>10}{'largest':>10}")
        lines += map(_figure_line, report.figures)
    if report.limits:
        lines.append(f"{'limit':19}{'lowest':>8}{'highest':>9}  {'allowed':20}{'touched':9}worst excess")
        lines += map(_limit_line, report.limits)
    if report.stop:
        lines.append(f"stopped: {report.stop}")
    return "\n".join(wrapped for line in lines for wrapped in _fitting(line))


def _fitting(line: str) -> list[str]:
    return (
        textwrap.wrap(line, WIDTH, subsequent_indent="  ", break_on_hyphens=False)
        if len(line) > WIDTH
        else [line]
    )


def _timing_lines(report: Report) -> Iterator[str]:
    yield f"{'microseconds':14}{'mean':>9}{'p50':>9}{'p99':>9}{'p99.9':>9}{'max':>10}"
    stages = [(f"  {name}", row) for name, row in report.stages_us.items()]
    for name, row in [("tick late by", report.lateness_us), ("tick took", report.compute_us), *stages]:
        columns = "".join(f"{row[key]:9.1f}" for key in ("mean", "p50", "p99", "p999"))
        yield f"{name:14}{columns}{row['max']:10.1f}"


def _lateness_lines(report: Report) -> Iterator[str]:
    if report.late:
        causes = Counter(late.cause for late in report.late_ticks)
        shown = f" (of the last {KEPT})" if report.late > KEPT else ""
        yield f"{counted(report.late, 'tick')} came or ended late{shown}:"
        yield from (f"  {count} x {cause}" for cause, count in causes.most_common(4))
    blamed = {late.cause for late in report.late_ticks}
    for o in report.overstays:
        if o.where not in blamed:  # it cost no tick
            continue
        yield f"overstayed: {o.where}, {o.count} times, at most {o.worst_us:.0f} us of {o.budget_us:.0f} us"
    v = report.vitals
    yield (
        f"{v.minor_faults} minor and {v.major_faults} major page faults since arming,"
        f" memory grew by {v.rss_growth_kib} KiB, {v.threads} thread{'s' * (v.threads > 1)}"
    )


def _figure_line(figure: FigureReport) -> str:
    return f"{figure.name:24}{figure.mean:10.3g}{figure.max:10.4g} {figure.unit}".rstrip()


def _limit_line(limit: LimitReport) -> str:
    small = f"m{limit.unit}"
    lower = "" if limit.lower is None else f"{limit.lower:g} "
    upper = "" if limit.upper is None else f"to {limit.upper:g} "
    allowed = f"{lower}{upper}{limit.unit}" if lower or upper else f"any {limit.unit}"
    excess = f"{1e3 * limit.excess:.2f} {small}" if limit.touched and limit.excess is not None else ""
    return (
        f"{limit.name:19}{limit.low:8.3f}{limit.high:9.3f}  {allowed:19} {limit.touched or '-':9}{excess}"
    ).rstrip()


def as_json(report: Report, **extra: Any) -> str:
    """The summary as one JSON object."""
    return msgspec.json.encode({**msgspec.to_builtins(report), **extra}).decode()
