"""Random motions of machines that are not what their controllers believe: some to a contact, some past it.

The shapes of the URDF judge, by coal, at the place where the machine truly is.
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np
import pytest
from hapticd.experiments.collisions import AWAY, TOWARDS, Motion, Truth, Verdict, _place, draw, judge
from hapticd.experiments.giant_collisions import FIRST
from hapticd.machines.arm.machine import foreseen_limits
from hapticd.machines.rendering import foresight
from hapticd.models import Robot
from hapticd.runtime.configuration.config import load
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.safety import Reaction

A_BOX, THE_FLOOR = 1001, 1007
"""Seeds of motions of the Panda to a contact."""
FREE = (1000,)
"""Seeds of motions that meet nothing."""
DOZEN = 12


@pytest.mark.parametrize(("seed", "met"), [(A_BOX, "box 1"), (THE_FLOOR, "the floor")])
def test_a_motion_to_a_contact_is_halted_before_it(seed: int, met: str) -> None:
    verdict = judge(load("panda"), seed)
    ahead, without = verdict.ahead, verdict.without
    assert ahead.stop == "collision_ahead" and f"would have met {met} in " in ahead.detail
    assert without and without.contact < inf
    assert ahead.contact == inf and ahead.least > 0.0
    assert verdict.kind == "halted"


def test_what_is_pushed_too_near_while_it_is_held_is_switched_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """Brakes hold more than motors. What is near is what counts as near: the threshold comes to the arm."""
    drawn, truth = draw(load("panda"), THE_FLOOR)
    lockstep = Lockstep(build(drawn))
    cycle = lockstep.session.cycle
    while cycle.mode is not Mode.HOLDING:
        lockstep.tick()
    lockstep.run(100)
    config: Any = drawn.config
    near, margin = truth.near(_place(lockstep.plant)), config.look_ahead.margin
    assert cycle.mode is Mode.HOLDING and near > foresight.PRESSED_SHARE * margin
    monkeypatch.setattr(foresight, "PRESSED_SHARE", 0.5 * near / margin)
    lockstep.run(5)
    assert cycle.mode is Mode.HOLDING
    monkeypatch.setattr(foresight, "PRESSED_SHARE", 1.5 * near / margin)
    lockstep.run(400)
    assert cycle.mode is Mode.STOPPED
    assert cycle.stops.last and cycle.stops.last.verdict.reaction is Reaction.RAMP
    verdict = cycle.stops.last.verdict
    assert verdict.reason == "collision_ahead" and "handle" in verdict.detail


@pytest.mark.parametrize("seed", FREE)
def test_a_motion_that_meets_nothing_goes_on(seed: int) -> None:
    verdict = judge(load("panda"), seed)
    assert verdict.kind == "free" and verdict.ahead.began


def test_a_machine_that_does_not_start_says_nothing_of_the_look_ahead() -> None:
    still = Motion("", inf, "", False, 0.2, inf)
    assert Verdict(1, 0.02, still, None).kind == "never began"
    assert "never began" not in TOWARDS + AWAY


@pytest.mark.slow
@pytest.mark.parametrize("machine", ["giant", "panda"])
def test_of_two_dozen_motions_none_comes_to_a_contact_and_few_are_halted_for_nothing(machine: str) -> None:
    loaded = load(machine)
    kinds = [judge(loaded, FIRST + i).kind for i in range(2 * DOZEN)]
    assert not {"missed", "too late", "other stop", "never began"} & set(kinds)
    assert kinds.count("halted") >= DOZEN // 2
    assert kinds.count("halted for nothing") <= 1


def test_the_truth_is_that_of_coal_on_both_sides_of_where_it_judges() -> None:
    """Far away the look-ahead's own distances are taken, near by coal's: they are the same."""
    loaded = load("panda")
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    config: Any = loaded.config
    limits = foreseen_limits(config, robot)
    truth = Truth(robot, loaded, config.look_ahead, limits)
    rng = np.random.default_rng(2)
    apart = 0
    for q in rng.uniform(*limits, (200, robot.nv)):
        least = truth._least(q)
        if least > 0.0:
            assert least == pytest.approx(truth.near(q), abs=1e-6)
            apart += 1
    assert apart > 100
