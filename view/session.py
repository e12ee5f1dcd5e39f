"""A recorded session in few columns: what a report is drawn from, read in one pass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..models import Array
from ..runtime.configuration.session import Session, build
from ..runtime.core.machine import near
from ..runtime.core.modes import Mode
from ..runtime.recording.channels import Channels, Group, measured
from ..runtime.recording.log import Log, LoggedEvent
from ..runtime.recording.summary import Report, Summary
from ..runtime.timing.forensics import LateTick
from .decimate import Decimator
from .work import Work

COLUMNS = 480
"""Of a plot, at most."""


@dataclass(slots=True)
class Recorded:
    """A session as it was read.

    Attributes:
        log: the recording.
        session: what it was a session of.
        channels: its channels.
        columns: their values over time, and last of all the work of the hand [J] where that is known.
        worked: whether it is.
        modes: mode, and the ticks from and to which it lasted.
        events, late: in the order of the recording.
        summary: of all ticks.
        lateness, compute: upper edge [us] and count of every bucket.
    """

    log: Log
    session: Session
    channels: Channels
    columns: Decimator
    worked: bool
    modes: list[tuple[Mode, int, int]] = field(default_factory=list)
    events: list[LoggedEvent] = field(default_factory=list)
    late: list[LateTick] = field(default_factory=list)
    summary: Report | None = None
    lateness: list[tuple[float, int]] = field(default_factory=list)
    compute: list[tuple[float, int]] = field(default_factory=list)

    @property
    def rate(self) -> float:
        """Of the loop [Hz]."""
        return float(self.session.config.loop.rate)

    @property
    def seconds(self) -> float:
        """From the first tick to the last [s]."""
        return self.modes[-1][2] / self.rate if self.modes else 0.0

    def touched(self, channel: int) -> Array:
        """Which end of its limit a channel touched in each column: -1, 1, 0 for none; (columns,)."""
        spec = self.channels.specs[channel]
        low, high = self.columns.low[:, channel], self.columns.high[:, channel]
        close = near(spec.lower, spec.upper)
        return np.where(low <= spec.lower + close, -1, np.where(high >= spec.upper - close, 1, 0))


def read(log: Log, progress: Callable[[int], None] = lambda _: None) -> Recorded:
    """Everything that a report shows.

    Args:
        log: the recording.
        progress: is told how many ticks were read.

    Raises:
        LogError: the recording is damaged.
        ConfigError, ModelError: its machine cannot be built here.
    """
    session = build(log.loaded, runs=False)
    channels = Channels(session)
    scene = session.system.scene(session.config) if session.system.scene else None
    work = Work(session.robot, scene) if scene else None
    columns = Decimator(len(channels.specs) + (work is not None), COLUMNS)
    found = Recorded(log, session, channels, columns, work is not None)
    summary, before = Summary.of(session), int(Mode.BRINGUP)
    row = np.zeros(len(channels.specs) + (work is not None))
    for count, record in enumerate(log.records(), 1):
        fixed = record.fixed
        tick, mode = int(fixed["tick"]), int(fixed["mode"])
        summary.add(fixed)
        _add_mode(found.modes, Mode(mode), tick)
        if measured(before):
            row[: len(channels.specs)] = channels.values(fixed)
            if work:
                row[-1] = work.add(fixed["state"])
            columns.add(tick, row)
        before = mode
        progress(count)
    found.events += log.events()
    found.late += log.late_ticks()
    for late in found.late:
        summary.add_late(late)
    found.summary = summary.report(0)
    found.lateness, found.compute = summary.lateness.cells(), summary.compute.cells()
    return found


def _add_mode(modes: list[tuple[Mode, int, int]], mode: Mode, tick: int) -> None:
    if modes and modes[-1][0] is mode:
        modes[-1] = (mode, modes[-1][1], tick + 1)
    else:
        modes.append((mode, modes[-1][2] if modes else tick, tick + 1))


def group(found: Recorded, which: Group) -> range:
    """Where the channels of a group stand."""
    place = found.channels.groups[which]
    return range(place.start, place.stop)
