"""Sessions in lockstep, with changes to the built-in giant."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hapticd.configs import read_text
from hapticd.runtime import config
from hapticd.runtime.lockstep import Lockstep
from hapticd.runtime.modes import Command, Mode
from hapticd.runtime.session import build

GIANT = read_text("giant.toml")


def changed(*changes: tuple[str, str]) -> str:
    """The giant's configuration with some texts replaced, each of which must occur."""
    text = GIANT
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def loaded(*changes: tuple[str, str]) -> config.Loaded:
    text = changed(*changes)
    return config.Loaded(
        "giant", config.parse(text, "giant.toml"), text, "giant.toml", read_text("giant.urdf"), "giant.urdf"
    )


class Bench:
    """A lockstep session that remembers what happened."""

    def __init__(self, *changes: tuple[str, str]) -> None:
        self.lockstep = Lockstep(build(loaded(*changes)))
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

    @property
    def torques(self) -> list[float]:
        return [self.nodes[f"joint_{i}"].torque for i in range(1, 7)]

    @property
    def safe(self) -> bool:
        return self.plant.safe


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def engaging() -> Bench:
    """Drives enabled, the operator's wrench fading in."""
    bench = Bench()
    bench.until(Mode.ENGAGING)
    bench.run(50)
    return bench


@pytest.fixture
def write_config(tmp_path: Path) -> Callable[..., Path]:
    """A changed giant as files in a folder of their own."""

    def write(*changes: tuple[str, str], model: str = "") -> Path:
        (tmp_path / "giant.urdf").write_text(model or read_text("giant.urdf"))
        path = tmp_path / "machine.toml"
        path.write_text(changed(*changes))
        return path

    return write
