"""The giant's twelve devices on a bus in memory, master and simulated devices in lockstep."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from hapticd.devices.axis_drive import AxisDrive
from hapticd.devices.bringup import Bringup, BringupState, Deadlines
from hapticd.devices.cia402 import PowerStage, State
from hapticd.devices.device import Device
from hapticd.devices.force_torque import ForceTorque
from hapticd.devices.frames import Frames
from hapticd.devices.image import COUNTERS, ProcessImage
from hapticd.devices.imu import Imu
from hapticd.devices.joint_drive import JointDrive
from hapticd.devices.network import Network
from hapticd.devices.safety_plc import SafetyPlc
from hapticd.sim.nodes import SimNodes
from hapticd.testing.plugin import make_way

PERIOD = 1e-3
Step = Callable[[], object]


TESTS = Path(__file__).parent
LIVE = (
    TESTS.parent / "testing/conformance/live.py",
    TESTS / "bench/test_jitter.py",
    TESTS / "runtime/test_daemon.py",
    TESTS / "runtime/test_full_disk.py",
    TESTS / "runtime/test_loop.py",
    TESTS / "runtime/test_notify.py",
    TESTS / "runtime/test_plant_process.py",
    TESTS / "runtime/test_realtime.py",
    TESTS / "runtime/test_slack.py",
    TESTS / "runtime/test_starvation.py",
    TESTS / "runtime/test_terminal.py",
    TESTS / "runtime/test_two_processes.py",
    TESTS / "test_example.py",
)
"""Files of tests that depend on wall time: they would take each other's processors."""
assert all(path.exists() for path in LIVE)


@pytest.hookimpl(tryfirst=True)  # xdist reads the groups in a hook of the same name
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Where several processes run the tests: those of a file stay together: they share what they prepare.

    Those that depend on wall time stay together, too, and come first.
    """
    for item in items:
        if item.path in LIVE:
            item.add_marker(pytest.mark.live)
        if item.path.is_relative_to(TESTS):
            live = item.get_closest_marker("live")
            item.add_marker(pytest.mark.xdist_group("live" if live else item.nodeid.partition("::")[0]))
    items.sort(key=lambda item: item.get_closest_marker("live") is None)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """What does not depend on wall time makes way."""
    make_way(item)


def giant_devices() -> list[Device]:
    joints = [
        JointDrive(
            name=f"joint{i}",
            node=i,
            counts_per_turn=65536,
            gear_ratio=(100, 1),
            link_counts_per_turn=1 << 20,
            rated_torque=100.0,
        )
        for i in range(1, 7)
    ]
    return [
        *joints,
        AxisDrive(name="ppu_x", node=7, counts_per_metre=1_000_000),
        AxisDrive(name="ppu_y", node=8, counts_per_metre=1_000_000),
        ForceTorque(name="ft", node=9, force=500.0, torque=40.0),
        Imu(name="imu_carriage", node=10, acceleration=40.0),
        Imu(name="imu_handle", node=11, acceleration=80.0),
        SafetyPlc(name="plc", node=12),
    ]


class Rig:
    """Master and simulated devices, one tick at a time."""

    def __init__(self, devices: Sequence[Device]) -> None:
        self.network = Network(devices)
        self.image = ProcessImage(self.network)
        self.nodes = SimNodes(self.network)
        self.power = PowerStage(
            self.image, [g for g in self.network.groups if g in ("joints", "axes")], deadline=50
        )
        self.incoming, self.outgoing = Frames(), Frames()
        self.counter = 0
        self.deadlines = Deadlines(boot=20, response=5, configuration=500, start=10)

    def tick(self, *steps: Step, operational: bool = False) -> None:
        self.image.latch(self.incoming, self.counter)
        self.counter += 1
        self.outgoing.clear()
        for step in steps:
            step()
        self.image.compose(self.outgoing, self.counter, operational)
        self.incoming.clear()
        self.nodes.receive(self.outgoing, self.incoming)
        self.nodes.advance(PERIOD)

    def bring_up(self, bringup: Bringup | None = None) -> Bringup:
        bringup = bringup or Bringup(self.image, self.deadlines)
        while bringup.state is not BringupState.READY:
            self.tick(lambda: bringup.step(self.incoming, self.outgoing))
        return bringup

    def walk(self, target: State, reset_faults: bool = False) -> int:
        """Ticks that it took."""
        self.power.request(target, reset_faults)
        start = self.counter
        while not self.power.ready:
            self.tick(self.power.step, operational=True)
        return self.counter - start

    def run(self, ticks: int = 1, operational: bool = True) -> None:
        for _ in range(ticks):
            self.tick(operational=operational)

    def count(self, name: str) -> int:
        return int(self.image.counters[COUNTERS.index(name)])


@pytest.fixture
def devices() -> list[Device]:
    return giant_devices()


@pytest.fixture
def make_rig() -> type[Rig]:
    return Rig


@pytest.fixture
def rig(devices: list[Device]) -> Rig:
    return Rig(devices)


@pytest.fixture
def ready(rig: Rig) -> Rig:
    """In SAFEOP."""
    rig.bring_up()
    return rig


@pytest.fixture
def enabled(ready: Rig) -> Rig:
    """All drives in operation enabled."""
    ready.walk(State.OPERATION_ENABLED)
    return ready
