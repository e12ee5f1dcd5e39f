"""The live daemon: the fixed-rate loop around the cycle, with plant and recorder in their own processes."""

from __future__ import annotations

import asyncio
import os
import signal
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...devices.adapter import Adapter
from ...devices.frames import Frames
from ...devices.socket_adapter import SocketAdapter
from ...sim.person import Deed, Lead
from ..configuration.bus import bus_warnings, open_bus
from ..configuration.config import Loaded
from ..configuration.session import Session, build
from ..core.events import UNARMABLE, Event, EventKind
from ..core.modes import Command, Mode, together
from ..core.sections import SimulatedBus
from ..core.stages import Stage, Stages
from ..core.tick import Inputs
from ..errors import HapticdError
from ..recording.published import ORDERS, SessionError, run_folder
from ..recording.record import RecordWriter
from ..timing.forensics import Forensics
from ..timing.loop import FixedRate
from ..timing.phase_lock import PhaseLock
from ..timing.realtime import (
    DAEMON_PRIORITY,
    NotRealtimeError,
    automatic_spin_ns,
    become_realtime,
    leave_cpu,
    settle_memory,
    stay_awake,
)
from ..timing.slack import Slack
from ..timing.vitals import LOOK_NS, VitalSigns
from ..timing.watch import Overstay, Watch, WatchedLoop
from .bus_watch import watch_bus
from .children import CHILD_LIMIT_S, Child, end, reap, until_ready
from .console import Console, typed_at
from .interrupts import asking, leave_terminal, let_through, say
from .notify import ServiceManager, Supervision
from .orders import possible, viewed
from .outcome import END_LIMIT_S, Ending, Outcome, called_off, outcome
from .outlet import Outlet
from .plant_link import FROZEN_S, PlantLink
from .recorder import STDERR, Shown
from .recorder_link import RecorderLink
from .screen import CLEAR_BELOW
from .visitor import Visitor
from .warm_up import warm_up

START_DELAY_NS = 20_000_000
TURN_S = 2e-3
"""Long enough for the event loop to hear of a signal."""
HASTE_S = 1.0
"""How long the summary is waited for after a second interrupt, and the end of a plant that is frozen."""


class InternalError(HapticdError):
    """A mistake in this program."""

    code = "internal"


class Daemon:
    """One live session."""

    def __init__(
        self, loaded: Loaded, log: Path, duration: float | None, live: bool, endless: bool = False
    ) -> None:
        self._stages = Stages()
        self._session: Session = build(loaded, self._stages.mark)
        self._rate = loaded.config.loop.rate
        self._duration = duration
        seconds = None if endless else duration or loaded.config.loop.duration
        self._duration_ticks = round(seconds * self._rate) if seconds is not None else None
        self._plant_time = loaded.config.plant_time
        self._shown = (Shown.KEYS if typed_at() else Shown.LIVE) if live else Shown.PLAIN
        self._stderr = Outlet(STDERR)
        self._inputs, self._received = Inputs(), Frames()
        self._pending = Command.NONE
        self._elapsed = 0
        self._ending_since = -1
        self._unserved = 0
        self._ending = Ending()
        self._crash: BaseException | None = None
        self._writer = RecordWriter(self._session.cycle)
        self._recorder = RecorderLink(log, self._writer.usual_bytes * self._rate)
        self._watch = Watch(self._overstayed)
        slack = Slack(self._watch, self._work_failed)
        self._rhythm = FixedRate(round(1e9 / self._rate), self._tick, slack=slack)
        self._lock = PhaseLock(self._rhythm.period_ns) if loaded.config.loop.sync == "bus" else None
        self._forensics, self._vitals = Forensics(self._rhythm.period_ns), VitalSigns()
        self._plant: PlantLink | None = None
        self._waiting: asyncio.Task[Any] | None = None
        cycle = self._session.cycle
        self._console = Console(
            self, cycle, self._recorder, possible(loaded.config), self._shown is Shown.KEYS, self._rate
        )
        self._visitor = Visitor(self._console, viewed(loaded.config))
        # the counter of the last SYNC proves a completed tick
        self._supervision = Supervision(
            ServiceManager(os.environ), lambda: cycle.counter, lambda: cycle.mode.name
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

    def _receive_visitors(self, loop: WatchedLoop) -> None:
        """Views may ask for something; a session that they cannot reach runs all the same."""
        try:
            self._visitor.attend(loop, run_folder() / f"{os.getpid()}{ORDERS}")
        except (OSError, SessionError) as error:
            self._tell(f"hapticd: no view can steer this session: {error}\n")

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
        seconds = self._duration_ticks / self._rate if self._duration_ticks else 0.0
        self._recorder.start(self._session.loaded.name, self._shown, seconds)
        warm_up(self._session.loaded)  # while they start, too
        await self._recorder.ready()
        if self._plant:
            await until_ready("plant", self._plant.child)
        await asyncio.sleep(TURN_S)
        settle_memory()
        self._become_realtime()
        await asyncio.sleep(TURN_S)

    async def _run_ticks(self, loop: WatchedLoop) -> None:
        """The ticks."""
        try:
            self._console.attend(loop)
            self._receive_visitors(loop)
            slack = self._rhythm.slack
            slack.add(self._recorder.watch(self._unrecorded))
            slack.add(watch_bus(self._bus, self._session.cycle.image, self._event))
            slack.add(self._forensics.watch_host(), LOOK_NS)
            slack.add(self._vitals.watch(), LOOK_NS)
            loop.watch = self._watch
            loop.set_exception_handler(self._crashed)
            self._rhythm.start(loop.add_tick, START_DELAY_NS)
            self._supervision.start(loop)
            await self._done.wait()
        finally:
            self._visitor.leave(loop)
            self._console.leave(loop)
            self._rhythm.stop(loop.remove_reader)
            self._rhythm.slack.close()
            self._supervision.stop()
            if self._bus.closed:
                self._ending.lost = "the bus is gone: its interface or the plant died"
            self._bus.close()

    @property
    def _children(self) -> list[Child]:
        plant = self._plant.child if self._plant else None
        return [child for child in (plant, self._recorder.child) if child]

    def _abandon(self) -> None:
        """Nothing has begun: nothing stays."""
        self._bus.close()
        for child in self._children:
            end(child)
        self._recorder.log.unlink(missing_ok=True)

    def _become_realtime(self) -> None:
        wish = self._session.config.loop
        for child in self._children:
            leave_cpu(child.pid, wish.cpu)
        self._event(EventKind.PROCESSORS_AWAKE() if stay_awake() else EventKind.PROCESSORS_MAY_SLEEP())
        granted = become_realtime(DAEMON_PRIORITY, wish.cpu)
        automatic = automatic_spin_ns(granted, wish.cpu)
        self._rhythm.spin_ns = automatic if wish.spin is None else round(1e9 * wish.spin)
        if granted.lost and not self._plant and not wish.best_effort:
            raise NotRealtimeError("; ".join([*granted.lost, "or write best_effort = true under [loop]"]))
        for lost in granted.lost:
            self._event(EventKind.NOT_REALTIME(what=lost))
        for risk in bus_warnings(self._session.config.bus, self._session.config):
            self._event(EventKind.BUS_RISK(what=risk))

    def _tick(self) -> None:
        start = self._stages.begin()
        rhythm, inputs, cycle = self._rhythm, self._inputs, self._session.cycle
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
        cycle.run(inputs)
        self._bus.send(cycle.outputs.frames)
        self._elapsed = self._elapsed + 1 if self._plant_time else inputs.tick + 1
        self._stages.mark(Stage.SEND)
        timing = (start - rhythm.deadline_ns, self._stages.elapsed_ns, self._stages.packed)
        self._recorder.tick(self._writer.write(inputs, timing))
        self._stages.mark(Stage.LOG)
        self._look_back(waited, timing[0])
        for event in cycle.outputs.events:
            self._event(event)
        inputs.frames.clear()
        self._watch_end()

    def _follow(self, lock: PhaseLock) -> None:
        """Keep the grid in phase with the bus clock."""
        assert isinstance(self._bus, SocketAdapter)
        was = lock.locked
        self._rhythm.shift(lock.update(self._rhythm.deadline_ns, self._bus.time_ns))
        if lock.locked != was:
            self._event(EventKind.BUS_CLOCK() if lock.locked else EventKind.NO_BUS_CLOCK())

    def _look_back(self, waited: int, lateness_ns: int) -> None:
        """At the end of a tick: was it punctual, and is the machine armed?"""
        tick, skipped = self._inputs.tick, self._inputs.skipped
        late = self._forensics.look(tick, skipped, waited, lateness_ns, self._stages, self._watch)
        if late and self._session.cycle.mode is not Mode.BRINGUP:
            self._recorder.late(late)
        if self._session.cycle.mode is Mode.ENGAGING:
            self._vitals.armed()

    def _waits_for_plant(self) -> bool:
        """A simulated world stalls as a whole: no tick runs while the plant has not answered the last one."""
        if not (self._plant and self._plant_time) or self._bus.closed or self._ending.failed:
            return False
        up = self._session.cycle.mode not in (Mode.BRINGUP, Mode.FAILED)
        if not self._plant.owes(self._inputs.frames, up, self._rhythm.skipped):
            return False
        if not self._plant.frozen:
            return True
        frozen = EventKind.PLANT_FROZEN(seconds=FROZEN_S)
        self._ending.failed, self._ending.failed_at = str(frozen), self._rhythm.tick
        self._event(frozen)
        self.end()
        return False

    def _watch_end(self) -> None:
        mode = self._session.cycle.mode
        if mode.powered:
            self._ending.moved = True
        self._console.look()
        if self._ending_since < 0:
            over = self._duration_ticks is not None and self._elapsed >= self._duration_ticks
            dead = self._bus.closed and not mode.powered  # while it is, the monitor stops the machine first
            if not (over or dead or mode is Mode.FAILED):
                return
            self.end()
        off = self._session.cycle.drives.secured or (self._bus.closed and not mode.powered)
        if off or self._elapsed - self._ending_since > END_LIMIT_S * self._rate:
            self._done.set()

    @property
    def now(self) -> int:
        """Tick, 0 before the first."""
        return max(0, self._rhythm.tick)

    def ask(self, command: Command) -> None:
        """Give the machine a command at the next tick."""
        self._pending = together(self._pending, command)

    def lead(self) -> bool:
        """A person takes over from the script; whether the session goes on until that person ends it."""
        endless = self._duration is None and typed_at()
        if endless:
            self._duration_ticks = None
        self._recorder.led(endless)
        return endless

    def act(self, deed: Deed | Lead) -> None:
        """At the simulated machine's side, see ``PlantLink.act``."""
        assert self._plant
        self._plant.act(deed)

    def quit(self) -> None:
        """End, after the machine has come to rest."""
        self._ending.quit = True
        self.end()

    def end(self) -> None:
        """Stop the machine, then the session."""
        if self._ending_since < 0:
            self._ending_since = self._elapsed
            self.ask(Command.END)

    def _open_bus(self) -> Adapter:
        match self._session.config.bus:
            case SimulatedBus():
                self._plant = PlantLink(self._session.loaded.name, self._rate)
                return self._plant.bus
            case named:
                return open_bus(named, self._session.loaded.name)

    def _listen(self, loop: asyncio.AbstractEventLoop) -> None:
        for number in asking():
            loop.add_signal_handler(number, self._interrupted, number)

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

    def _overstayed(self, overstay: Overstay) -> None:
        self._recorder.overstay(self.now, overstay)

    def _unrecorded(self, why: str) -> None:
        """A session that is not recorded as a whole says so, and is not armed again."""
        self.ask(Command.UNRECORDED)
        self._tell(f"hapticd: {why}; {UNARMABLE}\n")

    def _event(self, event: Event) -> None:
        self._recorder.event(self.now, event)

    def _work_failed(self, work: str, error: Exception) -> None:
        self._event(EventKind.WORK_FAILED(work=work, error=repr(error)))

    def _crashed(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """An error that nobody expected ends the session at once."""
        error = context.get("exception") or RuntimeError(context["message"])
        self._tell("".join(traceback.format_exception(error)))
        self._crash = self._crash or error
        self._done.set()

    def _tell(self, text: str) -> None:
        """Words that need no recorder; a terminal that hangs does not hold the ticks up."""
        self._stderr.write(("" if self._shown is Shown.PLAIN else f"\r{CLEAR_BELOW}") + text)

    async def _conclude(self) -> Outcome:
        """The log is completed, the plant ends.

        Raises:
            InternalError: something that nobody expected had ended the session.
        """
        if self._crash:  # nothing more is sent: the watchdogs of the drives stop the machine
            self._event(EventKind.INTERNAL_ERROR(error=repr(self._crash)))
        else:
            self._vitals.look()
            self._recorder.vitals(self._vitals.found)
        report = None
        try:
            with self._cancellable():
                report = await self._recorder.collect(self._ending, self._patience_s, self._rate)
                if self._plant:
                    await reap(self._plant.child, self._patience_s)
        except asyncio.CancelledError:
            self._ending.unrecorded = self._recorder.left_alone
        if self._crash:
            log = self._recorder.log
            raise InternalError(f"{self._crash!r}; the log {log} holds the session") from self._crash
        return outcome(self._session.cycle, report, self._ending)

    @property
    def _patience_s(self) -> float:
        """How long a child may take to end."""
        return HASTE_S if self._ending.failed or len(self._ending.signals) > 1 else CHILD_LIMIT_S


def run(loaded: Loaded, log: Path, duration: float | None, live: bool, endless: bool = False) -> Outcome:
    """A live session from start to summary.

    Args:
        loaded: the machine.
        log: an empty file.
        duration: [s]; None: as the configuration says.
        live: whether a terminal shows it.
        endless: whether it goes on until a person ends it, whatever the configuration says.

    Raises:
        HapticdError, DeviceError: the session could not begin.
    """
    handlers = {number: signal.getsignal(number) for number in asking()}
    try:
        with asyncio.Runner(loop_factory=WatchedLoop) as runner:
            return runner.run(Daemon(loaded, log, duration, live, endless).run())
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
