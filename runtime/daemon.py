"""The live daemon: the fixed-rate loop around the cycle, with plant and recorder in their own processes."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import stat
import subprocess
import sys
import traceback
from pathlib import Path
from time import time_ns
from typing import Any

import msgspec

from ..devices.adapter import Adapter
from ..devices.frames import CAPACITY, Frames
from ..devices.image import COUNTERS
from ..devices.python_can import python_can
from ..devices.socket_adapter import SocketAdapter, socketcan
from .children import CHILD_LIMIT_S, Child, ChildError, reap, spawn, until_ready
from .config import Loaded
from .cycle import Inputs, Outputs, cycle
from .errors import HapticdError
from .forensics import Forensics
from .loop import FixedRate
from .modes import Command, Mode
from .notify import ServiceManager, Supervision
from .outcome import END_LIMIT_S, Outcome, outcome
from .phase_lock import PhaseLock
from .realtime import (
    DAEMON_PRIORITY,
    automatic_spin_ns,
    become_realtime,
    leave_cpu,
    settle_memory,
    stay_awake,
)
from .record import RecordWriter
from .recorder import EVENT, FINISH, LATE, OVERSTAY, TICK, VITALS
from .ring import Ring
from .sections import PythonCanBus, SimulatedBus, SocketCanBus
from .session import Session, build
from .slack import Slack, pause
from .stages import Stage, Stages
from .summary import Report
from .vitals import LOOK_NS, VitalSigns
from .warm_up import warm_up
from .watch import Overstay, Watch, WatchedLoop

START_DELAY_NS = 20_000_000
STALL_LIMIT_S = 1.0
"""How long a simulated plant may stall with its socket open before it counts as lost."""
RECORDER_S = 0.2
"""Between two looks at the recorder."""
BUS_S = 0.5
"""Between two looks at what the bus dropped."""
NOTEWORTHY = tuple(name for name in COUNTERS if name not in ("frames", "misses"))
"""Counters that a person hears of; missing frames have their own words."""
KEYS = {"s": Command.STOP, "r": Command.RESET, "a": Command.ARM}


class InternalError(HapticdError):
    """A mistake in this program."""

    code = "internal"


class NotRealtimeError(HapticdError):
    """A real machine is not run without what the kernel must grant (docs/fault-matrix.md, row 23)."""

    code = "realtime"


class Daemon:
    """One live session."""

    def __init__(self, loaded: Loaded, log: Path, duration: float | None, live: bool) -> None:
        self._stages = Stages()
        self._session: Session = build(loaded, self._stages.mark)
        self._rate = loaded.config.loop.rate
        self._duration_ticks = round(duration * self._rate) if duration is not None else None
        self._record_overruns = loaded.config.loop.on_overrun == "record"
        self._log, self._live = log, live
        self._inputs, self._outputs, self._received = Inputs(), Outputs(), Frames()
        self._pending = Command.NONE
        self._ending_since = -1
        self._stalled = 0
        self._unserved = 0
        self._crash: BaseException | None = None
        self._ring = Ring.create()
        self._writer = RecordWriter(self._session.memory)
        self._watch = Watch(self._overstayed)
        slack = Slack(self._watch, lambda text: self._event(self._rhythm.tick, f"warning: {text}"))
        self._rhythm = FixedRate(round(1e9 / self._rate), self._tick, slack=slack)
        self._lock = PhaseLock(self._rhythm.period_ns) if loaded.config.loop.sync == "bus" else None
        self._forensics, self._vitals = Forensics(self._rhythm.period_ns), VitalSigns()
        self._plant: Child | None = None
        memory = self._session.memory
        # the counter of the last SYNC proves a completed tick
        self._supervision = Supervision(
            ServiceManager(os.environ), lambda: memory.counter, lambda: memory.mode.name
        )
        self._done = asyncio.Event()

    async def run(self) -> Outcome:
        """From start-up to the summary."""
        loop = asyncio.get_running_loop()
        assert isinstance(loop, WatchedLoop)
        self._bus = self._open_bus()
        if self._lock and isinstance(self._bus, SocketAdapter):
            self._bus.stamp_arrivals()
        self._start_recorder()
        await self._until_children_are_ready()
        try:
            self._listen(loop)
            warm_up(self._session.loaded)
            settle_memory()
            self._become_realtime()
            slack = self._rhythm.slack
            slack.add(self._watch_recorder())
            slack.add(self._watch_bus())
            slack.add(self._forensics.watch_host(), LOOK_NS)
            slack.add(self._vitals.watch(), LOOK_NS)
            loop.watch = self._watch
            loop.set_exception_handler(self._crashed)
            self._rhythm.start(loop.add_tick, START_DELAY_NS)
            self._supervision.start(loop)
            await self._done.wait()
        except NotRealtimeError:
            self._collect()
            self._log.unlink()
            raise
        finally:
            self._rhythm.stop(loop.remove_reader)
            self._rhythm.slack.close()
            self._supervision.stop()
            self._lost = "the bus is gone: its interface or the plant died" if self._bus.closed else ""
            self._bus.close()
        if self._crash:  # nothing more is sent: the watchdogs of the drives stop the machine
            self._event(max(0, self._rhythm.tick), f"internal error: {self._crash!r}")
            self._conclude()
            raise InternalError(f"{self._crash!r}; the log {self._log} holds the session") from self._crash
        self._vitals.look()
        self._ring.push(VITALS + msgspec.json.encode(self._vitals.found))
        return self._conclude()

    async def _until_children_are_ready(self) -> None:
        try:
            await until_ready("recorder", self._recorder)
            if self._plant:
                await until_ready("plant", self._plant)
        except ChildError:
            for child in filter(None, (self._plant, self._recorder)):
                child.kill()
            self._log.unlink()
            raise

    def _become_realtime(self) -> None:
        wish = self._session.config.loop
        for child in filter(None, (self._plant, self._recorder)):
            leave_cpu(child.pid, wish.cpu)
        awake = "are kept awake" if stay_awake() else "may sleep between ticks as far as the host lets them"
        self._event(0, f"the processors {awake}")
        granted = become_realtime(DAEMON_PRIORITY, wish.cpu)
        automatic = automatic_spin_ns(granted, wish.cpu)
        self._rhythm.spin_ns = automatic if wish.spin is None else round(1e9 * wish.spin)
        simulated = isinstance(self._session.config.bus, SimulatedBus)
        if granted.lost and not simulated and not wish.best_effort:
            raise NotRealtimeError("; ".join([*granted.lost, "or write best_effort = true under [loop]"]))
        for warning in granted.lost:
            self._event(0, f"warning: {warning}")

    # ------------------------------------------------------------------------------- every tick

    def _tick(self) -> None:
        start = self._stages.begin()
        rhythm, inputs, outputs, memory = self._rhythm, self._inputs, self._outputs, self._session.memory
        self._bus.receive(self._received)
        inputs.frames.extend(self._received)
        if self._lock:
            self._follow(self._lock)
        self._stages.mark(Stage.RECEIVE)
        if self._waits_for_plant():
            self._unserved += 1 + rhythm.skipped
            return
        inputs.tick = rhythm.tick
        waited, self._unserved = self._unserved, 0
        inputs.skipped = rhythm.skipped + waited
        inputs.commands, self._pending = self._pending, Command.NONE
        cycle(inputs, memory, outputs)
        self._bus.send(outputs.frames)
        self._stages.mark(Stage.SEND)
        timing = (start - rhythm.deadline_ns, self._stages.elapsed_ns, self._stages.packed)
        self._ring.push(TICK + self._writer.write(inputs, outputs, timing))
        self._stages.mark(Stage.LOG)
        self._look_back(waited, timing[0])
        for text in outputs.events:
            self._event(inputs.tick, text)
        inputs.frames.clear()
        self._watch_end(inputs.tick)

    def _follow(self, lock: PhaseLock) -> None:
        """Keep the grid in phase with the bus clock."""
        assert isinstance(self._bus, SocketAdapter)
        was = lock.locked
        self._rhythm.shift(lock.update(self._rhythm.deadline_ns, self._bus.time_ns))
        if lock.locked != was:
            state = (
                "ticks follow the clock of the bus" if lock.locked else "no clock on the bus: running free"
            )
            self._event(self._rhythm.tick, state)

    def _look_back(self, waited: int, lateness_ns: int) -> None:
        """At the end of a tick: was it punctual, and is the machine armed?"""
        tick, skipped = self._inputs.tick, self._inputs.skipped
        late = self._forensics.look(tick, skipped, waited, lateness_ns, self._stages, self._watch)
        if late and self._session.memory.mode is not Mode.BRINGUP:
            self._ring.push(LATE + tick.to_bytes(8, "little") + msgspec.json.encode(late))
        if self._session.memory.mode is Mode.ENGAGING:
            self._vitals.armed()

    def _waits_for_plant(self) -> bool:
        """A simulated world stalls as a whole: no tick runs while the plant has not answered the last one."""
        if not (self._record_overruns and isinstance(self._bus, SocketAdapter)) or self._bus.closed:
            return False
        if self._session.memory.mode in (Mode.BRINGUP, Mode.FAILED):
            silent = self._bus.unread  # nobody has to answer yet
        else:
            silent = not self._inputs.frames.answers
        if not silent or len(self._inputs.frames) > CAPACITY:
            self._stalled = 0
            return False
        self._stalled += 1 + self._rhythm.skipped
        return self._stalled < STALL_LIMIT_S * self._rate

    def _watch_end(self, tick: int) -> None:
        mode = self._session.memory.mode
        if self._ending_since < 0:
            over = self._duration_ticks is not None and tick + 1 >= self._duration_ticks
            dead = self._bus.closed and not mode.powered  # while it is, the monitor stops the machine first
            if not (over or dead or mode is Mode.FAILED):
                return
            self.end()
        if not mode.powered or tick - self._ending_since > END_LIMIT_S * self._rate:
            self._done.set()

    def end(self) -> None:
        """Stop the machine, then the session."""
        if self._ending_since < 0:
            self._ending_since = max(0, self._rhythm.tick)
            self._pending |= Command.END

    # ------------------------------------------------------------------------------- around it

    def _open_bus(self) -> Adapter:
        match self._session.config.bus:
            case SimulatedBus():
                here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
                name = self._session.loaded.name
                self._plant = spawn("plant_process", [name, str(there.fileno())], [there.fileno()])
                there.close()
                return SocketAdapter(here)
            case SocketCanBus(interface=interface):
                return socketcan(interface)
            case PythonCanBus(interface=interface, channel=channel):
                return python_can(interface, channel)

    def _start_recorder(self) -> None:
        theirs, self._control = os.pipe()
        arguments = [
            self._session.loaded.name,
            str(self._log),
            str(self._ring.fd),
            str(theirs),
            str(time_ns()),
            "1" if self._live else "0",
        ]
        self._recorder = spawn("recorder", arguments, [self._ring.fd, theirs])
        os.close(theirs)

    def _listen(self, loop: asyncio.AbstractEventLoop) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self._interrupted)
        if _may_read_stdin():
            loop.add_reader(0, self._typed, loop)

    def _interrupted(self) -> None:
        if self._ending_since >= 0:  # the second time: do not wait for the machine
            self._done.set()
        self.end()

    def _typed(self, loop: asyncio.AbstractEventLoop) -> None:
        text = os.read(0, 4096).decode(errors="replace")
        if not text:
            loop.remove_reader(0)
        for word in text.split():
            if word[0] == "q":
                self.end()
            self._pending |= KEYS.get(word[0], Command.NONE)

    def _overstayed(self, overstay: Overstay) -> None:
        tick = max(0, self._rhythm.tick)
        self._ring.push(OVERSTAY + tick.to_bytes(8, "little") + msgspec.json.encode(overstay))

    def _crashed(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """An error that nobody expected ends the session at once."""
        error = context.get("exception") or RuntimeError(context["message"])
        traceback.print_exception(error)
        self._crash = self._crash or error
        self._done.set()

    async def _watch_recorder(self) -> None:
        """Supervisory work: a session whose recorder died says so at once and is not armed again."""
        while self._recorder.poll() is None:
            await pause(RECORDER_S)
        self._pending |= Command.UNRECORDED
        print("hapticd: the recorder died; this session is not recorded any more", file=sys.stderr)

    async def _watch_bus(self) -> None:
        """Supervisory work: what the bus dropped, and why, becomes an event."""
        image, bus = self._session.memory.image, self._bus
        columns = [COUNTERS.index(name) for name in NOTEWORTHY]
        before = [0] * (2 + len(columns))
        while True:
            counters = image.counters.tolist()
            now = [bus.unsent, bus.malformed, *(counters[k] for k in columns)]
            if now != before:
                names = ("unsent", "malformed", *NOTEWORTHY)
                moved = zip(names, now, before, strict=True)
                news = ", ".join(f"{new - old} {name}" for name, new, old in moved if new != old)
                self._event(max(0, self._rhythm.tick), f"bus: {news}")
                before = now
            await pause(BUS_S)

    def _event(self, tick: int, text: str) -> None:
        self._ring.push(EVENT + tick.to_bytes(8, "little") + text.encode())

    def _conclude(self) -> Outcome:
        report = self._collect()
        if self._plant:
            reap(self._plant)
        return outcome(self._session.memory, report, lost=self._lost)

    def _collect(self) -> Report | None:
        """The summary that the recorder gives once it is told to finish."""
        try:
            os.write(self._control, FINISH)
            text, _ = self._recorder.communicate(timeout=CHILD_LIMIT_S)
            return msgspec.json.decode(text, type=Report)
        except (OSError, subprocess.TimeoutExpired, msgspec.DecodeError):
            self._recorder.kill()
            return None
        finally:
            os.close(self._control)


def _may_read_stdin() -> bool:
    """Whether commands may be typed: a pipe, or a terminal that this process is in front of."""
    try:
        if sys.stdin.isatty():
            return os.tcgetpgrp(0) == os.getpgrp()
        return stat.S_ISFIFO(os.fstat(0).st_mode)
    except (OSError, ValueError):
        return False


def run(loaded: Loaded, log: Path, duration: float | None, live: bool) -> Outcome:
    """A live session from start to summary.

    Raises:
        HapticdError, DeviceError: the session could not begin.
    """
    with asyncio.Runner(loop_factory=WatchedLoop) as runner:
        return runner.run(Daemon(loaded, log, duration, live).run())
