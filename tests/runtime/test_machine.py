"""What gate and monitor hold a machine to: the numbers of its configuration and model."""

from dataclasses import astuple
from math import inf

import numpy as np
import pytest
from hapticd.machines.giant.machine import Giant
from hapticd.runtime.configuration.session import build

from .conftest import Bench, loaded

# name: largest command, step, power, and at which positions it is neutralised
GATE = {
    "giant": {
        "joint_1": (260.0, inf, 650.0, -inf, inf),
        "joint_2": (260.0, inf, 650.0, 0.435, 2.415),
        "joint_3": (110.0, inf, 330.0, -2.215, 1.215),
        "joint_4": (110.0, inf, 330.0, 0.085, 1.165),
        "joint_5": (40.0, inf, 160.0, -0.915, 2.215),
        "joint_6": (40.0, inf, 200.0, -1.215, 1.215),
        "ppu_x": (1.2, 0.006, inf, -1.63, 1.63),
        "ppu_y": (1.2, 0.006, inf, -1.93, 1.93),
    },
    "rhi": {
        "motor_1": (3.0, inf, 45.0, -1.025, 2.025),
        "motor_2": (3.0, inf, 45.0, -0.825, 2.625),
        "motor_3": (1.0, inf, 15.0, -1.825, 1.825),
        "motor_4": (1.0, inf, 15.0, -2.225, 2.225),
    },
}
# name: positions and speed at which the machine stops
MONITOR = {
    "giant": {
        "joint_1": (-inf, inf, 2.75),
        "joint_2": (0.42, 2.43, 2.75),
        "joint_3": (-2.23, 1.23, 3.3),
        "joint_4": (0.07, 1.18, 3.3),
        "joint_5": (-0.93, 2.23, 4.4),
        "joint_6": (-1.23, 1.23, 5.5),
        "ppu_x": (-1.66, 1.66, 1.32),
        "ppu_y": (-1.96, 1.96, 1.32),
    },
    "rhi": {
        "motor_1": (-1.05, 2.05, 16.5),
        "motor_2": (-0.85, 2.65, 16.5),
        "motor_3": (-1.85, 1.85, 16.5),
        "motor_4": (-2.25, 2.25, 16.5),
    },
}


def test_the_gate_and_the_monitor_hold_the_axes_to_the_built_in_configuration(machine: str) -> None:
    built = build(loaded(machine=machine)).cycle.machine
    assert {axis.peak for axis in built.axes} == {None}
    gate = {name: numbers for name, *numbers, _peak in map(astuple, built.axes)}
    assert gate == {name: pytest.approx(numbers) for name, numbers in GATE[machine].items()}
    t = built.thresholds
    monitor = dict(zip(t.axes, zip(t.lower, t.upper, t.speed, strict=True), strict=True))
    assert monitor == {name: pytest.approx(numbers) for name, numbers in MONITOR[machine].items()}


@pytest.mark.parametrize("machine", ["giant"])
def test_the_gantry_fades_in_with_the_operator_s_wrench(engaging: Bench) -> None:
    engaging.run(400)
    built, gain = engaging.cycle.machine, engaging.cycle.phase.gain
    assert isinstance(built, Giant)
    wanted = built._prepositioning.velocity
    assert gain == pytest.approx(0.15, abs=0.01)
    assert np.abs(wanted).max() > 0.03
    assert built.commands[6:] == pytest.approx(gain * wanted)
    told = [engaging.nodes[name].target_velocity for name in ("ppu_x", "ppu_y")]
    assert told == pytest.approx(gain * wanted, abs=1e-6)
