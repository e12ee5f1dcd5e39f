"""The cycle in closed loop with the simulated machine: what should stand is watched."""

import functools
from collections.abc import Sequence
from math import nan

import numpy as np
import pytest
from hapticd.devices.cia402 import State
from hapticd.runtime.core.machine import SPEED_MARGIN
from hapticd.runtime.core.measured import JUMP_MARGIN, TOP_SPEED_S
from hapticd.runtime.core.modes import Command, Mode
from hapticd.safety import Reaction
from hapticd.sim import faults
from hapticd.testing.bench import creep

from .conftest import Bench

NOBODY_PRESSES = ('dead_man = [{ at = "0.3 s", pressed = true }]', "dead_man = []")


def displace(bench: Bench, joint: int, by: float) -> None:
    """The arm is somewhere else at once, springs loaded as before."""
    arm = bench.plant.arm  # type: ignore[attr-defined]
    arm.q[joint] += by
    if hasattr(arm, "motor"):
        arm.motor[joint] += by
    arm._observe()


def slide(bench: Bench, joint: int, by: float) -> None:
    """The arm is moved, tick by tick, as fast as its encoders are believed, whatever holds it."""
    dt, left, step = 1.0 / bench.lockstep.session.config.loop.rate, by, 0.0
    most = 0.9 * JUMP_MARGIN / SPEED_MARGIN * bench.cycle.machine.thresholds.speed[joint] * dt
    faster = 0.4 * most * dt / TOP_SPEED_S
    arm, move = bench.plant.arm, bench.plant._move  # type: ignore[attr-defined]
    q, motor = arm.q[joint], arm.motor[joint] if hasattr(arm, "motor") else 0.0

    def moved(dt: float) -> None:
        nonlocal left, step, q, motor
        move(dt)
        if left <= 0.0:
            return
        step = min(step + faster, most, (2.0 * faster * left) ** 0.5, left)
        left = left - step if left - step > 1e-9 else 0.0
        q, motor = q + step, motor + step
        arm.q[joint], arm.qd[joint] = q, step / dt if left else 0.0
        if hasattr(arm, "motor"):
            arm.motor[joint], arm.motor_rate[joint] = motor, arm.qd[joint]
        arm._observe()

    bench.plant._move = moved  # type: ignore[attr-defined]


def peak_torques(bench: Bench, ticks: int) -> list[float]:
    """Largest torque of each motor, as a share of what it may give at most."""
    peaks = [abs(torque) for torque in bench.torques]
    for _ in range(ticks):
        bench.run(1)
        peaks = [max(peak, abs(torque)) for peak, torque in zip(peaks, bench.torques, strict=True)]
    axes = bench.cycle.machine.axes[: len(peaks)]
    return [peak / axis.command for peak, axis in zip(peaks, axes, strict=True)]


@pytest.mark.parametrize("speed", [1.0, 0.3])
@pytest.mark.parametrize("mode", [Mode.STOPPED, Mode.READY])
def test_a_brake_that_slips_brings_the_torque_off_and_is_latched(
    machine: str, mode: Mode, speed: float
) -> None:
    bench = Bench(*([NOBODY_PRESSES] if mode is Mode.READY else []), machine=machine)
    if mode is Mode.STOPPED:
        bench.until(Mode.ENGAGING)
        bench.press(False)
    bench.until(mode)
    bench.run(50)
    creep(bench, bench.joints[1], speed)
    play, ticks = bench.cycle.machine.play[1], 0
    while bench.cycle.stops.latch.reaction is not Reaction.OFF:
        bench.run(1)
        ticks += 1
        assert ticks * speed * 1e-3 < 1.1 * play + 0.01
    bench.run(3)
    assert (bench.mode, bench.reason) == (Mode.STOPPED, "moved")
    assert bench.plc.sto
    name = bench.joints[1].device.name
    assert any(f"{name} moves, though its brake should hold it" in event for event in bench.said)


def test_a_held_machine_that_is_pushed_away_is_switched_off(engaging: Bench) -> None:
    engaging.last_drive.tamper = faults.drop(6)
    engaging.until(Mode.HOLDING)
    engaging.run(50)
    slide(engaging, 1, 0.5)  # and motors that are too weak to bring it back
    brake, machine = engaging.cycle.machine.brake, engaging.cycle.machine

    def weak(dropped: Sequence[bool]) -> bool:
        at_rest = brake(dropped)
        machine.commands = [0.01 * command for command in machine.commands]
        return at_rest

    machine.brake = weak  # type: ignore[method-assign]
    engaging.until(Mode.STOPPED, limit=400)
    # what pushes it here goes through no spring
    assert engaging.reason in ("moved", "beyond_limit", "torque_mismatch")
    assert engaging.cycle.stops.latch.reaction is Reaction.RAMP
    engaging.run(5)
    assert engaging.safe


@pytest.mark.parametrize("mode", [Mode.READY, Mode.STOPPED, Mode.HOLDING])
def test_a_machine_that_is_left_alone_stands(machine: str, mode: Mode) -> None:
    bench = Bench(*([NOBODY_PRESSES] if mode is Mode.READY else []), machine=machine)
    if mode is not Mode.READY:
        bench.until(Mode.ENGAGING)
        bench.run(50)
    if mode is Mode.STOPPED:
        bench.press(False)
    if mode is Mode.HOLDING:
        bench.last_drive.tamper = faults.drop(6)
    bench.until(mode)
    bench.run(1500)
    assert bench.mode is mode


@pytest.mark.parametrize("machine", ["giant"])
@pytest.mark.parametrize("cause", ["dead-man", "e-stop"])
def test_brakes_that_catch_a_moving_machine_do_not_slip(moving: Bench, cause: str) -> None:
    if cause == "dead-man":
        moving.press(False)
    else:
        moving.plc.emergency_stop = (True, True)
    moving.until(Mode.STOPPED)
    moving.run(3000)  # the hand pulls on along its path
    assert moving.reason == ("dead_man" if cause == "dead-man" else "e_stop")
    assert not any("moves, though" in event for event in moving.said)


def fastest_back(bench: Bench, joint: int, ticks: int) -> float:
    """How fast a joint that was moved forwards comes back, as a share of the speed that stops."""
    back = 0.0
    for _ in range(ticks):
        bench.run(1)
        back = min(back, bench.plant.arm.qd[joint])  # type: ignore[attr-defined]
    return -back / bench.cycle.machine.thresholds.speed[joint]


@pytest.mark.parametrize("by", [0.5, 0.05, 0.01])
@pytest.mark.parametrize("delay", range(3))  # of four ticks until there is torque
def test_what_is_moved_between_the_press_and_the_first_torque_is_not_pulled_back(
    bench: Bench, by: float, delay: int
) -> None:
    bench.until(Mode.ENABLING)
    bench.run(delay)
    slide(bench, 1, by)
    assert fastest_back(bench, 1, 300) < 0.12
    if by >= 0.05:
        assert bench.mode is Mode.STOPPED and bench.safe
        assert bench.cycle.stops.latch.reaction is Reaction.OFF
        assert bench.reason in ("moved", "output_beyond_limit")  # the hold gives all it has, in vain


@pytest.mark.parametrize("by", [0.5, 0.2, 0.05])
@pytest.mark.parametrize("delay", range(4))
def test_a_joint_that_is_somewhere_else_at_once_while_the_drives_switch_on_is_not_believed_nor_pulled_back(
    bench: Bench, by: float, delay: int
) -> None:
    bench.until(Mode.ENABLING)
    bench.run(delay)
    bench.events.clear()
    displace(bench, 1, by)  # no joint is so fast: its encoders are wrong, for all that anybody knows
    peaks = peak_torques(bench, 300)
    assert max(peaks) < 0.5  # what gravity takes, and what brakes an arm that the hand lets spring back
    assert bench.mode is Mode.STOPPED and bench.safe
    assert "R3 encoder_jump" in next(event for event in bench.said if event.startswith("STOPP"))


@pytest.mark.parametrize("delay", range(5))
def test_a_stop_just_as_the_drives_get_torque_switches_them_off_again_without_a_ramp(
    bench: Bench, delay: int
) -> None:
    bench.until(Mode.ENGAGING)
    bench.run(delay)
    bench.run(1, Command.STOP)
    assert bench.mode is Mode.STOPPED
    bench.run(3)
    assert bench.safe


@functools.cache
def quiet_peaks(machine: str) -> list[float]:
    """The same of a start that nothing disturbs: what holds gravity and the hand."""
    bench = Bench(machine=machine)
    bench.until(Mode.ENABLING)
    return peak_torques(bench, 110)


@pytest.mark.parametrize("delay", range(6))
def test_one_bad_sample_while_the_drives_switch_on_pulls_at_nothing(
    bench: Bench, machine: str, delay: int
) -> None:
    bench.until(Mode.ENABLING)
    bench.run(delay)
    bench.break_sensor(bench.joints[1].device.name, "link_position", 1.5, samples=1)
    peaks = peak_torques(bench, 100)
    assert peaks[1] < quiet_peaks(machine)[1] + 0.12


def test_a_machine_that_moves_while_one_drive_takes_its_time_is_engaged_where_it_is(bench: Bench) -> None:
    slow = bench.joints[-1]
    slow.deaf = True
    bench.until(Mode.ENABLING)
    bench.run(50)
    slide(bench, 1, 0.02)
    bench.run(50)
    slow.deaf = False
    assert fastest_back(bench, 1, 100) < 0.12
    assert bench.mode in (Mode.ENGAGING, Mode.STOPPED)
    assert State.FAULT not in {joint.state for joint in bench.joints}


class Far:
    """Where a hand pulls that is stronger than the motors."""

    @staticmethod
    def at(t: float) -> tuple[list[float], list[float]]:
        return [0.2, -0.3, 0.0], [0.0, 0.0, 0.0]


def test_a_held_machine_that_a_hand_pushes_away_gives_its_whole_torque_for_some_ticks_only() -> None:
    bench = Bench(machine="rhi")
    bench.until(Mode.ENGAGING)
    bench.run(500)
    bench.break_sensor("force_torque", "wrench", [nan] * 6)
    bench.until(Mode.HOLDING)
    bench.run(50)
    bench.plant.hand._course, bench.plant.hand._strength = Far, 15.0  # type: ignore[attr-defined]
    limits = [axis.command for axis in bench.cycle.machine.axes]
    whole = 0
    for _ in range(400):
        bench.run(1)
        whole += any(abs(t) > 0.95 * most for t, most in zip(bench.torques, limits, strict=True))
    assert (bench.mode, bench.reason) == (Mode.STOPPED, "moved")
    assert bench.cycle.stops.latch.reaction is Reaction.RAMP
    assert 0 < whole < 20
    assert bench.safe


@pytest.mark.parametrize("machine", ["giant"])
def test_a_link_that_swings_on_its_spring_is_not_at_rest(moving: Bench) -> None:
    moving.plc.emergency_stop = (True, True)
    moving.until(Mode.STOPPED)
    moving.run(20)
    moving.plc.emergency_stop = (False, False)
    moving.press(False)
    arm, fastest = moving.plant.arm, 1.0  # type: ignore[attr-defined]
    swung = 0
    for tick in range(4000):
        moving.run(1, Command.RESET if tick % 100 == 0 else Command.NONE)
        if moving.mode is Mode.READY:
            break
        fastest = max(0.98 * fastest, np.abs(arm.qd).max())
        swung += np.abs(arm.motor_rate).max() < 0.01 and fastest > 0.2
    assert moving.mode is Mode.READY
    assert swung > 50  # the motors stood while a link still swung
    assert np.abs(arm.qd).max() < 0.12


def test_a_reset_begins_to_watch_anew(engaging: Bench) -> None:
    engaging.press(False)
    engaging.until(Mode.STOPPED)
    engaging.run(50)
    slide(engaging, 1, 0.5)
    engaging.run(200)
    assert engaging.reason == "moved"
    engaging.run(1500)
    engaging.run(100, Command.RESET)
    assert engaging.mode is Mode.READY
    engaging.run(500)
    assert engaging.mode is Mode.READY
