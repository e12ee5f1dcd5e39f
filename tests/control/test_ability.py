"""What the motors can give is a limit of the hierarchy like the others, judged with pinocchio's dynamics."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.control.force_control import ForceControl
from hapticd.experiments.own_plant import believed
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.config import Loaded
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.testing.bench import Bench
from hapticd.testing.copies import in_a_copy
from hapticd.testing.push import push

ROTOR = np.array([1.5, 1.5, 0.6, 0.6, 0.15, 0.15])
RATED = np.array([260.0, 260.0, 110.0, 110.0, 40.0, 40.0])


def giant(loaded: Loaded | None = None) -> Bench:
    bench = Bench(loaded or config.load("giant"))
    bench.until(Mode.ENGAGING, limit=1000)
    bench.run(300)
    return bench


def control_of(bench: Bench) -> ForceControl:
    control = bench.cycle.machine.force_control  # type: ignore[attr-defined]
    assert isinstance(control, ForceControl)
    return control


@in_a_copy
def test_the_forecast_is_what_the_dynamics_of_the_arm_say() -> None:
    bench = giant(believed(config.load("giant")))  # no dry friction in the load
    control = control_of(bench)
    ability = control.ability
    assert ability
    robot = bench.lockstep.session.robot.without(["ppu_x", "ppu_y"])
    model, data = robot.model, robot.data
    machine = bench.cycle.machine
    rendering = machine._rendering  # type: ignore[attr-defined]
    for _ in range(20):
        bench.run(100)
        control.arm.update()
        model.gravity.linear = np.array([*-machine._observer.qdd, -9.81])  # type: ignore[attr-defined]
        rendering._tracking.forecast(machine._observer.qdd)  # type: ignore[attr-defined]
        q = robot.configuration(control.q)
        M = pin.crba(model, data, q)
        M = np.triu(M) + np.triu(M, 1).T + np.diag(ROTOR)
        np.testing.assert_allclose(ability.inertia, M, atol=1e-9)
        h = pin.nonLinearEffects(model, data, q, control.qd)
        load = h + robot.damping * control.qd - control.handle.J.T @ rendering.wrench
        np.testing.assert_allclose(ability.load, load, atol=1e-9)


@in_a_copy
def test_under_any_pull_the_motors_are_asked_for_no_more_than_they_have_and_yield_as_the_pull_says() -> None:
    """A hand of 400 N is stronger than the machine: what it asks for is cut, and the arm goes with it."""
    bench = giant()
    bench.until(Mode.ACTIVE, limit=4000)
    most, begin = np.zeros(6), bench.plant.time
    pull = 400.0 * np.array([0.6, 0.8, 0.0, 0.0, 0.0, 0.0])
    bench.plant.hand.aim = lambda hold, time, *_: push(hold, min(1.0, (time - begin) / 0.2) * pull)
    for _ in range(600):
        bench.run(1)
        if bench.mode is not Mode.ACTIVE:
            break
        most = np.maximum(most, np.abs(bench.cycle.machine.commands[:6]))
        assert bench.cycle.gate.clamps == 0
    assert (most <= RATED).all()
    assert (most > 0.95 * RATED).any()


@pytest.mark.parametrize("detection", ["previous", "redetect"])
@in_a_copy
def test_the_printed_rules_know_nothing_of_torques(detection: str) -> None:
    text = read_text("giant.toml").replace('detection = "gauss"', f'detection = "{detection}"')
    parsed = config.parse(text, "giant.toml")
    loaded = config.Loaded("giant", parsed, text, "giant.toml", read_text("giant.urdf"), "giant.urdf")
    machine = build(loaded).cycle.machine
    assert machine.force_control.ability is None  # type: ignore[attr-defined]
