"""Joints that do not follow, and a force-torque sensor that froze or is biased, on a machine that moves."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, radians, sin
from typing import Any

import numpy as np
import pytest
from hapticd.experiments.own_plant import believed
from hapticd.runtime.configuration.config import load
from hapticd.runtime.core.modes import Mode
from hapticd.sim.person import Deed, Lead
from hapticd.testing import bench as benches
from hapticd.testing.copies import in_a_copy
from hapticd.testing.push import push

from .conftest import Bench, parked

WIRE = 2
"""Ticks from the plant's sample to the tick that reads it."""


def active(ticks: int) -> Bench:
    return parked(Mode.ACTIVE, ticks)


def stick(bench: Bench, joint: int) -> None:
    """The brake of a joint closes and stays so, whatever its drive says."""
    arm = bench.plant.arm
    step = arm.step

    def stuck(torque: Any, braked: Sequence[bool], *rest: Any) -> None:
        step(torque, [closed or i == joint for i, closed in enumerate(braked)], *rest)

    arm.step = stuck


@pytest.mark.parametrize("joint", [0, 1, 2])
@in_a_copy
def test_a_joint_whose_brake_sticks_stops_the_machine(joint: int) -> None:
    bench = active(1500)
    stick(bench, joint)
    bench.until(Mode.STOPPING, Mode.STOPPED, limit=1000)
    assert bench.reason in ("torque_mismatch", "encoder_frozen")
    bench.until(Mode.STOPPED, limit=500)
    assert bench.safe


@pytest.mark.parametrize(("angle", "exact"), [(300.0, False), (120.0, True)])
@in_a_copy
def test_a_hand_of_150_n_from_one_moment_to_the_next_is_followed(angle: float, exact: bool) -> None:
    """Joint 1 gets all of its torque, some half of it for the hand; its spring is wound up."""
    bench = benches.Bench(believed(load("giant"))) if exact else active(0)
    bench.until(Mode.ACTIVE, limit=5000)
    x, y, z = bench.plant.hand.handle
    place = x + 2.0 * cos(radians(angle)), y + 2.0 * sin(radians(angle)), z + 0.8
    bench.plant.obey(Deed.PRESS)
    bench.plant.obey(Lead(place))
    whole, machine = 0, bench.cycle.machine
    for _ in range(400):
        bench.run(1)
        assert (bench.mode, bench.reason, machine.overload) == (Mode.ACTIVE, "", "")
        assert abs(machine.force_control.ability.load[0]) < 0.6 * 260.0
        whole += abs(bench.torques[0]) > 0.98 * 260.0
    assert whole > 10
    assert np.linalg.norm(bench.plant.arm.hold.wrench[:3]) > 140.0


@in_a_copy
def test_the_base_joint_is_pulled_at_with_no_more_than_its_motor_before_it_is_found_stuck() -> None:
    bench = active(500)
    stick(bench, 0)
    peak, ticks = 0.0, 0
    while bench.mode is Mode.ACTIVE and ticks < 1000:
        bench.run(1)
        ticks += 1
        peak = max(peak, abs(bench.torques[0]))
    assert bench.reason == "torque_mismatch"
    assert ticks < 150
    assert peak <= 260.0


@in_a_copy
def test_a_frozen_force_torque_sensor_on_a_machine_that_moves_fades_out_and_stops_it() -> None:
    bench = active(1500)
    bench.break_sensor("force_torque", "wrench", [30.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    ticks = 0
    while bench.mode is Mode.ACTIVE and ticks < 1000:
        bench.run(1)
        ticks += 1
    assert bench.reason == "wrench_lost"
    assert ticks <= WIRE + 20 + 21
    assert np.linalg.norm(bench.plant.arm.twist[:3]) < 1.2


@in_a_copy
def test_a_sensor_that_shows_the_same_on_a_machine_at_rest_may_go_on() -> None:
    bench = parked(Mode.READY, 0)
    bench.break_sensor("force_torque", "wrench", [0.0] * 6)
    bench.run(100)
    assert bench.mode in (Mode.READY, Mode.ENABLING, Mode.ENGAGING)
    assert bench.reason == ""


@in_a_copy
def test_a_released_handle_does_not_wander_off_on_a_biased_sensor() -> None:
    bench = active(500)
    bench.plant.hand.aim = lambda hold, *_: push(hold, np.zeros(6))
    sensor = bench.nodes["force_torque"]
    bias = np.array([1.0, -1.0, 1.0, 0.1, 0.1, -0.1])
    bench.after_sensing(lambda: setattr(sensor, "wrench", (np.array(sensor.wrench) + bias).tolist()))
    bench.run(10_000)
    assert bench.mode is Mode.ACTIVE
    velocity = bench.plant.arm.twist[:3] + np.array([*bench.plant.ppu.velocity, 0.0])
    assert np.linalg.norm(velocity) < 0.01
    assert np.linalg.norm(bench.plant.arm.twist[3:]) < 0.1
