"""Stops as the plant feels them: after one is latched nothing but the hand and gravity gives energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hapticd.machines.giant.machine import Giant
from hapticd.runtime.core.modes import Command, Mode
from hapticd.sim import faults
from hapticd.testing.copies import in_a_copy
from hapticd.testing.energy import Energy

from .conftest import Bench

WALK = {"giant": (4800, 9000, 13000), "rhi": (5200, 11000)}
"""Ticks of the scripted walk at which something is lost: on the way, fast, and at a limit or in the wall."""
LOST: dict[str, dict[str, tuple[str, ...]]] = {
    "giant": {
        "joint 1": ("joint_1",),
        "joint 2": ("joint_2",),
        "joint 4": ("joint_4",),
        "one axis of the gantry": ("ppu_y",),
        "the gantry": ("ppu_x", "ppu_y"),
        "the arm": tuple(f"joint_{k}" for k in range(1, 7)),
        "the wrench": ("force_torque",),
        "the carriage's accelerometer": ("imu_carriage",),
        "the dead-man switch": ("safety_plc",),
    },
    "rhi": {
        "motor 1": ("motor_1",),
        "motor 4": ("motor_4",),
        "the wrench": ("force_torque",),
        "the dead-man switch": ("safety_plc",),
    },
}


def lose(bench: Bench, names: tuple[str, ...]) -> None:
    for name in names:
        bench.nodes[name].silent = True


def given(bench: Bench) -> tuple[float, int, str]:
    """Kinetic energy beyond what hand and gravity account for at worst after the latch [J]; ticks until no
    drive has power, from now; the mode in the end.

    What gravity takes from the motion may be given back: whoever holds up a weight that rises works.
    """
    energy, most, powered = None, 0.0, 0
    for _ in range(420):
        bench.run(1)
        powered += not bench.safe
        if energy is None:
            if bench.mode >= Mode.STOPPING:
                energy = Energy(bench.plant)
                before = energy.kinetic
            continue
        energy.take(1e-3)
        most = max(most, energy.kinetic - before - energy.hand - energy.gravity - energy.lifted)
    return most, powered, bench.mode.name


def tolerance(bench: Bench) -> float:
    """A brake torque reaches the link through the spring: the rotor must run ahead to load it, so that at
    worst the energy of the stiffest load, the strongest joint's torque in its spring, is in motion [J]."""
    machine = bench.cycle.machine
    if not isinstance(machine, Giant):
        return 2e-3
    tracking = bench.lockstep.session.config.giant.tracking  # type: ignore[attr-defined]
    rows = zip(machine.axes, tracking.stiffness, strict=False)
    return max(0.5 * axis.command**2 / stiffness for axis, stiffness in rows)


@pytest.mark.slow
def test_after_a_stop_for_lost_devices_only_the_hand_and_gravity_give_energy(machine: str) -> None:
    bench = Bench(machine=machine)
    everything = tuple(node.device.name for node in bench.nodes.nodes)
    assert tolerance(bench) < 2.3
    for tick in WALK[machine]:
        bench.run(tick - bench.tick_index)
        for name, devices in LOST[machine].items():
            loses(bench, name, devices, tolerance(bench), 420)
        # five missing frames and the wire: no ramp on frozen encoders
        loses(bench, "everything", everything, 1e-3, 7)
    assert bench.mode is Mode.ACTIVE


@in_a_copy
def loses(bench: Bench, name: str, devices: tuple[str, ...], most: float, longest: int) -> None:
    """Some devices fall silent; limits of the energy that motors and springs give [J], and of the ticks with
    power."""
    lose(bench, devices)
    energy, powered, mode = given(bench)
    assert energy < most, f"{name} lost at {bench.tick_index}: {energy:.3f} J"
    assert powered <= longest, f"{name}: {powered} ticks with power"
    assert mode == Mode.STOPPED.name, name


def test_an_axis_that_falls_silent_during_a_stop_loses_its_torque_and_its_power(moving: Bench) -> None:
    moving.run(1, Command.STOP)
    moving.run(3)
    assert moving.mode is Mode.STOPPING
    drive = moving.joints[1]
    assert drive.powered
    drive.silent = True
    moving.run(5)
    assert not drive.powered and drive.brake
    assert moving.cycle.gate.admitted[1] == 0.0
    assert any("is not measured" in event for event in moving.said)
    others = [joint for joint in moving.joints if joint is not drive]
    assert all(joint.powered for joint in others) or moving.mode is Mode.STOPPED


def test_a_drive_that_answers_again_stays_off_until_the_next_start(moving: Bench) -> None:
    drive = moving.joints[1]
    drive.tamper = faults.drop(6)
    moving.until(Mode.STOPPING, limit=12)
    moving.until(Mode.HOLDING, limit=600)
    assert not drive.powered
    assert all(joint.powered for joint in moving.joints if joint is not drive)
    assert moving.reason == "device_silent"
    moving.run(300)
    assert moving.mode is Mode.HOLDING and not drive.powered
    moving.press(False)
    moving.until(Mode.STOPPED, limit=200)
    assert moving.safe


@pytest.mark.parametrize("device", ["all", "a drive", "safety_plc", "force_torque"])
def test_four_of_five_frames_lost_stop(engaging: Bench, device: str) -> None:
    names = {
        "all": [n.device.name for n in engaging.nodes.nodes],
        "a drive": [engaging.joints[1].device.name],
    }
    for name in names.get(device, [device]):
        count = 0

        def thin(can_id: int, data: bytes) -> Any:
            nonlocal count
            count += can_id & 0x780 == 0x180
            return [(can_id, data)] if count % 5 == 0 or can_id & 0x780 != 0x180 else []

        engaging.nodes[name].tamper = thin
    for _ in range(30):
        engaging.run(1)
    assert engaging.mode >= Mode.STOPPING
    assert engaging.reason == "device_silent"


@pytest.mark.parametrize(("wrong", "every"), [(1e6, 10), (float("nan"), 3)])
def test_wrong_commands_that_pause_now_and_then_stop(engaging: Bench, wrong: float, every: int) -> None:
    machine, tick = engaging.cycle.machine, 0
    update = machine.update

    def broken(gain: float, trust: float) -> None:
        nonlocal tick
        update(gain, trust)
        tick += 1
        if tick % every:
            machine.commands[3] = wrong * (1 if tick // 20 % 2 else -1)

    machine.update = broken  # type: ignore[method-assign]
    engaging.run(40)
    assert engaging.mode >= Mode.STOPPING
    assert engaging.reason in ("output_beyond_limit", "output_not_finite")


def test_solves_that_fail_two_times_in_three_stop_and_the_stop_can_be_reset(engaging: Bench) -> None:
    machine, tick = engaging.cycle.machine, 0
    update = machine.update

    def failing(gain: float, trust: float) -> None:
        nonlocal tick
        update(gain, trust)
        tick += 1
        machine.solved = tick % 3 == 0

    machine.update = failing  # type: ignore[method-assign]
    engaging.run(12)
    assert engaging.reason == "solve_failed"
    engaging.until(Mode.HOLDING, limit=300)
    engaging.run(50)
    assert engaging.mode is Mode.HOLDING  # nothing is solved any more: nothing fails
    engaging.press(False)
    engaging.until(Mode.STOPPED, limit=300)
    engaging.run(300)
    engaging.run(1, Command.RESET)
    engaging.until(Mode.READY, limit=600)


@pytest.mark.parametrize("machine", ["giant"])
@pytest.mark.parametrize("engaged", [400, 1500])
def test_a_stop_while_engaging_brakes_the_gantry_from_what_it_was_told(engaging: Bench, engaged: int) -> None:
    built = engaging.cycle.machine
    assert isinstance(built, Giant)
    engaging.run(100)
    built._prepositioning._core.gain *= 8.0  # it is far from where it wants to be
    engaging.run(engaged)
    assert engaging.mode is Mode.ENGAGING
    plant = engaging.plant
    told = [engaging.nodes[name].target_velocity for name in ("ppu_x", "ppu_y")]
    assert np.abs(built._prepositioning.velocity).max() > 1.3 * max(map(abs, told)) > 0.0
    engaging.press(False)
    before = None
    for _ in range(300):
        engaging.run(1)
        if engaging.mode is Mode.ENGAGING:
            told = [engaging.nodes[name].target_velocity for name in ("ppu_x", "ppu_y")]
            before = np.abs(plant.ppu.velocity).max()  # type: ignore[attr-defined]
            continue
        now = [engaging.nodes[name].target_velocity for name in ("ppu_x", "ppu_y")]
        assert all(abs(v) <= abs(last) for v, last in zip(now, told, strict=True))
        told = now
        assert before is not None
        assert np.abs(plant.ppu.velocity).max() < before + 0.01  # type: ignore[attr-defined]
    assert engaging.mode is Mode.STOPPED


def test_what_the_hand_does_while_the_drives_switch_on_is_fed_forward_gently() -> None:
    bench = Bench()
    bench.run(150)
    bench.until(Mode.ENGAGING)
    built = bench.cycle.machine
    assert isinstance(built, Giant)
    force_torque = bench.nodes["force_torque"]
    bench.after_sensing(
        lambda: setattr(force_torque, "wrench", [force_torque.wrench[0] + 25.0, *force_torque.wrench[1:]])
    )
    before = np.array(bench.torques)
    for _ in range(100):
        bench.run(1)
        now = np.array(bench.torques)
        assert np.abs(now - before).max() < 2.0
        before = now
    bench.run(300)
    felt = np.linalg.norm(built._estimator.wrench[:3])
    assert felt == pytest.approx(25.0, abs=2.0)  # less what the waiting hand pulled, which looked like drift
    assert np.linalg.norm(built._rendering.wrench[:3]) == pytest.approx(felt, abs=1e-9)


class Jerk:
    """Where a frightened hand pulls: far away, with all its force."""

    @staticmethod
    def at(t: float) -> tuple[list[float], list[float]]:
        return [0.2, -0.3, 0.0], [0.0, 0.0, 0.0]


@pytest.mark.parametrize(("force", "ticks"), [("40 N", 8), ("8 N", 30), ("150 N", 2)])
def test_at_rest_is_what_the_motors_do_not_what_they_should(force: str, ticks: int) -> None:
    bench = Bench(('force = "40 N"', f'force = "{force}"'), machine="rhi")
    bench.until(Mode.ACTIVE, limit=5000)
    bench.run(1500)
    bench.plant.hand._course = Jerk  # type: ignore[attr-defined]
    bench.run(ticks)
    bench.press(False)
    bench.until(Mode.STOPPING, limit=5)
    took = bench.until(Mode.STOPPED, limit=200)
    speed = np.abs(bench.plant.arm.qd).max()  # type: ignore[attr-defined]
    assert speed < 0.3 or took >= bench.cycle.stops.ramp_limit - 1


@pytest.mark.parametrize("machine", ["rhi"])
def test_a_hand_that_is_stronger_than_the_motors_makes_a_controlled_stop_a_ramp(moving: Bench) -> None:
    bench, t = moving, 0

    class Shake:
        @staticmethod
        def at(time: float) -> tuple[list[float], list[float]]:
            side = 0.1 if int(time * 20) % 2 else -0.1
            return [0.46 + side, 0.02, 0.0], [0.0, 0.0, 0.0]

    bench.plant.hand._course = Shake  # type: ignore[attr-defined]
    bench.plant.hand._strength = 15.0  # type: ignore[attr-defined]
    bench.joints[3].tamper = faults.drop(6)
    bench.until(Mode.STOPPING, limit=12)
    assert bench.cycle.stops.latch.reaction.name == "HOLD"
    while bench.mode is Mode.STOPPING and t < 400:
        bench.run(1)
        t += 1
    assert bench.mode is Mode.STOPPED
    assert bench.reason in ("stop_timeout", "beyond_limit", "encoder_jump")


@pytest.mark.parametrize("joint", [1, 2])
def test_an_axis_that_is_thrown_faster_than_it_may_move_is_braked_by_its_motor(
    moving: Bench, joint: int
) -> None:
    most = moving.cycle.machine.thresholds.speed[joint]
    arm, move, step = moving.plant.arm, moving.plant._move, 0  # type: ignore[attr-defined]
    sides = [(arm.q, arm.qd)] + ([(arm.motor, arm.motor_rate)] if hasattr(arm, "motor") else [])

    def thrown(dt: float) -> None:
        nonlocal step
        before = [(x[joint], v[joint]) for x, v in sides]
        move(dt)
        step += 1
        if step <= 8:  # to 1.7 times the speed that stops
            for (x, v), (q, rate) in zip(sides, before, strict=True):
                v[joint] = rate + 0.21 * most
                x[joint] = q + 0.5 * dt * (rate + v[joint])
            arm._observe()

    moving.plant._move = thrown  # type: ignore[attr-defined]
    drive, braked = moving.joints[joint], 0.0
    if len(sides) > 1:  # what throws the rotor goes through the spring
        rotor = moving.lockstep.session.config.giant.tracking.rotor_inertia[joint]  # type: ignore[attr-defined]
        pull = rotor * 0.21 * most / moving.dt
        moving.after_sensing(
            lambda: setattr(drive, "load_torque", drive.load_torque - pull) if 0 < step <= 8 else None
        )
    moving.until(Mode.STOPPING, limit=15)
    assert moving.reason == "beyond_limit"
    for _ in range(20):
        assert drive.powered, moving.said
        moving.run(1)
        braked = max(braked, -drive.torque * np.sign(drive.velocity))
    assert braked > 0.4 * moving.cycle.machine.axes[joint].command
    assert not any("is not measured" in event for event in moving.said)
