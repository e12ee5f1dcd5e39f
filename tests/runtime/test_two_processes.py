"""`hapticd plant` and `hapticd run` as two processes, over a bus of python-can."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.bus import open_bus
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.core.sections import PythonCanBus
from hapticd.runtime.live.plant_process import PlantServer
from hapticd.runtime.recording.log import open_log

from ..devices.test_foreign_node import ForeignNode
from .test_daemon import PATIENCE_S, Live

pytest.importorskip("msgpack", reason="udp_multicast needs it")

GROUP = "239.74.163.2"
ATTEMPTS = 20
"""A session that a busy host stops for late frames has done right, and is begun again."""
LATE = ("stale", "device_silent", "overrun", "skipped", "wrench_lost", "acceleration_lost", "stall")


def multicast_works() -> bool:
    """Whether this host loops multicast back; some containers do not."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there,
    ):
        try:
            there.bind(("", 0))
            member = socket.inet_aton(GROUP) + bytes(4)
            there.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
            there.settimeout(1.0)
            here.sendto(b"?", (GROUP, there.getsockname()[1]))
            return there.recv(1) == b"?"
        except OSError:
            return False


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def on_multicast(write_config: Callable[..., Path]) -> Callable[..., Path]:
    """A machine on a bus of its own, armed by command."""
    if not multicast_works():
        pytest.skip("no multicast on this host")
    bus = f'kind = "python-can"\ninterface = "udp_multicast"\nchannel = "{GROUP}"\n'

    def write(rate_hz: int, *changes: tuple[str, str], machine: str) -> Path:
        return write_config(
            ('rate = "1 kHz"', f'rate = "{rate_hz} Hz"\nbest_effort = true'),
            ('on_overrun = "record"', 'on_overrun = "stop"'),
            ('duration = "30 s"', 'duration = "60 s"'),
            ('kind = "simulated"', bus + f"settings = {{ port = {free_port()} }}"),
            ('by = "dead-man"', 'by = "command"'),
            ('dead_man = [{ at = "0.3 s", pressed = true }]', 'dead_man = [{ at = "3 s", pressed = true }]'),
            *changes,
            machine=machine,
        )

    return write


@contextmanager
def plant(config: Path) -> Iterator[Callable[[], str]]:
    """The other end; gives what it said."""
    said = config.with_suffix(".said")
    command = [sys.executable, "-m", "hapticd.runtime", "plant", str(config)]
    with said.open("wb") as file:
        process = subprocess.Popen(command, stderr=file, stdin=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + PATIENCE_S
        while "serves udp_multicast" not in said.read_text():
            assert process.poll() is None, said.read_text()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        yield said.read_text
        process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE_S) == 0, said.read_text()
    finally:
        process.kill()
        process.wait()


def session(config: Path, folder: Path) -> tuple[Live, int]:
    """A daemon that is armed and, once active, interrupted; and how it ended."""
    live = Live(folder, str(config))
    try:
        live.wait_for("READY")
        live.type("arm\n")
        deadline = time.monotonic() + PATIENCE_S
        over = ("ACTIVE", "STOP", "not started")
        while live.process.poll() is None and not any(word in live.errors for word in over):
            assert time.monotonic() < deadline, live.errors
            time.sleep(0.02)
        live.process.send_signal(signal.SIGINT)
        return live, live.end()
    finally:
        live.process.kill()
        live.process.wait()
        assert live.process.stdin
        live.process.stdin.close()


def test_a_whole_life_over_udp_multicast_in_two_processes(
    on_multicast: Callable[..., Path], tmp_path: Path
) -> None:
    # slow and small: a busy host that gives nobody priority loses fewer of its frames
    # who pulls at the handle cannot start
    machine_file = on_multicast(200, ('force = "40 N"', 'force = "2 N"'), machine="rhi")
    for attempt in range(ATTEMPTS):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        with plant(machine_file) as said:
            live, status = session(machine_file, folder)
        modes = {record.fixed["mode"] for record in open_log(str(live.log)).records()}
        assert {Mode.BRINGUP, Mode.READY} <= modes, live.errors
        assert "foreign" not in live.errors  # its own echo is no second master
        assert "NOT every" not in said()
        if Mode.ACTIVE in modes:
            assert {Mode.ENABLING, Mode.ENGAGING, Mode.ACTIVE, Mode.STOPPED} <= modes
            verify = [sys.executable, "-m", "hapticd.runtime", "replay", str(live.log), "--verify"]
            assert subprocess.run(verify, capture_output=True, check=False).returncode == 0
            assert status == 0 or any(reason in live.errors for reason in LATE), live.errors
            return
        assert any(reason in live.errors for reason in LATE), live.errors
    pytest.fail(f"not active in {ATTEMPTS} attempts: {live.errors}")


def test_a_foreign_node_with_a_wrong_revision_ends_the_daemon_with_its_name_and_nothing_moves(
    on_multicast: Callable[..., Path], tmp_path: Path
) -> None:
    """All devices are simulated but the force-torque sensor, which is a node of the canopen package."""
    rate_hz = 250
    machine_file = on_multicast(rate_hz, ("substeps = 3", "substeps = 12"), machine="giant")
    session = build(config.load(str(machine_file)))
    bus = session.config.bus
    assert isinstance(bus, PythonCanBus)
    plant = session.plant()
    simulated = plant.nodes  # type: ignore[attr-defined]
    simulated["force_torque"].silent = True
    node = ForeignNode(
        simulated["force_torque"].device, interface=bus.interface, channel=bus.channel, **bus.settings
    )
    node.preset(0x1018, 3, 7)
    server, ended = PlantServer(plant, open_bus(bus, "giant"), 1.0 / rate_hz), threading.Event()

    def serve() -> None:
        while not ended.is_set():
            server.serve()

    serving = threading.Thread(target=serve)
    serving.start()
    live = Live(tmp_path, str(machine_file))
    try:
        assert live.end() == 1
    finally:
        live.process.kill()
        live.process.wait()
        assert live.process.stdin
        live.process.stdin.close()
        ended.set()
        serving.join()
        node.close()
        server._bus.close()
    assert (
        "force_torque (node 9), object 1018h:03: expected 65536 (0x10000), got 7 (0x7). "
        "Another device has this node id, or force_torque.eds is not its EDS"
    ) in live.errors
    assert node.enabled_outputs == 0
    assert plant.safe
    modes = {record.fixed["mode"] for record in open_log(str(live.log)).records()}
    assert modes == {Mode.BRINGUP, Mode.FAILED}
