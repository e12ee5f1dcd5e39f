"""What viewers are given of a session: some tens of ticks in one frame, decimated where the ticks are."""

from __future__ import annotations

from time import monotonic_ns

import msgspec
import numpy as np

from ...devices.network import Network
from ...devices.safety_plc import DEAD_MAN, EMERGENCY_STOP
from ..configuration.session import Session
from ..core.events import Severity
from ..core.modes import Mode
from ..timing.histogram import Histogram
from .channels import Channels, measured

LEAST_US, BARS_PER_OCTAVE, BARS = 1.0, 2, 36
"""Bars of the published histograms: the first one ends at 1 us, the last one takes whatever is longer."""
MOST_EVENTS = 20
"""Events in a frame; older ones are left to the log, and counted."""


class Said(msgspec.Struct, array_like=True):
    """An event: tick, severity, text."""

    tick: int
    severity: str
    text: str


class Stored(msgspec.Struct):
    """How the recording does.

    Attributes:
        written: bytes of it that the disk took.
        waiting: bytes that the recorder has not taken from the session yet.
        room: bytes that may wait before records are lost.
        free: bytes that the disk still takes.
    """

    written: int
    waiting: int
    room: int
    free: int


class Frame(msgspec.Struct, kw_only=True):
    """Some ticks.

    Attributes:
        tick: the last of them; ticks: how many since the last frame.
        published_ns: monotonic clock when it was made.
        mode: its name.
        stop: reason of the stop that is latched, empty for none.
        pressed, e_stop_closed: the dead-man switch, the emergency stop; None before they were measured.
        since: tick of this session since which the dead-man switch is as it is.
        received: frames that came over the bus in this session.
        stored: of a session that is being recorded, see ``Stored``.
        doing: what the machine says of itself now, see ``MachineFigures.live``.
        posture: of the model's joints (nv,) [rad or m]; empty before it was measured, as all that follow.
        wrench: of the hand on the machine (6,) [N, N m].
        twin: its place (3,) [m]; None without one.
        demand: force that a machine whose strength is drawn is asked for (3,) [N]; empty for others.
        low, high, mean: of the channels, in their order; no finite number where there was no value.
        lateness, compute: counts of the session so far in bars of half octaves; empty in most frames.
        counts: what the session lost, by name.
        events: what was said since the last frame.
    """

    tick: int
    ticks: int
    published_ns: int
    mode: str
    stop: str = ""
    pressed: bool | None = None
    e_stop_closed: bool | None = None
    since: int = 0
    received: int = 0
    stored: Stored | None = None
    doing: list[str] = []
    posture: list[float] = []
    wrench: list[float] = []
    twin: list[float] | None = None
    demand: list[float] = []
    low: list[float] = []
    high: list[float] = []
    mean: list[float] = []
    lateness: list[int] = []
    compute: list[int] = []
    counts: dict[str, int] = {}
    events: list[Said] = []


class FrameMaker:
    """Takes the ticks and events of a session, and gives a frame of them whenever one is due."""

    def __init__(self, session: Session) -> None:
        config, system = session.config, session.system
        self.channels = Channels(session)
        self._scene, self._figures = system.scene(config) if system.scene else None, system.figures(config)
        self._safety = safety_inputs(session.network)
        count = len(self.channels.specs)
        self._low, self._high, self._sum = np.empty(count), np.empty(count), np.empty(count)
        self._last: np.void | None = None
        self._before = int(Mode.BRINGUP)
        self._known = False
        self._received, self._pressed, self._since = 0, False, 0
        self._events: list[Said] = []
        self._forget()

    def tick(self, fixed: np.void) -> None:
        """Take the fixed part of a tick's record."""
        self._last = fixed
        self._ticks += 1
        self._received += int(fixed["frames"])
        pressed = self._dead_man(fixed)
        if pressed != self._pressed:
            self._pressed, self._since = pressed, int(fixed["tick"])
        self._known = measured(self._before)
        if self._known:
            row = np.array(self.channels.values(fixed))
            np.fmin(self._low, row, out=self._low)  # what is not rendered has no value
            np.fmax(self._high, row, out=self._high)
            self._sum += row
            self._rows += 1
        self._before = int(fixed["mode"])

    def event(self, tick: int, severity: Severity | str, text: str) -> None:
        """Take what people are told."""
        self._events.append(Said(tick, str(severity), text))

    def take(self, counts: dict[str, int], histograms: tuple[Histogram, Histogram] | None) -> Frame | None:
        """The frame of what came since the last one; None where no tick did.

        Args:
            counts: of what was lost, by name.
            histograms: of lateness and compute time, where they are to go along.
        """
        last = self._last
        if last is None or not self._ticks:
            return None
        lost = len(self._events) - MOST_EVENTS
        frame = Frame(
            tick=int(last["tick"]),
            ticks=self._ticks,
            published_ns=monotonic_ns(),
            mode=Mode(int(last["mode"])).name,
            stop=last["reason"].decode() if last["latched"] else "",
            since=self._since,
            received=self._received,
            counts={**counts, "events left out": lost} if lost > 0 else counts,
            events=self._events[-MOST_EVENTS:],
        )
        if histograms:
            frame.lateness, frame.compute = (bars(each) for each in histograms)
        if self._rows and self._known:
            self._measure(frame, last)
        self._forget()
        return frame

    def _measure(self, frame: Frame, last: np.void) -> None:
        inputs = last["raw"][self._safety]
        frame.pressed = self._pressed
        frame.e_stop_closed = bool((inputs & EMERGENCY_STOP == EMERGENCY_STOP).all())
        frame.low, frame.high = self._low.tolist(), self._high.tolist()
        frame.mean = (self._sum / self._rows).tolist()
        state = last["state"]
        frame.doing = list(self._figures.live(Mode(int(last["mode"])), state))
        if self._scene:
            frame.posture, frame.wrench = list(self._scene.posture(state)), list(self._scene.wrench(state))
            twin = self._scene.twin(state)
            frame.twin = None if twin is None else list(twin)
            if self._scene.strength:
                frame.demand = list(self._scene.strength.demand(state))

    def _dead_man(self, fixed: np.void) -> bool:
        """Whether every safety controller says that it is pressed."""
        return all(bits & DEAD_MAN == DEAD_MAN for bits in fixed["raw"][self._safety].tolist())

    def _forget(self) -> None:
        self._ticks = self._rows = 0
        self._low.fill(np.inf)
        self._high.fill(-np.inf)
        self._sum.fill(0.0)
        self._events = []


def bars(histogram: Histogram) -> list[int]:
    """Counts in bars of half octaves from 1 us on."""
    counts = [0] * BARS
    for edge, count in histogram.cells():
        octaves = np.log2(max(edge, LEAST_US) / LEAST_US)
        counts[min(BARS - 1, int(np.ceil(BARS_PER_OCTAVE * octaves - 1e-9)))] += count
    return counts


def safety_inputs(network: Network) -> list[int]:
    """Where the raw process image has the inputs of the safety PLCs: the byte of the switches."""
    return [
        place.raw
        for place in network.inputs
        if network.devices[place.device].group == "safety" and place.field and place.field.field == "inputs"
    ]
