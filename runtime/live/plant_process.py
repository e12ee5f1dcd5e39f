"""The simulated plant as a process of its own: the far end of the bus.

    python -m hapticd.runtime.live.plant_process CONFIG SOCKET_FD    started by the daemon: a socket pair
    hapticd plant CONFIG --interface vcan0                      started by a person: a CAN FD interface

Standard input says what a person does at the machine's side, as bytes of ``Deed`` from the daemon, as words
from a person: that is no part of any bus, and comes back to the daemon as what sensors and safety PLC
measure.

Plant time advances one period for each SYNC, or for each millisecond slice it waited without one;
a slice never counts more than its length, and none counts while the daemon waits for a processor. So a
stalled host stalls both worlds, while a dead or hanging daemon trips the watchdogs of the simulated drives.
Once every drive is safe, a silent world stands still.
"""

from __future__ import annotations

import os
import select
import signal
import socket
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from math import inf
from time import monotonic

from ...devices.adapter import Adapter
from ...devices.cia301 import SYNC
from ...devices.frames import Frames
from ...devices.socket_adapter import SocketAdapter
from ...sim.person import Deed, Hearing, Lead
from ..configuration import config
from ..configuration.bus import NamedBus, bus_warnings, open_bus
from ..configuration.config import Loaded
from ..configuration.session import build_plant
from ..configuration.system import Connecting, Plant
from ..errors import HapticdError
from ..timing.realtime import PLANT_PRIORITY, become_realtime, settle_memory
from ..timing.starvation import Starvation
from .bus_clock import BusClock
from .children import ignore_job_control, report_ready
from .interrupts import asking
from .keyboard import STDIN, may_read
from .orders import Ear, Order, at_the_machine, legend

SLICE_S = 1e-3
LOOK_S = 2e-4
"""Between two looks at a bus that cannot be waited for."""
LONGEST_GRACE_S = 0.1
"""Plant time after the daemon's end within which every drive must be safe."""


class PlantServer:
    """Couples a plant to its end of the bus.

    Attributes:
        unsafe: plant time in silence during which some drive was not in its safe state [s].
    """

    def __init__(
        self,
        plant: Plant,
        bus: Adapter,
        period: float,
        starved: Callable[[bool], bool] = lambda _: False,
        ran_s: Callable[[], float] = lambda: inf,
        clock: BusClock | None = None,
        person: int | None = None,
        understood: Callable[[bytes], Iterable[Deed | Lead]] | None = None,
    ) -> None:
        """Take over the plant's end of the bus.

        Args:
            plant: what is simulated.
            bus: to the daemon.
            period: plant time that a SYNC pays for [s].
            starved: whether the daemon wanted the processor and did not get it, see ``Starvation.now``.
            ran_s: how long the daemon had the processor since it was last asked about [s].
            clock: of the bus, where it has one of its own.
            person: descriptor from which a person's deeds come.
            understood: what they are, of the bytes that came; default: as the daemon sends them.
        """
        self._understood = understood or Hearing().take
        self._plant, self._bus, self._period = plant, bus, period
        self._starved, self._ran_s, self._clock = starved, ran_s, clock
        self._waitable = bus.fileno() >= 0
        sources = [bus.fileno()] if self._waitable else []
        self._sources = [*sources, clock.fd] if clock else sources
        self._person = person
        if person is not None:
            self._sources.append(person)
        self._requests, self._answers = Frames(), Frames()
        self.unsafe = 0.0
        self._until = monotonic()
        self._silent = self._deferred = 0
        self._met = False

    def serve(self) -> bool:
        """Wait for frames, but no longer than until the next slice; False once the daemon is gone."""
        patience = max(0.0, self._until - monotonic())
        wait = patience if self._waitable else min(patience, LOOK_S)
        ready, _, _ = select.select(self._sources, [], [], wait)
        if self._clock and self._clock.fd in ready:
            self._clock.send()
        if self._person in ready:
            self._watch_person()
        received = self._bus.receive(self._requests)
        if received:
            self._answers.clear()
            self._plant.exchange(self._requests, self._answers)
            self._bus.send(self._answers)
        periods = self._requests.count(SYNC)
        if periods:
            self._met = True
            self.unsafe, self._silent, self._deferred = 0.0, 0, 0
            for _ in range(periods):
                self._plant.step(self._period)
            # the period that a SYNC pays for passes before silence begins to count
            self._until = monotonic() + self._period + SLICE_S
        elif monotonic() >= self._until:
            self._until = monotonic() + SLICE_S
            if self._met:  # plant time begins with the daemon's first SYNC
                self._wait_a_slice()
        return not self._bus.closed

    def outlive(self) -> bool:
        """Go on without the daemon until every drive is safe; whether it came to that."""
        while not self._plant.safe and self.unsafe < LONGEST_GRACE_S:
            self._advance(SLICE_S)
        return self._plant.safe

    def _watch_person(self) -> None:
        assert self._person is not None
        try:
            data = os.read(self._person, 64)
        except OSError:  # a terminal that others use now, or that is gone
            data = b""
        if not data:  # nobody is there any more
            self._sources.remove(self._person)
            self._person = None
        for deed in self._understood(data):
            self._plant.obey(deed)

    def _wait_a_slice(self) -> None:
        """A slice passes, unless the daemon starves; what it is then seen to have run, it was only slow."""
        self._silent += 1
        self._deferred += 1
        if self._starved(self._silent == 1):
            return
        for _ in range(min(self._deferred, 1 + int(min(self._ran_s() / SLICE_S, self._deferred)))):
            if not self._plant.safe:
                self._advance(SLICE_S)
        self._deferred = 0

    def _advance(self, dt: float) -> None:
        if not self._plant.safe:
            self.unsafe += dt
        self._plant.step(dt)


def main(arguments: list[str]) -> int:
    """Serve one end of a socket pair until the daemon is gone."""
    name, fd = arguments
    ignore_job_control()
    daemon = Starvation(os.getppid())
    bus = SocketAdapter(socket.socket(fileno=int(fd)))
    loaded = config.load(name)
    server = _server(loaded, build_plant(loaded), bus, daemon, person=0)
    become_realtime(PLANT_PRIORITY)
    if report_ready():
        while server.serve():
            pass
    _outlive(server)
    return 0


def serve_interface(loaded: Loaded, bus: NamedBus) -> int:
    """Serve a bus until Ctrl-C or SIGTERM, or until it is gone; daemons may come and go.

    Raises:
        AdapterError: the bus cannot be opened.
        ConfigError: the configuration has no [simulation].
    """
    plant = build_plant(loaded)
    adapter = open_bus(bus, loaded.name)
    words, person = Words(at_the_machine(loaded.config)), STDIN if may_read(STDIN) else None
    server = _server(loaded, plant, adapter, person=person, understood=words)
    signal.signal(signal.SIGTTIN, signal.SIG_IGN)  # in the background nobody types to it
    ended = False

    def end(*_: object) -> None:
        nonlocal ended
        ended = True

    for number in asking():
        signal.signal(number, end)
    for warning in become_realtime(PLANT_PRIORITY).lost + bus_warnings(bus, loaded.config):
        print(f"plant: warning: {warning}", file=sys.stderr)
    print(f"plant: {loaded.source} serves {bus.name}; Ctrl-C ends it", file=sys.stderr, flush=True)
    if person is not None:
        print(words.legend, file=sys.stderr, flush=True)
    gone = False
    while not (ended or gone):
        gone = not server.serve()
    _outlive(server)
    adapter.close()
    if gone:
        print(f"plant: {bus.name} is gone", file=sys.stderr)
    return 1 if gone else 0


class Words:
    """Words that a person types to a plant.

    Attributes:
        legend: which there are.
    """

    def __init__(self, orders: Sequence[Order]) -> None:
        self._ear, self.legend = Ear(orders, single_keys=False), legend(orders, single_keys=False)

    def __call__(self, data: bytes) -> Iterator[Deed]:
        """What a person does, of what was typed since the last time."""
        heard = self._ear.hear(data)
        if heard.unknown:
            print(f"plant: {self._ear.answer(heard.unknown)}", file=sys.stderr, flush=True)
        for order in heard.orders:
            if isinstance(order.means, Deed):
                yield order.means


def _server(
    loaded: Loaded,
    plant: Plant,
    bus: Adapter,
    daemon: Starvation | None = None,
    person: int | None = None,
    understood: Callable[[bytes], Iterable[Deed | Lead]] | None = None,
) -> PlantServer:
    loop = loaded.config.loop
    period = 1.0 / loop.rate
    clock = BusClock(bus, period) if loop.sync == "bus" else None
    if isinstance(plant, Connecting):
        plant.connect()
    if daemon:
        server = PlantServer(plant, bus, period, daemon.now, lambda: daemon.ran_s, clock, person)
    else:
        server = PlantServer(plant, bus, period, clock=clock, person=person, understood=understood)
    settle_memory()
    return server


def _outlive(server: PlantServer) -> None:
    safe = server.outlive()
    if server.unsafe:
        state = "every simulated drive is safe" if safe else "NOT every simulated drive is safe"
        span = round(1e3 * server.unsafe)
        print(f"plant: daemon gone; {state} after {span} ms of plant time", file=sys.stderr)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except HapticdError as error:
        print(f"hapticd plant: {error}", file=sys.stderr)
        sys.exit(error.exit_status)
