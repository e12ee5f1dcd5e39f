"""Sessions in lockstep, with changes to the built-in machines."""

from __future__ import annotations

import functools
import os
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.devices.cia301 import AlState
from hapticd.devices.cia402 import State
from hapticd.runtime import config
from hapticd.runtime.lockstep import Lockstep
from hapticd.runtime.modes import Command, Mode
from hapticd.runtime.session import build
from hapticd.sim.drives import SimDrive, SimJointDrive
from hapticd.sim.node import SimNode

MACHINES = ("giant", "rhi")
RAMP_TICKS = 150
"""Detection and ramp together: the declared stop time."""


def changed(*changes: tuple[str, str], machine: str = "giant") -> str:
    """A machine's configuration with some texts replaced, each of which must occur."""
    text = read_text(f"{machine}.toml")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def loaded(*changes: tuple[str, str], machine: str = "giant") -> config.Loaded:
    text, model = changed(*changes, machine=machine), f"{machine}.urdf"
    parsed = config.parse(text, f"{machine}.toml")
    return config.Loaded(machine, parsed, text, f"{machine}.toml", read_text(model), model)


class Bench:
    """A lockstep session that remembers what happened."""

    def __init__(self, *changes: tuple[str, str], machine: str = "giant") -> None:
        self.lockstep = Lockstep(build(loaded(*changes, machine=machine)))
        self.memory = self.lockstep.session.memory
        self.plant = self.lockstep.plant
        self.nodes = self.plant.nodes  # type: ignore[attr-defined]
        self.plc = self.nodes["safety_plc"]
        self.events: list[str] = []

    @property
    def mode(self) -> Mode:
        return self.memory.mode

    @property
    def tick_index(self) -> int:
        return self.lockstep.inputs.tick

    @property
    def reason(self) -> str:
        trip = self.memory.latch.trip
        return trip.verdict.reason if trip else ""

    def run(self, ticks: int, commands: Command = Command.NONE, skipped: int = 0) -> None:
        for _ in range(ticks):
            self.lockstep.tick(commands, skipped)
            self.events += self.lockstep.outputs.events
            commands, skipped = Command.NONE, 0

    def until(self, *modes: Mode, limit: int = 2000) -> int:
        """Run until one of these modes; how many ticks that took."""
        for ticks in range(limit):
            if self.mode in modes:
                return ticks
            self.run(1)
        raise AssertionError(f"still {self.mode.name} after {limit} ticks: {self.events[-3:]}")

    def press(self, pressed: bool) -> None:
        self.plc.dead_man = (pressed, pressed)

    def silence_all(self) -> None:
        for node in self.nodes.nodes:
            node.silent = True

    def after_sensing(self, change: Callable[[], object]) -> None:
        """Change what the devices measure, whenever they have measured."""
        sense = self.plant._sense  # type: ignore[attr-defined]

        def changed() -> None:
            sense()
            change()

        self.plant._sense = changed  # type: ignore[attr-defined]

    def break_sensor(self, node: str, field: str, value: object, samples: int = 1 << 30) -> None:
        """A sensor reports a value instead of what it measures, for some samples."""
        left = samples

        def broken() -> None:
            nonlocal left
            if left > 0:
                left -= 1
                setattr(self.nodes[node], field, value)

        self.after_sensing(broken)

    @property
    def joints(self) -> list[SimJointDrive]:
        return self.nodes.of(SimJointDrive)

    @property
    def torques(self) -> list[float]:
        return [joint.torque for joint in self.joints]

    @property
    def last_drive(self) -> SimDrive:
        """An axis where the machine has axes."""
        return self.nodes.of(SimDrive)[-1]

    @property
    def safe(self) -> bool:
        return self.plant.safe


def fall(node: SimNode) -> None:
    """A device falls back to SAFEOP, reports no error, and goes on answering."""
    node._watchdog_tripped, node.al_state = True, AlState.SAFEOP


def weld(drive: SimDrive) -> None:
    """A drive's power stage stays on, whatever it is told; only STO takes its torque."""
    drive.state = State.OPERATION_ENABLED
    drive.outputs_latched = drive.outputs_invalid = lambda: None  # type: ignore[method-assign]


def in_a_copy(test: Callable[..., None]) -> Callable[..., None]:
    """Run a test in a copy of the process: what it does to a session, no other test sees."""

    @functools.wraps(test)
    def copied(*args: Any, **kwargs: Any) -> None:
        read, write = os.pipe()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # the copy has no use for other threads
            child = os.fork()
        if child == 0:
            try:
                test(*args, **kwargs)
            except BaseException:
                os.write(write, traceback.format_exc()[-4000:].encode())
            os._exit(0)
        os.close(write)
        with open(read) as pipe:
            report = pipe.read()
        _, status = os.waitpid(child, 0)
        assert status == 0 and not report, report

    return copied


@pytest.fixture(params=MACHINES)
def machine(request: pytest.FixtureRequest) -> str:
    """The name of a built-in machine."""
    return str(request.param)


@pytest.fixture
def bench(machine: str) -> Bench:
    return Bench(machine=machine)


@pytest.fixture
def engaging(machine: str) -> Bench:
    """Drives enabled, the operator's wrench fading in."""
    bench = Bench(machine=machine)
    bench.until(Mode.ENGAGING)
    bench.run(50)
    return bench


@pytest.fixture
def moving(machine: str) -> Bench:
    """The hand walks, and the machine follows."""
    bench = Bench(machine=machine)
    bench.until(Mode.ACTIVE, limit=5000)
    bench.run(1500)
    assert np.abs(bench.plant.arm.qd).max() > 0.2  # type: ignore[attr-defined]
    return bench


@pytest.fixture(scope="module", params=MACHINES)
def walking(request: pytest.FixtureRequest) -> Bench:
    """The same for tests that each run in a copy."""
    bench = Bench(machine=str(request.param))
    bench.until(Mode.ACTIVE, limit=5000)
    bench.run(1500)
    return bench


@pytest.fixture
def write_config(tmp_path: Path) -> Callable[..., Path]:
    """A changed machine as files in a folder of their own."""

    def write(*changes: tuple[str, str], machine: str = "giant", model: str = "") -> Path:
        (tmp_path / f"{machine}.urdf").write_text(model or read_text(f"{machine}.urdf"))
        path = tmp_path / "machine.toml"
        path.write_text(changed(*changes, machine=machine))
        return path

    return write
