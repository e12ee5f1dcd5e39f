"""The live daemon: the fixed-rate loop around the cycle, with plant and recorder in their own processes."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import time_ns
from typing import Any

import msgspec

from ..devices.adapter import Adapter
from ..devices.frames import CAPACITY, Frames
from ..devices.image import COUNTERS
from ..devices.socket_adapter import SocketAdapter
from ..sim.person import Deed
from .bus import bus_warnings, open_bus
from .children import CHILD_LIMIT_S, Child, end, last_words, reap, spawn, until_ready
from .config import Loaded
from .cycle import Inputs, Outputs, cycle
from .errors import HapticdError
from .forensics import Forensics
from .interrupts import asking, leave_terminal, let_through, say
from .keyboard import Keyboard, may_read
from .log_file import cut_short
from .loop import FixedRate
from .modes import Command, Mode
from .notify import ServiceManager, Supervision
from .orders import Ear, Order, Request, legend, possible, remark
from .outcome import END_LIMIT_S, Ending, Outcome, called_off, outcome
from .outlet import Outlet
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
from .recorder import (
    CUT_SHORT,
    EVENT,
    FINISH,
    HIDE,
    LATE,
    OVERSTAY,
    SAY,
    SHOW,
    STDERR,
    TICK,
    TORN,
    VITALS,
    Shown,
)
from .ring import Drain, Ring
from .screen import CLEAR_BELOW
from .sections import SimulatedBus
from .session import Session, build
from .slack import Slack, pause
from .stages import Stage, Stages
from .summary import Report
from .vitals import LOOK_NS, VitalSigns
from .warm_up import warm_up
from .watch import Overstay, Watch, WatchedLoop

START_DELAY_NS = 20_000_000
TURN_S = 2e-3
"""Long enough for the event loop to hear of a signal."""
FROZEN_S = 2.0
"""How long a simulated plant may owe its answer before the session ends."""
LONGEST_LOOK_S = 0.1
"""What a tick that waits for the plant counts at most: while this process did not run, it saw nothing."""
HASTE_S = 1.0
"""How long the summary is waited for after a second interrupt, and the end of a plant that is frozen."""
RECORDER_S = 0.2
"""Between two looks at the recorder."""
HUNG_LOOKS = 4
"""Looks without a record taken out of the ring after which the recorder counts as hung."""
BUS_S = 0.5
"""Between two looks at what the bus dropped."""
NOTEWORTHY = tuple(name for name in COUNTERS if name not in ("frames", "misses"))
"""Counters that a person hears of; missing frames have their own words."""
STDIN = 0
TAKEN = "the simulated person is yours now: the script has let go of dead-man switch and hand"
REPLIES = 20
"""Answers to what is typed, a second at most: a flood of it must not fill the ring."""
BREATH_S = 0.01
"""Between two looks at what is typed: faster than anybody types, too slow for a flood to matter."""
SUSPEND_S = 0.1
"""From rest until the shell may have the screen, on which the recorder has shown everything by then."""


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
        simulated = isinstance(loaded.config.bus, SimulatedBus)
        self._plant_time = simulated and loaded.config.loop.on_overrun == "record"
        self._log = log
        typed_at = may_read(STDIN) and os.isatty(STDIN)
        self._shown = (Shown.KEYS if typed_at else Shown.LIVE) if live else Shown.PLAIN
        self._orders = possible(loaded.config)
        self._ear = Ear(self._orders, single_keys=self._shown is Shown.KEYS)
        self._keyboard: Keyboard | None = None
        self._stderr = Outlet(STDERR)
        self._suspend_at = -1
        self._led = False
        self._replies, self._replies_since = 0, 0
        self._inputs, self._outputs, self._received = Inputs(), Outputs(), Frames()
        self._pending = Command.NONE
        self._elapsed = 0
        self._ending_since = -1
        self._stalled = 0
        self._unserved = 0
        self._ending = Ending()
        self._crash: BaseException | None = None
        self._ring = Ring.create()
        self._writer = RecordWriter(self._session.memory)
        self._watch = Watch(self._overstayed)
        slack = Slack(self._watch, lambda text: self._event(self._rhythm.tick, f"warning: {text}"))
        self._rhythm = FixedRate(round(1e9 / self._rate), self._tick, slack=slack)
        self._lock = PhaseLock(self._rhythm.period_ns) if loaded.config.loop.sync == "bus" else None
        self._forensics, self._vitals = Forensics(self._rhythm.period_ns), VitalSigns()
        self._plant: Child | None = None
        self._recorder: Child | None = None
        self._waiting: asyncio.Task[Any] | None = None
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
        self._listen(loop)
        self._bus = self._open_bus()
        with let_through():
            try:
                with self._cancellable():
                    await self._prepare()
            except asyncio.CancelledError:
                self._abandon()
                return called_off(self._ending.signals[0])
            except BaseException:
                self._abandon()
                raise
            await self._run_ticks(loop)
            return await self._conclude()

    @contextmanager
    def _cancellable(self) -> Iterator[None]:
        """What an interrupt cancels."""
        self._waiting = asyncio.current_task()
        try:
            yield
        finally:
            self._waiting = None

    async def _prepare(self) -> None:
        """Everything before the first tick; an interrupt cancels it."""
        if self._lock and isinstance(self._bus, SocketAdapter):
            self._bus.stamp_arrivals()
        await until_ready("recorder", self._start_recorder())
        if self._plant:
            await until_ready("plant", self._plant)
        warm_up(self._session.loaded)
        await asyncio.sleep(TURN_S)
        settle_memory()
        self._become_realtime()
        await asyncio.sleep(TURN_S)

    async def _run_ticks(self, loop: WatchedLoop) -> None:
        """The ticks."""
        try:
            self._attend(loop)
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
        finally:
            if self._keyboard:
                self._keyboard.release()
            self._rhythm.stop(loop.remove_reader)
            self._rhythm.slack.close()
            self._supervision.stop()
            if self._bus.closed:
                self._ending.lost = "the bus is gone: its interface or the plant died"
            self._bus.close()

    def _abandon(self) -> None:
        """Nothing has begun: nothing stays."""
        self._bus.close()
        for child in filter(None, (self._plant, self._recorder)):
            end(child)
        self._log.unlink(missing_ok=True)

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
        for warning in granted.lost + bus_warnings(self._session.config.bus, self._session.config):
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
        self._elapsed = self._elapsed + 1 if self._plant_time else inputs.tick + 1
        self._stages.mark(Stage.SEND)
        timing = (start - rhythm.deadline_ns, self._stages.elapsed_ns, self._stages.packed)
        self._ring.push(TICK + self._writer.write(inputs, outputs, timing))
        self._stages.mark(Stage.LOG)
        self._look_back(waited, timing[0])
        for text in outputs.events:
            self._event(inputs.tick, text)
        inputs.frames.clear()
        self._watch_end()

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
        if not self._plant_time or self._bus.closed or self._ending.failed:
            return False
        assert isinstance(self._bus, SocketAdapter)
        if self._session.memory.mode in (Mode.BRINGUP, Mode.FAILED):
            silent = self._bus.unread  # nobody has to answer yet
        else:
            silent = not self._inputs.frames.answers
        if not silent or len(self._inputs.frames) > CAPACITY:
            self._stalled = 0
            return False
        self._stalled += min(1 + self._rhythm.skipped, round(LONGEST_LOOK_S * self._rate))
        if self._stalled < FROZEN_S * self._rate:
            return True
        self._ending.failed = f"the simulated plant froze: no answer for {FROZEN_S:g} s"
        self._ending.failed_at = self._rhythm.tick
        self._event(self._rhythm.tick, self._ending.failed)
        self.end()
        return False

    def _watch_end(self) -> None:
        mode = self._session.memory.mode
        if mode.powered:
            self._ending.moved = True
        if self._suspend_at >= 0:
            self._suspend()
        if self._ending_since < 0:
            over = self._duration_ticks is not None and self._elapsed >= self._duration_ticks
            dead = self._bus.closed and not mode.powered  # while it is, the monitor stops the machine first
            if not (over or dead or mode is Mode.FAILED):
                return
            self.end()
        off = self._session.memory.secured or (self._bus.closed and not mode.powered)
        if off or self._elapsed - self._ending_since > END_LIMIT_S * self._rate:
            self._done.set()

    def end(self) -> None:
        """Stop the machine, then the session."""
        if self._ending_since < 0:
            self._ending_since = self._elapsed
            self._pending |= Command.END

    # ------------------------------------------------------------------------------- around it

    def _open_bus(self) -> Adapter:
        match self._session.config.bus:
            case SimulatedBus():
                here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
                name = self._session.loaded.name
                arguments = [name, str(there.fileno())]
                self._plant = spawn("plant_process", arguments, [there.fileno()], subprocess.PIPE)
                there.close()
                assert self._plant.stdin
                os.set_blocking(self._plant.stdin.fileno(), False)
                return SocketAdapter(here)
            case named:
                return open_bus(named)

    def _start_recorder(self) -> Child:
        theirs, self._control = os.pipe()
        arguments = [
            self._session.loaded.name,
            str(self._log),
            str(self._ring.fd),
            str(theirs),
            str(time_ns()),
            self._shown.name,
            str(self._duration_ticks / self._rate if self._duration_ticks else 0),
        ]
        self._recorder = spawn("recorder", arguments, [self._ring.fd, theirs])
        os.close(theirs)
        return self._recorder

    def _listen(self, loop: asyncio.AbstractEventLoop) -> None:
        for number in asking():
            loop.add_signal_handler(number, self._interrupted, number)

    def _attend(self, loop: asyncio.AbstractEventLoop) -> None:
        """From now on the person at the terminal is listened to."""
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)  # in the background nothing is heard
        loop.add_signal_handler(signal.SIGTSTP, self._stop_and_suspend)
        loop.add_signal_handler(signal.SIGCONT, self._attach, loop)
        self._attach(loop)
        if os.isatty(STDIN) and os.isatty(STDERR):
            self._reply(SAY, legend(self._orders, self._ear.single_keys))

    def _attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """Read what is typed, from the start or again after the shell had the terminal."""
        self._ring.push(SHOW)
        if may_read(STDIN):
            self._keyboard = self._keyboard or Keyboard(STDIN, self._ear.single_keys)
            self._keyboard.grab()
            loop.add_reader(self._keyboard.fd, self._typed, loop)

    def _interrupted(self, number: int) -> None:
        """The first time, the machine is brought to rest; the second time, that is not waited for."""
        before = self._ending.signals
        self._ending.signals = (*before, number)
        leave_terminal()
        if self._rhythm.running and not self._done.is_set():
            if before:
                self._done.set()
            self.end()
        elif self._waiting and (before or not self._elapsed):
            self._waiting.cancel()
        elif not before:
            say("the log is being completed; once more leaves that to the recorder alone")

    def _stop_and_suspend(self) -> None:
        """Ctrl-Z: nobody freezes the controller of a machine that moves."""
        self._pending |= Command.STOP
        self._suspend_at = self._now + round(SUSPEND_S * self._rate)
        self._event(self._now, "Ctrl-Z: the machine stops, then this session is suspended")
        self._ring.push(HIDE)

    def _suspend(self) -> None:
        """Once the machine is off and the screen says so."""
        if not self._session.memory.secured:
            self._suspend_at = self._now + round(SUSPEND_S * self._rate)
        elif self._now >= self._suspend_at:
            self._suspend_at = -1
            if self._keyboard:
                self._keyboard.release()
            os.kill(os.getpid(), signal.SIGSTOP)

    def _typed(self, loop: asyncio.AbstractEventLoop) -> None:
        assert self._keyboard
        data = self._keyboard.read()
        if data is None:
            return
        loop.remove_reader(self._keyboard.fd)
        if data:
            loop.call_later(BREATH_S, loop.add_reader, self._keyboard.fd, self._typed, loop)
        heard = self._ear.hear(data)
        for order in heard.orders:
            self._obey(order)
        if heard.unknown:
            self._reply(SAY, self._ear.answer(heard.unknown))

    def _obey(self, order: Order) -> None:
        match order.means:
            case Command() as command:
                self._pending |= command
                why = remark(command, self._session.memory.mode)
                self._reply(EVENT, f"typed: {order.word}{why and f'; {why}'}")
            case Deed() as deed:
                self._act(order, deed)
            case Request.HELP:
                self._reply(SAY, legend(self._orders, self._ear.single_keys))
            case Request.QUIT:
                self._reply(EVENT, f"typed: {order.word}")
                self.end()

    def _act(self, order: Order, deed: Deed) -> None:
        """The person at the simulated machine; only what its devices then measure comes back."""
        if not self._led:
            self._led = True
            self._event(self._now, TAKEN)
        if deed in (Deed.PRESS, Deed.RELEASE):
            self._reply(EVENT, f"typed: {order.word}")
        try:
            assert self._plant and self._plant.stdin
            os.write(self._plant.stdin.fileno(), bytes([deed.value]))
        except OSError as error:
            self._reply(SAY, f"the plant did not take that: {error.strerror}")

    def _overstayed(self, overstay: Overstay) -> None:
        tick = max(0, self._rhythm.tick)
        self._ring.push(OVERSTAY + tick.to_bytes(8, "little") + msgspec.json.encode(overstay))

    def _crashed(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """An error that nobody expected ends the session at once."""
        error = context.get("exception") or RuntimeError(context["message"])
        self._tell("".join(traceback.format_exception(error)))
        self._crash = self._crash or error
        self._done.set()

    async def _watch_recorder(self) -> None:
        """Supervisory work: a session that is not recorded as a whole says so, and is not armed again."""
        drain = Drain(self._ring, HUNG_LOOKS)
        while not (why := self._recorder_fault(drain)):
            await pause(RECORDER_S)
        self._pending |= Command.UNRECORDED
        self._tell(f"hapticd: {why}; what runs goes on, and the machine is not armed again\n")

    def _recorder_fault(self, drain: Drain) -> str:
        """Why the session is not recorded any more, or not completely; "" where it is."""
        assert self._recorder
        if self._recorder.poll() is not None:
            return "the recorder died: this session is not recorded any more"
        if self._ring.dropped:
            return "the recorder is too slow: records were lost"
        if drain.stuck():
            return f"the recorder hangs: nothing was recorded for {HUNG_LOOKS * RECORDER_S:g} s"
        return ""

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

    @property
    def _now(self) -> int:
        return max(0, self._rhythm.tick)

    def _reply(self, kind: bytes, text: str) -> None:
        """Answer what was typed, for the screen alone or as an event."""
        if self._now - self._replies_since >= self._rate:
            self._replies, self._replies_since = 0, self._now
        self._replies += 1
        if self._replies > REPLIES:
            return
        if kind == EVENT:
            self._event(self._now, text)
        else:
            self._ring.push(kind + text.encode())

    def _tell(self, text: str) -> None:
        """Words that need no recorder; a terminal that hangs does not hold the ticks up."""
        self._stderr.write(("" if self._shown is Shown.PLAIN else f"\r{CLEAR_BELOW}") + text)

    def _event(self, tick: int, text: str) -> None:
        self._ring.push(EVENT + tick.to_bytes(8, "little") + text.encode())

    async def _conclude(self) -> Outcome:
        """The log is completed, the plant ends.

        Raises:
            InternalError: something that nobody expected had ended the session.
        """
        if self._crash:  # nothing more is sent: the watchdogs of the drives stop the machine
            self._event(max(0, self._rhythm.tick), f"internal error: {self._crash!r}")
        else:
            self._vitals.look()
            self._ring.push(VITALS + msgspec.json.encode(self._vitals.found))
        report = None
        try:
            with self._cancellable():
                report = await self._collect()
                if self._plant:
                    await reap(self._plant, self._patience_s)
        except asyncio.CancelledError:
            self._ending.unrecorded = self._left_alone
        if self._crash:
            raise InternalError(f"{self._crash!r}; the log {self._log} holds the session") from self._crash
        return outcome(self._session.memory, report, self._ending)

    @property
    def _patience_s(self) -> float:
        """How long a child may take to end."""
        return HASTE_S if self._ending.failed or len(self._ending.signals) > 1 else CHILD_LIMIT_S

    @property
    def _left_alone(self) -> str:
        return f"there is no summary; the recorder goes on to complete the log {self._log}"

    async def _collect(self) -> Report | None:
        """The summary that the recorder gives once it is told to finish; None where it does not."""
        assert self._recorder
        try:
            with suppress(BrokenPipeError):  # it is gone; its last words may be there
                os.write(self._control, FINISH)
            words = await last_words(self._recorder, self._patience_s)
            await reap(self._recorder, self._patience_s)
            report = msgspec.json.decode(words, type=Report)
            if self._recorder.returncode in (CUT_SHORT, TORN):
                seconds, whole = report.ticks / self._rate, self._recorder.returncode == CUT_SHORT
                self._ending.failed = cut_short(self._log, seconds, whole)
            return report
        except TimeoutError:
            if self._patience_s == HASTE_S:
                self._ending.unrecorded = self._left_alone
            else:
                end(self._recorder)
        except (OSError, msgspec.DecodeError):
            end(self._recorder)
        finally:
            os.close(self._control)
        return None


def run(loaded: Loaded, log: Path, duration: float | None, live: bool) -> Outcome:
    """A live session from start to summary.

    Raises:
        HapticdError, DeviceError: the session could not begin.
    """
    handlers = {number: signal.getsignal(number) for number in asking()}
    try:
        with asyncio.Runner(loop_factory=WatchedLoop) as runner:
            return runner.run(Daemon(loaded, log, duration, live).run())
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
