"""Sessions in lockstep, with changes to the built-in machines."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.runtime.configuration import config
from hapticd.runtime.core.modes import Mode
from hapticd.testing import bench as benches
from hapticd.testing.terminal import HAPTICD, Terminal

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
    text = changed(*changes, machine=machine)
    parsed = config.parse(text, f"{machine}.toml")
    model = parsed.model
    return config.Loaded(machine, parsed, text, f"{machine}.toml", read_text(model), model)


class Bench(benches.Bench):
    """A session of a built-in machine, changed."""

    def __init__(self, *changes: tuple[str, str], machine: str = "giant") -> None:
        super().__init__(loaded(*changes, machine=machine))


def unchanged(machine: str) -> Bench:
    """As it is built in."""
    return Bench(machine=machine)


@functools.cache
def after(mode: Mode, ticks: int) -> benches.Bring:
    """Brings a session to some ticks after it came into a mode."""

    def bring(session: benches.Bench) -> None:
        session.until(mode, limit=5000)
        session.run(ticks)

    return bring


def parked(mode: Mode, ticks: int, machine: str = "giant") -> Bench:
    """The same session for every test that asks for it: each runs in a copy of the process."""
    session = benches.parked(unchanged, machine, after(mode, ticks))
    assert isinstance(session, Bench)
    return session


@pytest.fixture(params=MACHINES)
def machine(request: pytest.FixtureRequest) -> str:
    """The name of a built-in machine."""
    return str(request.param)


@pytest.fixture
def bench(machine: str) -> Bench:
    """A session that has not begun."""
    return parked(Mode.BRINGUP, 0, machine=machine)


@pytest.fixture
def engaging(machine: str) -> Bench:
    """Drives enabled, the operator's wrench fading in."""
    return parked(Mode.ENGAGING, 50, machine=machine)


MOVING = {"giant": (1500, 0.2), "rhi": (1300, 0.15)}
"""Ticks since a machine is rendered, and how fast one of its joints then is at least [rad/s]."""


@pytest.fixture
def moving(machine: str) -> Bench:
    """The hand walks, and the machine follows."""
    ticks, least = MOVING[machine]
    bench = parked(Mode.ACTIVE, ticks, machine=machine)
    assert np.abs(bench.plant.arm.qd).max() > least
    return bench


@pytest.fixture
def open_terminal() -> Iterator[Callable[..., Terminal]]:
    """Programs in windows of their own, which are gone after the test."""
    windows: list[Terminal] = []

    def begin(*arguments: Any, **options: Any) -> Terminal:
        windows.append(Terminal(*arguments, **options))
        return windows[-1]

    yield begin
    for window in windows:
        window.dispose()


@pytest.fixture
def open_hapticd(open_terminal: Callable[..., Terminal], tmp_path: Path) -> Iterator[Callable[..., Terminal]]:
    """Runs hapticd in a window, with its messages in the file stderr.txt."""
    with (tmp_path / "stderr.txt").open("wb") as errors:
        yield lambda *command: open_terminal([*HAPTICD, *command], tmp_path, stderr=errors)


@pytest.fixture
def write_config(tmp_path: Path) -> Callable[..., Path]:
    """A changed machine as files in a folder of their own."""

    def write(*changes: tuple[str, str], machine: str = "giant", model: str = "") -> Path:
        (tmp_path / f"{machine}.urdf").write_text(model or read_text(f"{machine}.urdf"))
        path = tmp_path / "machine.toml"
        path.write_text(changed(*changes, machine=machine))
        return path

    return write
