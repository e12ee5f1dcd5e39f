"""Plant time: one period a frame, one slice a silent millisecond, and never more than that."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator

import pytest
from hapticd.devices.adapter import memory_pair
from hapticd.devices.cia301 import TIME
from hapticd.devices.frames import Frames
from hapticd.devices.socket_adapter import SocketAdapter, unix_pair
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.bus import NamedBus
from hapticd.runtime.configuration.session import build, build_plant
from hapticd.runtime.core.sections import PythonCanBus, SocketCanBus
from hapticd.runtime.live import plant_process
from hapticd.runtime.live.bus_clock import BusClock
from hapticd.runtime.live.plant_process import SLICE_S, PlantServer
from hapticd.runtime.timing.realtime import Granted

PERIOD = 1e-3


class CountingPlant:
    """A plant that only counts its time, safe after 20 ms without a frame."""

    def __init__(self) -> None:
        self.time = 0.0
        self.since_frame = 0.0

    @property
    def safe(self) -> bool:
        return self.since_frame >= 0.020 - 1e-9

    def exchange(self, frames_in: Frames, frames_out: Frames) -> None:
        self.since_frame = 0.0
        for can_id, data in frames_in:
            frames_out.append(can_id + 0x100, data)

    def step(self, dt: float) -> None:
        self.time += dt
        self.since_frame += dt


Served = tuple[CountingPlant, PlantServer, SocketAdapter]


@pytest.fixture
def served() -> Iterator[Served]:
    here, there = unix_pair()
    plant = CountingPlant()
    yield plant, PlantServer(plant, there, PERIOD), here
    here.close()
    there.close()


def send(daemon: SocketAdapter) -> None:
    frames = Frames()
    frames.append(0x080, b"\x01\x00\x00\x00")
    daemon.send(frames)


def test_time_stands_still_until_the_daemon_speaks(
    served: Served,
) -> None:
    plant, server, _ = served
    for _ in range(5):
        assert server.serve()
    assert plant.time == 0.0


def test_a_frame_is_answered_and_advances_one_period(
    served: Served,
) -> None:
    plant, server, daemon = served
    for k in range(1, 4):
        send(daemon)
        assert server.serve()
        assert plant.time == pytest.approx(k * PERIOD)
        answer = Frames()
        assert daemon.receive(answer) == 1
        assert answer[0][0] == 0x180


def test_each_sync_of_a_batch_advances_one_period(served: Served) -> None:
    plant, server, daemon = served
    for _ in range(3):
        send(daemon)
    assert server.serve()
    assert plant.time == pytest.approx(3 * PERIOD)


def test_other_frames_are_answered_without_advancing_time_or_holding_it_back(served: Served) -> None:
    """An echo, a heartbeat or another master must neither speed the world up nor hold the watchdogs."""
    plant, server, daemon = served
    send(daemon)
    server.serve()
    request, answer = Frames(), Frames()
    request.append(0x601, bytes(8))
    deadline = time.monotonic() + 0.05
    while time.monotonic() < deadline:
        daemon.send(request)
        assert server.serve()
        daemon.receive(answer)
        assert answer[0][0] in (0x180, 0x701)
    slices = (plant.time - PERIOD) / SLICE_S
    assert 5 <= slices <= 50


def test_a_bus_without_a_file_descriptor_is_looked_at_often() -> None:
    daemon, there = memory_pair()
    plant = CountingPlant()
    server = PlantServer(plant, there, PERIOD)
    request, answer = Frames(), Frames()
    request.append(0x080, b"\x01\x00\x00\x00")
    for _ in range(20):
        daemon.send(request)
        start = time.monotonic()
        while not daemon.receive(answer):
            assert server.serve()
            assert time.monotonic() - start < 1.0
    assert plant.time >= 20 * PERIOD - 1e-9
    daemon.close()
    assert not server.serve()


def test_each_silent_millisecond_after_the_period_is_one_slice(
    served: Served,
) -> None:
    plant, server, daemon = served
    send(daemon)
    server.serve()
    start = time.monotonic()
    server.serve()  # the frame's own period, then one slice
    assert time.monotonic() - start >= PERIOD + SLICE_S - 2e-4
    assert plant.time == pytest.approx(PERIOD + SLICE_S)
    for _ in range(4):
        server.serve()
    assert plant.time == pytest.approx(PERIOD + 5 * SLICE_S)
    assert server.unsafe == pytest.approx(5 * SLICE_S)
    send(daemon)
    server.serve()
    assert server.unsafe == 0.0


def test_no_slice_counts_while_the_daemon_waits_for_a_processor(served: Served) -> None:
    plant, _, daemon = served
    asked: list[bool] = []

    def starved(fresh: bool) -> bool:
        asked.append(fresh)
        return True

    server = PlantServer(plant, served[1]._bus, PERIOD, starved)
    for _ in range(2):
        send(daemon)
        server.serve()
        while len(asked) % 5 != 4:
            server.serve()
        asked.append(False)
    assert asked == [True, False, False, False, False] * 2
    assert plant.time == pytest.approx(2 * PERIOD)


def test_slices_in_which_the_daemon_ran_after_all_are_made_up_for(served: Served) -> None:
    plant, _, daemon = served
    starving = [True, True, True, False, False, True, False]
    server = PlantServer(plant, served[1]._bus, PERIOD, lambda _: starving.pop(0))
    send(daemon)
    server.serve()
    slices = []
    while starving:
        left = len(starving)
        server.serve()
        if len(starving) < left:
            slices.append(round((plant.time - PERIOD) / SLICE_S))
    assert slices == [0, 0, 0, 4, 5, 5, 7]


def test_a_daemon_that_now_and_then_gets_a_moment_is_charged_what_it_ran(served: Served) -> None:
    plant, _, daemon = served
    starving = [True] * 30 + [False] + [True] * 30 + [False]
    server = PlantServer(plant, served[1]._bus, PERIOD, lambda _: starving.pop(0), lambda: 1.5e-3)
    send(daemon)
    server.serve()
    while starving:
        server.serve()
    assert plant.time == pytest.approx(PERIOD + 4 * SLICE_S)


def test_the_clock_of_the_bus_ticks_whatever_the_daemon_does_and_costs_no_plant_time(served: Served) -> None:
    plant, _, daemon = served
    bus = served[1]._bus
    server = PlantServer(plant, bus, PERIOD, clock=BusClock(bus, PERIOD))
    frames, stamps = Frames(), 0
    begin = time.monotonic()
    while stamps < 50 and time.monotonic() < begin + 10.0:
        assert server.serve()
        daemon.receive(frames)
        stamps += sum(can_id == TIME for can_id, _ in frames)
    end = time.monotonic()
    assert stamps >= 50
    assert end - begin >= 48 * PERIOD  # never more than one a period
    assert plant.time == 0.0
    send(daemon)
    while plant.time < 0.011:
        server.serve()
    assert time.monotonic() - end >= 0.009  # silence is counted as without the clock


def test_a_silent_world_of_safe_drives_stands_still_until_a_daemon_speaks(served: Served) -> None:
    plant, server, daemon = served
    for stand_still in (0.020, 0.040):
        send(daemon)
        for _ in range(60):
            server.serve()
        assert plant.time == pytest.approx(stand_still)


def test_a_stalled_host_counts_one_slice_and_not_its_length(
    served: Served,
) -> None:
    plant, server, daemon = served
    send(daemon)
    server.serve()
    time.sleep(0.08)
    server.serve()
    assert plant.time == pytest.approx(PERIOD + SLICE_S)


def test_frames_that_waited_out_a_stall_count_once(
    served: Served,
) -> None:
    plant, server, daemon = served
    send(daemon)
    server.serve()
    send(daemon)
    time.sleep(0.05)
    server.serve()
    assert plant.time == pytest.approx(2 * PERIOD)


def test_without_the_daemon_the_plant_goes_on_until_every_drive_is_safe(
    served: Served,
) -> None:
    plant, server, daemon = served
    send(daemon)
    server.serve()
    daemon.close()
    assert not server.serve()
    assert server.outlive()
    assert server.unsafe == pytest.approx(0.019)  # and the frame's own period make 20 ms
    assert plant.time == pytest.approx(0.020)


def test_silence_before_the_daemon_is_seen_to_be_gone_counts_too(served: Served) -> None:
    plant, server, daemon = served
    send(daemon)
    while not plant.safe:
        server.serve()
    for _ in range(5):
        server.serve()
    daemon.close()
    server.serve()
    assert server.outlive()
    assert server.unsafe == pytest.approx(0.019)


@pytest.fixture
def outlived(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """This process goes on after the plant."""
    monkeypatch.setattr(plant_process, "become_realtime", lambda priority: Granted(lost=["no SCHED_FIFO"]))
    monkeypatch.setattr(plant_process, "settle_memory", lambda: None)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("outlived")
def test_a_bus_that_goes_ends_the_plant_with_a_word(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    daemon, there = unix_pair()
    monkeypatch.setattr(plant_process, "open_bus", lambda bus, _: there)
    threading.Timer(0.05, daemon.close).start()
    bus = PythonCanBus(interface="pcan", channel="PCAN_USBBUS1")
    assert plant_process.serve_interface(config.load("giant"), bus) == 1
    said = capsys.readouterr().err
    assert "plant: pcan:PCAN_USBBUS1 is gone" in said
    assert "warning: python-can takes about 234 us of a tick of 1000 us" in said


@pytest.mark.usefixtures("outlived")
def test_an_interface_is_served_until_sigterm(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    daemon, there = unix_pair()
    vcan7 = SocketCanBus(interface="vcan7")
    opened: list[NamedBus] = []
    answers = Frames()

    def interface(bus: NamedBus, _: str) -> SocketAdapter:
        opened.append(bus)
        return there

    def ask() -> None:
        request = Frames()
        request.append(0x000, b"\x81\x00")  # NMT: reset all nodes
        daemon.send(request)
        deadline = time.monotonic() + 10.0
        while not daemon.receive(answers) and time.monotonic() < deadline:
            time.sleep(0.005)
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(plant_process, "open_bus", interface)
    asking = threading.Thread(target=ask)
    asking.start()
    try:
        assert plant_process.serve_interface(config.load("giant"), vcan7) == 0
    finally:
        asking.join()
        daemon.close()
    assert there.closed
    assert opened == [vcan7]
    assert {can_id for can_id, _ in answers} >= {0x700 + node for node in range(1, 13)}
    said = capsys.readouterr().err
    assert "giant.toml serves vcan7" in said
    assert "warning: no SCHED_FIFO" in said


@pytest.mark.parametrize(
    ("machine", "controller"),
    [
        ("giant", "giant.machine.Giant"),
        ("rhi", "rhi.machine.RedundantInterface"),
        ("operator", "operator.machine.OperatorStation"),
    ],
)
def test_a_plant_is_built_without_the_controller(
    machine: str, controller: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("postures and limits of the controller take seconds")

    monkeypatch.setattr(f"hapticd.machines.{controller}.__init__", refuse)
    loaded = config.load(machine)
    with pytest.raises(AssertionError):
        build(loaded)
    plant = build_plant(loaded)
    plant.step(PERIOD)
    assert plant.safe
