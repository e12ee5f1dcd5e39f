"""Why a tick was late: what ran before it, what it did itself, and what the kernel did to it."""

from __future__ import annotations

import os

import msgspec

from .._rt import ffi, lib
from ..core.stages import Stage, Stages
from .slack import pause
from .watch import Watch

LATE_SHARE = 0.25
"""Share of the period by which a tick may be woken late before it counts as late."""
HEAVY_SHARE = 0.5
"""Share of the delay or period that makes something its cause."""
HOST_S = 1.0
"""Between two looks at what the hypervisor took."""
JIFFY_US = 1e4
"""Unit of /proc/stat."""
KEPT = 100
"""Late ticks that a session's summary keeps."""


class LateTick(msgspec.Struct, frozen=True):
    """A tick that came late, ended late, or did not come at all; durations in microseconds.

    Attributes:
        tick: index on the grid.
        skipped: ticks before it that did not run.
        waited: as many of them the simulated plant had not answered.
        lateness_us: of its beginning.
        compute_us: until its frames were sent.
        stages_us: where that time went.
        callbacks: what else ran since the tick before, with its duration.
        minor_faults, major_faults: pages that had to be mapped, or read from disk.
        preempted: times that another process was given the processor.
        stolen_us: what the hypervisor took from this host's processors since the last look but one, a second
            or two ago where there is time.
        cause: the most likely one, for people.
    """

    tick: int
    skipped: int
    waited: int
    lateness_us: float
    compute_us: float
    stages_us: dict[str, float]
    callbacks: list[tuple[str, float]]
    minor_faults: int
    major_faults: int
    preempted: int
    stolen_us: float
    cause: str


class Forensics:
    """Looks at every tick, and closer at the late ones."""

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._usage, self._before = ffi.new("rt_usage *"), ffi.new("rt_usage *")
        lib.rt_usage_read(self._before)
        self._steal = _Steal()

    def look(
        self,
        tick: int,
        skipped: int,
        waited: int,
        lateness_ns: int,
        stages: Stages,
        watch: Watch,
    ) -> LateTick | None:
        """What is to be said of a tick; None for a punctual one. Call at the end of each.

        Args:
            tick: index on the grid.
            skipped: ticks before it that did not run, ``waited`` of them to wait for the simulated plant.
            waited: see there.
            lateness_ns: of its beginning.
            stages: its durations.
            watch: what ran since the last tick.
        """
        ran = watch.take()
        now, before = self._usage, self._before
        lib.rt_usage_read(now)
        self._usage, self._before = before, now
        late = skipped or lateness_ns > LATE_SHARE * self._period_ns
        if not late and lateness_ns + stages.elapsed_ns <= self._period_ns:
            return None
        ns = stages.ns
        found = LateTick(
            tick=tick,
            skipped=skipped,
            waited=waited,
            lateness_us=lateness_ns / 1e3,
            compute_us=stages.elapsed_ns / 1e3,
            stages_us={stage.name.lower(): ns[stage] / 1e3 for stage in Stage},
            callbacks=[(where, ns / 1e3) for where, ns in ran],
            minor_faults=now.minor_faults - before.minor_faults,
            major_faults=now.major_faults - before.major_faults,
            preempted=now.preemptions - before.preemptions,
            stolen_us=self._steal.recent(),
            cause="",
        )
        return msgspec.structs.replace(found, cause=cause(found, self._period_ns / 1e3))

    async def watch_host(self) -> None:
        """Supervisory work: keeps what the hypervisor took up to date."""
        while True:
            self._steal.look()
            await pause(HOST_S)


def cause(late: LateTick, period_us: float) -> str:
    """The most likely reason for a late tick."""
    delay = (late.skipped - late.waited) * period_us + late.lateness_us
    callbacks = sum(us for _, us in late.callbacks)
    stage, longest = max(late.stages_us.items(), key=lambda item: item[1])
    if late.waited and late.waited == late.skipped:
        return "the simulated plant had not answered"
    if callbacks > HEAVY_SHARE * delay:
        return max(late.callbacks, key=lambda item: item[1])[0]
    if late.major_faults:
        return "pages had to be read from disk"
    if longest > HEAVY_SHARE * period_us:
        return f"stage {stage}, preempted by another process" if late.preempted else f"stage {stage}"
    if late.stolen_us:
        return "the hypervisor took the processor away"
    if late.preempted:
        return "another process had the processor"
    if delay > LATE_SHARE * period_us:
        return "the kernel woke it late"
    return "its own work"


class _Steal:
    """Time that the hypervisor gave to other guests, from /proc/stat."""

    def __init__(self) -> None:
        self._stat = os.open("/proc/stat", os.O_RDONLY | os.O_CLOEXEC)
        self._now = self._before = self._read()

    def look(self) -> None:
        self._before, self._now = self._now, self._read()

    def recent(self) -> float:
        """Stolen since the last look but one [us]."""
        return JIFFY_US * (self._read() - self._before)

    def _read(self) -> int:
        fields = os.pread(self._stat, 256, 0).split()  # "cpu user nice system idle iowait irq softirq steal"
        return int(fields[8]) if len(fields) > 8 else 0
