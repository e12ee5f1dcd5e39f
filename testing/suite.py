"""What the conformance suite starts from: each machine of a run, and the states that tests begin in."""

from __future__ import annotations

import pytest

from ..runtime.core.modes import Command, Mode
from ..sim.person import Deed
from .bench import Bench, parked
from .cases import MACHINE, load, parametrize, unpressed
from .plugin import PACKAGE, machines

SETTLED = 50
"""Ticks after which a machine that waits, or engages, is watched from."""
RINGS_S = 3.0
"""Time in which a machine without power has come to rest."""
MOVING_SHARE = 0.01
"""Speed of an axis, as a share of its largest, at which a machine counts as moving."""
MOVES_WITHIN_S = 10.0
"""Time from the twin's being rendered in which the scripted hand must have moved the machine."""
CARRIED_S = 0.3
"""It goes on moving for so long before tests begin."""


def pytest_configure(config: pytest.Config) -> None:
    """Refuse a machine that is none before anything runs."""
    for name in machines(config):
        load(name)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Over the machines, and over their devices."""
    if metafunc.module.__name__.startswith(PACKAGE) and MACHINE in metafunc.fixturenames:
        parametrize(metafunc, machines(metafunc.config))


def on_a_bench(name: str) -> Bench:
    """A machine that nobody has armed."""
    return Bench(unpressed(load(name)))


def wait(bench: Bench) -> None:
    """Bring it up; springs that its brakes have loaded ring out."""
    bench.until(Mode.READY, limit=bench.ticks(5.0))
    still = 0
    for _ in range(bench.ticks(RINGS_S)):
        bench.run(1)
        still = still + 1 if bench.cycle.senses.at_rest else 0
        if still == SETTLED:
            return
    raise AssertionError(f"does not stand within {RINGS_S:g} s, though no drive has power")


def start(bench: Bench) -> None:
    """Bring it up, and press: its drives are enabled."""
    wait(bench)
    bench.press(True)
    bench.until(Mode.ENGAGING, limit=bench.ticks(2.0))


def activate(bench: Bench) -> None:
    """Until the operator's wrench has faded in."""
    start(bench)
    fade = bench.lockstep.session.config.arming.fade
    bench.until(Mode.ACTIVE, limit=bench.ticks(fade + 1.0))


def _nothing(bench: Bench) -> None:
    """A session that has not begun."""


def _engage(bench: Bench) -> None:
    start(bench)
    bench.run(SETTLED)


def _move(bench: Bench) -> None:
    activate(bench)
    machine = bench.cycle.machine
    for _ in range(bench.ticks(MOVES_WITHIN_S)):
        shares = (abs(v) / most for v, most in zip(machine.velocity, machine.thresholds.speed, strict=True))
        if max(shares) > MOVING_SHARE:
            break
        bench.run(1)
    else:
        raise AssertionError(f"let the hand's path move the machine within {MOVES_WITHIN_S:g} s of rendering")
    bench.run(bench.ticks(CARRIED_S))
    assert bench.mode is Mode.ACTIVE, bench.said[-3:]


@pytest.fixture
def new_bench(machine_name: str) -> Bench:
    """Before the first tick."""
    return parked(on_a_bench, machine_name, _nothing)


@pytest.fixture
def waiting(machine_name: str) -> Bench:
    """All devices answer, drives are off, nobody has pressed."""
    return parked(on_a_bench, machine_name, wait)


@pytest.fixture
def engaging(machine_name: str) -> Bench:
    """Drives enabled, the operator's wrench fading in."""
    return parked(on_a_bench, machine_name, _engage)


@pytest.fixture
def moving(machine_name: str) -> Bench:
    """The hand moves the machine along its path."""
    return parked(on_a_bench, machine_name, _move)


def reset(bench: Bench) -> None:
    """Let go, wait, and reset: it is ready again. The hand stays at the handle, and pulls no more."""
    bench.plant.obey(Deed.RELEASE)
    bench.until(Mode.STOPPED)
    bench.run(SETTLED)
    bench.run(bench.ticks(0.6), Command.RESET)
    assert bench.mode is Mode.READY, bench.said[-3:]
