"""A stop of an arm whose joints do not yield, under a hand that presses against its box."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hapticd.machines.arm.init import init
from hapticd.runtime.configuration.config import Loaded, parse
from hapticd.runtime.core.modes import Mode
from hapticd.safety import Reaction, Verdict
from hapticd.testing.bench import Bench
from hapticd.testing.copies import in_a_copy

from .arms import planar

PRESSED = 4300
"""Tick at which the hand of `hapticd init` presses against a side of the box with all it has, 9 N."""
LASTS = 700
"""Ticks until the machine holds."""


@pytest.fixture(scope="module")
def pressed() -> Bench:
    found = init(planar(), "planar.urdf", None, "planar.toml", "planar.clean.urdf")
    config = parse(found.toml, "planar.toml")
    bench = Bench(Loaded("arm", config, found.toml, "planar.toml", found.urdf, "planar.clean.urdf"))
    bench.run(PRESSED)
    assert np.linalg.norm(bench.plant.wrench[:3]) > 8.9
    return bench


def held(bench: Bench) -> tuple[float, float]:
    """How far beyond its box a stop lets the handle go [m], and how far joints yield [rad]."""
    bench.cycle.stops.take(Verdict(Reaction.HOLD, "test", "a controlled stop"), bench.tick_index)
    (box,) = bench.lockstep.session.config.arm.boxes  # type: ignore[attr-defined]
    control = bench.cycle.machine.force_control  # type: ignore[attr-defined]
    beyond = yields = 0.0
    for _ in range(LASTS):
        bench.run(1)
        position = np.array(bench.plant.arm.position)
        beyond = max(beyond, *(position - box.upper), *(np.array(box.lower) - position))
        yields = max(yields, np.abs(bench.plant.arm.q - control.q).max())
    assert bench.mode is Mode.HOLDING
    return beyond, yields


@in_a_copy
def test_who_presses_against_a_box_is_held_there_by_what_the_torque_sensors_show(pressed: Bench) -> None:
    """Without what the hand pulls with, motors yield by torque / gain: 3.7 mm here."""
    beyond, _ = held(pressed)
    assert beyond < 0.5e-3


@pytest.mark.parametrize("force", [30.0, -30.0, 400.0])
@in_a_copy
def test_a_sensor_that_lies_is_not_believed_without_springs_either(pressed: Bench, force: float) -> None:
    """The joints yield to the hand as without any sensor, by 11.2 mrad, and to the lie by a tenth more."""
    sense, felt = pressed.plant._sense, pressed.nodes["force_torque"].fields["wrench"]

    def lying() -> None:
        sense()
        felt[0] += force

    pressed.plant._sense = lying
    _, yields = held(pressed)
    assert yields < 0.0123
    rendering = pressed.cycle.machine._rendering  # type: ignore[attr-defined]
    assert np.linalg.norm(rendering.wrench[:3]) < 1e-3


def test_an_arm_whose_joints_are_slow_stands_although_its_drives_measure_speeds_with_noise() -> None:
    found = init(planar(), "planar.urdf", None, "planar.toml", "planar.clean.urdf")
    slow = re.sub(r'(?m)^velocity = "[\d.]+ rad/s"', 'velocity = "0.1 rad/s"', found.toml)
    assert slow.count('velocity = "0.1 rad/s"') == 3
    noisy = f'{slow}\n[simulation.sensors.motor_speed]\nnoise = "0.002 rad/s"\n'
    for encoder in ("motor", "link"):
        noisy += f'[simulation.sensors.{encoder}_encoder]\nnoise = "1e-5 rad"\n'
    config = parse(noisy, "planar.toml")
    bench = Bench(Loaded("arm", config, noisy, "planar.toml", found.urdf, "planar.clean.urdf"))
    bench.until(Mode.ENGAGING)
