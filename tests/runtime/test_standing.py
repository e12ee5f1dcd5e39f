"""The cycle in closed loop with the simulated machine: what should stand is watched."""

from collections.abc import Sequence

import pytest
from hapticd.devices.cia402 import State
from hapticd.runtime.machine import SPEED_MARGIN
from hapticd.runtime.measured import JUMP_MARGIN
from hapticd.runtime.modes import Command, Mode
from hapticd.safety import Reaction
from hapticd.sim import faults

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
    """The arm is moved, tick by tick, nearly as fast as its encoders are believed, whatever holds it."""
    dt, left = 1.0 / bench.lockstep.session.config.loop.rate, by
    most = JUMP_MARGIN / SPEED_MARGIN * bench.memory.machine.thresholds.speed[joint] * dt
    move = bench.plant._move  # type: ignore[attr-defined]

    def moved(dt: float) -> None:
        nonlocal left
        move(dt)
        step = min(0.9 * most, left)
        left -= step
        if step > 0.0:
            displace(bench, joint, step)

    bench.plant._move = moved  # type: ignore[attr-defined]


def creep(bench: Bench, joint: int, speed: float) -> None:
    """A brake slips: encoders report a joint that moves [rad/s]."""
    drive, gone = bench.joints[joint], 0.0

    def slip() -> None:
        nonlocal gone
        gone += speed * 1e-3
        drive.position += gone
        drive.link_position += gone
        drive.velocity = speed

    bench.after_sensing(slip)


def peak_torques(bench: Bench, ticks: int) -> list[float]:
    """Largest torque of each motor, as a share of what it may give at most."""
    peaks = [abs(torque) for torque in bench.torques]
    for _ in range(ticks):
        bench.run(1)
        peaks = [max(peak, abs(torque)) for peak, torque in zip(peaks, bench.torques, strict=True)]
    axes = bench.memory.machine.axes[: len(peaks)]
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
    creep(bench, 1, speed)
    play, ticks = bench.memory.machine.play[1], 0
    while bench.memory.latch.reaction is not Reaction.OFF:
        bench.run(1)
        ticks += 1
        assert ticks * speed * 1e-3 < 1.1 * play + 0.01
    bench.run(3)
    assert (bench.mode, bench.reason) == (Mode.STOPPED, "moved")
    assert bench.plc.sto
    name = bench.joints[1].device.name
    assert any(f"{name} moves, though its brake should hold it" in event for event in bench.events)


def test_a_held_machine_that_is_pushed_away_is_switched_off(engaging: Bench) -> None:
    engaging.last_drive.tamper = faults.drop(6)
    engaging.until(Mode.HOLDING)
    engaging.run(50)
    slide(engaging, 1, 0.5)  # and motors that are too weak to bring it back
    brake, machine = engaging.memory.machine.brake, engaging.memory.machine

    def weak(dropped: Sequence[bool]) -> bool:
        at_rest = brake(dropped)
        machine.commands = [0.01 * command for command in machine.commands]
        return at_rest

    machine.brake = weak  # type: ignore[method-assign]
    engaging.until(Mode.STOPPING, limit=50)
    assert (engaging.reason, engaging.memory.latch.reaction) == ("moved", Reaction.RAMP)
    engaging.until(Mode.STOPPED, limit=round(1e3 * engaging.lockstep.session.config.safety.stop_time))
    assert (engaging.reason, engaging.memory.latch.reaction) == ("moved", Reaction.RAMP)
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
    assert not any("moves, though" in event for event in moving.events)


@pytest.mark.parametrize("by", [0.5, 0.05, 0.01])
@pytest.mark.parametrize("delay", range(4))
def test_what_is_moved_between_the_press_and_the_first_torque_is_not_pulled_back(
    bench: Bench, by: float, delay: int
) -> None:
    bench.until(Mode.ENABLING)
    bench.run(delay)
    slide(bench, 1, by)
    assert peak_torques(bench, 300)[1] < 0.12
    if by >= 0.05:
        assert bench.mode is Mode.STOPPED and bench.safe
        assert (bench.reason, bench.memory.latch.reaction) == ("moved", Reaction.OFF)


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
    assert peaks[1] < 0.12
    assert max(peaks) < 0.25  # one of the others takes 0.21 to hold the arm against gravity
    assert bench.mode is Mode.STOPPED and bench.safe
    assert "R3 encoder_jump" in next(event for event in bench.events if event.startswith("STOPP"))


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


@pytest.mark.parametrize("delay", range(6))
def test_one_bad_sample_while_the_drives_switch_on_pulls_at_nothing(bench: Bench, delay: int) -> None:
    bench.until(Mode.ENABLING)
    bench.run(delay)
    bench.break_sensor(bench.joints[1].device.name, "link_position", 1.5, samples=1)
    assert peak_torques(bench, 100)[1] < 0.12


def test_a_machine_that_moves_while_one_drive_takes_its_time_is_engaged_where_it_is(bench: Bench) -> None:
    slow = bench.joints[-1]
    latched, obeys = slow.outputs_latched, False

    def later() -> None:
        if obeys:
            latched()

    slow.outputs_latched = later  # type: ignore[method-assign]
    bench.until(Mode.ENABLING)
    bench.run(50)
    slide(bench, 1, 0.02)
    bench.run(50)
    obeys = True
    assert peak_torques(bench, 100)[1] < 0.12
    assert bench.mode in (Mode.ENGAGING, Mode.STOPPED)
    assert State.FAULT not in {joint.state for joint in bench.joints}


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
