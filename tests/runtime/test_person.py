"""A person in place of the script: the dead end after a stop, in lockstep with the machine."""

from __future__ import annotations

import os
import socket

import pytest
from hapticd.devices.frames import Frames
from hapticd.devices.socket_adapter import SocketAdapter
from hapticd.runtime.core.modes import Command, Mode
from hapticd.runtime.live.orders import at_the_machine
from hapticd.runtime.live.plant_process import PlantServer, Words
from hapticd.sim.person import Deed

from .conftest import Bench


def test_after_a_stop_a_person_lets_go_resets_presses_and_pushes(moving: Bench) -> None:
    bench = moving
    bench.run(1, Command.STOP)
    bench.until(Mode.STOPPED)
    bench.run(600, Command.RESET)
    assert bench.mode is Mode.STOPPED  # the script never lets go
    bench.plant.obey(Deed.RELEASE)
    bench.run(5)
    bench.run(1, Command.RESET)
    bench.until(Mode.READY)
    bench.plant.obey(Deed.PRESS)
    bench.until(Mode.ACTIVE, limit=5000)
    before = handle(bench)
    for _ in range(8):
        bench.plant.obey(Deed.PUSH_BACK)
        bench.run(60)
    bench.run(500)
    assert bench.mode is Mode.ACTIVE
    assert handle(bench) < before - 0.003


def handle(bench: Bench) -> float:
    """Where the handle is along y."""
    ppu = getattr(bench.plant, "ppu", None)
    return float(bench.plant.arm.position[1]) + (ppu.position[1] if ppu else 0.0)  # type: ignore[attr-defined]


def test_the_script_is_off_once_a_person_acts() -> None:
    presses = 'dead_man = [{ at = "0.3 s", pressed = true }]'
    script = 'dead_man = [{ at = "0.3 s", pressed = true }, { at = "1 s", pressed = false }]'
    bench = Bench((presses, script))
    bench.until(Mode.ENGAGING)
    bench.plant.obey(Deed.PUSH_LEFT)
    assert bench.plc.dead_man == (True, True)  # a push alone does not open the switch
    bench.run(1500)
    assert bench.mode is Mode.ENGAGING


def test_what_a_person_does_reaches_the_plant_over_no_bus() -> None:
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    read, write = os.pipe()
    bench = Bench()
    far, near = SocketAdapter(there), SocketAdapter(here)
    server = PlantServer(bench.plant, far, 1e-3, person=read)
    os.write(write, bytes([Deed.PRESS.value, 250]))
    assert server.serve()
    assert bench.plc.dead_man == (True, True)
    os.write(write, bytes([Deed.RELEASE.value]))
    assert server.serve()
    assert bench.plc.dead_man == (False, False)
    frames = Frames()
    near.receive(frames)
    assert len(frames) == 0  # nothing of it was a frame
    os.close(write)
    for _ in range(3):
        assert server.serve()  # nobody there any more: the plant goes on, without spinning
    assert server._person is None
    near.close()
    far.close()
    os.close(read)


def test_words_that_are_typed_to_a_plant_are_what_a_person_does(capsys: pytest.CaptureFixture[str]) -> None:
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    read, write = os.pipe()
    bench = Bench()
    words = Words(at_the_machine(bench.lockstep.session.config))
    far = SocketAdapter(there)
    server = PlantServer(bench.plant, far, 1e-3, person=read, understood=words)
    os.write(write, b"press\nabort\npush le")
    assert server.serve()
    assert bench.plc.dead_man == (True, True)
    assert '"abort": no such word; press, release, push left' in capsys.readouterr().err
    os.write(write, b"ft\n release \n")
    assert server.serve()
    assert bench.plc.dead_man == (False, False)
    far.close()
    here.close()
    os.close(read)
    os.close(write)
