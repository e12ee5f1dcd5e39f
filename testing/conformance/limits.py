"""No command beyond what an axis may, whatever the controller computes; no posture beyond its limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf, isfinite, nan
from typing import Any

import numpy as np
import pytest

from ...runtime.core.modes import Mode
from ...safety import Monitor
from ...sim.person import DIRECTIONS, Deed
from ..bench import Bench
from .stops import come_to_rest

PULLED_S = 1.0
PULSE_S = 0.1
"""How often a person who leads the hand pushes; each adds 10 N, up to 30 N."""
SCRIPT_S = 2.0


def spoil(bench: Bench, change: Callable[[list[float], int], None]) -> None:
    """The controller computes something else, tick by tick."""
    machine, tick = bench.cycle.machine, 0
    update = machine.update

    def broken(gain: float, trust: float) -> None:
        nonlocal tick
        update(gain, trust)
        change(machine.commands, tick)
        tick += 1

    machine.update = broken  # type: ignore[method-assign]


def obeyed(bench: Bench) -> None:
    """What was written is a number within the limits of its axis."""
    axes = bench.cycle.machine.axes
    for command, axis in zip(bench.cycle.gate.admitted, axes, strict=True):
        assert isfinite(command) and abs(command) <= axis.command, axis.name


@pytest.mark.parametrize("command", [nan, inf, -inf])
def test_a_command_that_is_not_a_number_reaches_no_drive_and_ends_it(moving: Bench, command: float) -> None:
    spoil(moving, lambda commands, _: commands.__setitem__(-1, command))
    for _ in range(4):
        moving.run(1)
        obeyed(moving)
    assert moving.reason == "output_not_finite"
    moving.run(3)
    assert moving.mode is Mode.STOPPED and moving.safe
    assert moving.plc.sto


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_command_beyond_its_limit_is_cut_and_stops_the_machine(engaging: Bench, sign: float) -> None:
    spoil(engaging, lambda commands, _: commands.__setitem__(-1, sign * 1e6))
    for _ in range(engaging.ticks(20e-3)):
        engaging.run(1)
        obeyed(engaging)
    assert engaging.mode >= Mode.STOPPING
    engaging.until(Mode.STOPPED, Mode.HOLDING, limit=engaging.cycle.stops.hold_limit)


@pytest.mark.parametrize(("wrong", "every"), [(1e6, 10), (nan, 3)])
def test_wrong_commands_that_pause_now_and_then_stop_it_as_well(
    engaging: Bench, wrong: float, every: int
) -> None:
    def change(commands: list[float], tick: int) -> None:
        if tick % every:
            commands[-1] = wrong * (1 if tick // 20 % 2 else -1)

    spoil(engaging, change)
    for _ in range(engaging.ticks(60e-3)):
        engaging.run(1)
        obeyed(engaging)
    assert engaging.mode >= Mode.STOPPING


def test_solves_that_fail_stop_it(moving: Bench) -> None:
    machine = moving.cycle.machine
    spoil(moving, lambda commands, tick: setattr(machine, "solved", False))
    moving.run(4)
    assert moving.reason == "solve_failed"
    come_to_rest(moving)


@pytest.mark.parametrize("what", ["upper", "lower", "speed"])
def test_an_axis_beyond_its_hard_limit_stops_it(moving: Bench, what: str) -> None:
    machine = moving.cycle.machine
    axis = int(np.argmax(np.abs(machine.velocity)))
    q, v = machine.position[axis], machine.velocity[axis]
    # the limit comes to the axis: a measurement that jumps would not be believed
    value = {"upper": q - 0.5, "lower": q + 0.5, "speed": 0.5 * abs(v)}[what]
    allowed = [*getattr(machine.thresholds, what)]
    allowed[axis] = value
    narrowed: dict[str, Any] = {what: tuple(allowed)}
    moving.cycle.senses.monitor = Monitor(replace(machine.thresholds, **narrowed))
    moving.run(6)
    assert moving.reason == "beyond_limit"


def kept(bench: Bench) -> None:
    """What the machine says it may touch is within the margins that its configuration declares."""
    session = bench.lockstep.session
    limits = session.system.limits(session.config)
    margin = session.config.safety.position_margin
    state = np.zeros(1, bench.cycle.machine.state)
    bench.cycle.machine.bind_state(state)
    bench.cycle.machine.fill()
    for spec, value in zip(limits.specs, limits.values(state[0]), strict=True):
        slack = ROUNDING * max(abs(spec.upper), 1.0) if spec.unit == "N m" else margin
        assert spec.lower - slack <= value <= spec.upper + slack, f"{spec.name} at {value:g} {spec.unit}"


ROUNDING = 1e-3
"""Rounding of a torque on the wire, as a share of its limit."""


def test_the_script_of_the_hand_keeps_to_the_limits(moving: Bench) -> None:
    for _ in range(moving.ticks(SCRIPT_S) // 10):
        moving.run(10)
        kept(moving)
        obeyed(moving)
    assert moving.mode is Mode.ACTIVE, moving.said[-3:]


@pytest.mark.parametrize("deed", DIRECTIONS)
def test_a_person_who_pulls_for_a_second_takes_it_nowhere_beyond(moving: Bench, deed: Deed) -> None:
    pulse = moving.ticks(PULSE_S)
    for _ in range(round(PULLED_S / PULSE_S)):
        moving.plant.obey(Deed.PRESS)
        moving.plant.obey(deed)
        for _ in range(pulse // 10):
            moving.run(10)
            kept(moving)
            obeyed(moving)
    assert moving.mode is Mode.ACTIVE, moving.said[-3:]
