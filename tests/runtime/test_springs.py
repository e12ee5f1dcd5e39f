"""A machine whose springs are not what its controller believes: it learns them, and still finds lies."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import pytest
from hapticd.runtime.core.modes import Mode
from hapticd.testing import bench as benches
from hapticd.testing.copies import in_a_copy

from ..machines.giant.own_tables import OWN
from .conftest import Bench, after

BELIEVED = np.array([15e3, 15e3, 8e3, 8e3, 2.5e3, 2.5e3])
WALK = 3000
CARRYING = 3
"""Joint 4 carries the handle all the time, so that its spring is loaded."""


def springs(factor: str) -> Bench:
    return Bench((OWN, f"[simulation.plant]\nstiffness = {factor}\n\n"))


walking: Callable[[], benches.Bring] = functools.cache(lambda: after(Mode.ACTIVE, WALK))


def walked(factor: str) -> benches.Bench:
    """A session of a machine with other springs, after it walked for a while."""
    return benches.parked(springs, factor, walking())


def known(bench: benches.Bench) -> np.ndarray:
    record = np.zeros(1, bench.cycle.machine.state)
    bench.cycle.machine.bind_state(record)
    bench.cycle.machine.fill()
    found: np.ndarray = record["stiffness"][0]
    return found


@pytest.mark.parametrize("factor", ["0.62", "1.38"])
def test_springs_that_are_others_are_learnt_and_stop_nothing(factor: str) -> None:
    learns(walked(factor), float(factor))


@in_a_copy
def learns(bench: benches.Bench, factor: float) -> None:
    assert bench.mode is Mode.ACTIVE, bench.reason
    share = known(bench) / BELIEVED
    assert abs(share[CARRYING] - factor) < 0.9 * abs(1.0 - factor)
    assert (np.abs(share - 1.0) <= abs(1.0 - factor) + 1e-3).all()  # no spring is thought worse of than it is


def test_springs_that_are_as_believed_stay_so() -> None:
    stays(walked("1.0"))


@in_a_copy
def stays(bench: benches.Bench) -> None:
    assert (known(bench) == BELIEVED).all()


ERRING = """
[simulation.sensors.motor_encoder]
bias = "0.2 mrad"

[simulation.sensors.link_encoder]
bias = "0.2 mrad"

[simulation.sensors.load_torque]
noise = "0.1 N m"
bias = "0.5 N m"

[simulation.arm]
"""
WRIST = 5
"""Joint 6 of the Panda: its spring yields 2 mrad under the whole 12 N m of its motor."""

UNEQUAL = 3
"""Seed of sensors of which two contradict each other by more than the springs' tenth."""


def erring(seed: int) -> Bench:
    old = "[simulation]\nseed = 1\n", f"[simulation]\nseed = {seed}\n"
    return Bench(old, ("\n[simulation.arm]\n", ERRING), machine="panda")


engaged: Callable[[], benches.Bring] = functools.cache(lambda: after(Mode.ACTIVE, 200))


def test_encoders_of_stiff_springs_may_be_off_by_what_encoders_are() -> None:
    agrees(benches.parked(erring, UNEQUAL, engaged()))


@in_a_copy
def agrees(bench: benches.Bench) -> None:
    assert bench.mode is Mode.ACTIVE, bench.reason


@pytest.mark.parametrize("slip", [-2.5e-3, 2.5e-3])
@pytest.mark.parametrize("field", ["position", "link_position"])
def test_an_encoder_of_a_stiff_spring_that_slips_is_found(field: str, slip: float) -> None:
    slips(benches.parked(erring, UNEQUAL, engaged()), field, slip)


@in_a_copy
def slips(bench: benches.Bench, field: str, slip: float) -> None:
    node = bench.joints[WRIST]
    bench.after_sensing(lambda: setattr(node, field, getattr(node, field) + slip))
    bench.run(30)
    assert bench.reason in ("encoder_mismatch", "velocity_mismatch")


LIES: dict[str, tuple[str, Callable[[float], float]]] = {
    "torque sensor off": ("load_torque", lambda truth: truth + 35.0),
    "torque sensor turned over": ("load_torque", lambda truth: -truth),
    "motor encoder off": ("position", lambda truth: truth + 3.5e-3),
    "link encoder off": ("link_position", lambda truth: truth - 3.5e-3),
}


@pytest.mark.parametrize("factor", ["0.62", "1.38"])
@pytest.mark.parametrize("lie", LIES)
def test_lies_of_a_joint_with_another_spring_are_found(factor: str, lie: str) -> None:
    lies(walked(factor), *LIES[lie])


@in_a_copy
def lies(bench: benches.Bench, field: str, wrong: Callable[[float], float]) -> None:
    node = bench.joints[CARRYING]
    bench.after_sensing(lambda: setattr(node, field, wrong(getattr(node, field))))
    for _ in range(30):
        bench.run(1)
    assert bench.reason in ("encoder_mismatch", "torque_mismatch", "velocity_mismatch")
    bench.run(600)
    assert bench.mode is Mode.STOPPED and bench.safe
