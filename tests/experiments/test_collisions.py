"""Random motions of machines that are not what their controllers believe: some to a contact, some past it.

The shapes of the URDF judge, by coal, at the place where the machine truly is.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Any

import msgspec
import numpy as np
import pytest
from hapticd.configs.quantities import Clearance
from hapticd.experiments.collisions import REASON, SECONDS, Truth, draw, judge, run
from hapticd.experiments.giant_collisions import FIRST
from hapticd.machines.arm.machine import foreseen_limits
from hapticd.machines.rendering import foresight
from hapticd.models import Robot
from hapticd.runtime.configuration.config import load

ITSELF, THE_FLOOR = 1022, 1023
"""Seeds of motions of the Panda to a contact."""
PUSHED = 119
"""The hand goes on for 0.3 s after the halt."""
FREE = (1000,)
"""Seeds of motions that meet nothing."""
DOZEN = 12


@pytest.mark.parametrize(("seed", "met"), [(ITSELF, "link_2"), (THE_FLOOR, "the floor")])
def test_a_motion_to_a_contact_is_halted_before_it(seed: int, met: str) -> None:
    verdict = judge(load("panda"), seed)
    ahead, without = verdict.ahead, verdict.without
    assert ahead.stop == REASON and f"would have met {met} in " in ahead.detail
    assert without and without.contact < inf
    assert ahead.contact == inf and ahead.least > 0.0
    assert verdict.kind == "halted"


def test_a_hand_that_pushes_a_held_machine_on_is_met_by_its_brakes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Springs that are not as believed contradict the sensor: what holds against the hand fades."""
    loaded = load("panda")
    config: Any = loaded.config
    near = msgspec.structs.replace(config.look_ahead, margin=Clearance(0.01))
    drawn, truth = draw(replace(loaded, config=msgspec.structs.replace(config, look_ahead=near)), PUSHED)
    braked = run(drawn, truth, SECONDS)
    monkeypatch.setattr(foresight, "PRESSED_SHARE", 0.0)
    held = run(drawn, truth, SECONDS)
    assert braked.stop == held.stop == REASON
    assert 0.0 < braked.least
    assert held.least < braked.least - 1e-3


@pytest.mark.parametrize("seed", FREE)
def test_a_motion_that_meets_nothing_goes_on(seed: int) -> None:
    assert judge(load("panda"), seed).kind == "free"


@pytest.mark.slow
@pytest.mark.parametrize("machine", ["giant", "panda"])
def test_of_two_dozen_motions_none_comes_to_a_contact_and_few_are_halted_for_nothing(machine: str) -> None:
    loaded = load(machine)
    kinds = [judge(loaded, FIRST + i).kind for i in range(2 * DOZEN)]
    assert not {"missed", "too late", "other stop"} & set(kinds)
    assert kinds.count("halted") >= 3
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
