"""The cycle in closed loop with the simulated machine: bring-up, arming, engaging."""

from collections.abc import Callable
from math import nan

import numpy as np
import pytest
from hapticd.devices.safety_plc import SafetyRequest
from hapticd.runtime.core.modes import Command, Mode
from hapticd.safety import Reaction, Verdict
from hapticd.sim import faults
from hapticd.testing.bench import fall, weld

from .conftest import Bench


def stand_outside(bench: Bench) -> None:
    """A joint is measured further beyond its limit than any machine returns from."""
    # the limit comes to the joint: a measurement that jumps there would not be believed
    object.__setattr__(bench.cycle.machine.axes[1], "upper", bench.joints[1].link_position - 1.0)


def drift(bench: Bench, speed: float) -> None:
    """A joint moves by itself [rad/s]."""
    joint, gone = bench.joints[0], 0.0

    def moved() -> None:
        nonlocal gone
        gone += speed * 1e-3
        joint.velocity = speed
        joint.position += gone
        joint.link_position += gone

    bench.after_sensing(moved)


def test_a_session_comes_up_by_itself_and_waits_for_a_press(bench: Bench) -> None:
    bench.until(Mode.READY)
    bench.run(100)
    assert bench.mode is Mode.READY
    assert bench.safe
    assert not any(bench.torques)
    bench.until(Mode.ENABLING)
    assert bench.tick_index == pytest.approx(301, abs=3)  # the scripted press at 0.3 s
    bench.until(Mode.ENGAGING)
    assert not bench.safe


def test_engaging_fades_in_over_three_seconds_from_the_measured_posture(bench: Bench) -> None:
    bench.until(Mode.ENGAGING)
    gains = []
    posture = bench.plant.arm.q.copy()
    while bench.mode is Mode.ENGAGING:
        bench.run(1)
        gains.append(bench.cycle.phase.gain)
        if len(gains) < 100:
            assert np.abs(bench.plant.arm.q - posture).max() < 5e-3  # no jump
    assert len(gains) == pytest.approx(3000, abs=2)
    steps = np.diff(gains)
    assert (steps > 0.0).all() and (steps <= 1 / 3000 + 1e-12).all()
    assert bench.mode is Mode.ACTIVE


def test_a_joint_that_stands_beyond_its_limit_is_engaged_without_a_jump() -> None:
    bench = Bench(
        ('force = "150 N"', 'force = "0.1 N"'),  # a hand that hardly holds on
        ('torque = "12 N m"', 'torque = "0.01 N m"'),
    )
    posture = bench.plant.arm.q.copy()
    posture[1] = 2.412
    bench.plant.arm.reset(posture)
    bench.plant._measure()
    bench.until(Mode.ENGAGING)
    fastest = 0.0
    for _ in range(100):
        bench.run(1)
        fastest = max(fastest, np.abs(bench.plant.arm.qd).max())
    assert bench.mode is Mode.ENGAGING
    assert fastest < 0.06  # what follows is prepositioning


def test_a_dead_man_held_from_the_start_does_not_arm(machine: str) -> None:
    bench = Bench(
        ('dead_man = [{ at = "0.3 s", pressed = true }]', 'dead_man = [{ at = "0 s", pressed = true }]'),
        machine=machine,
    )
    bench.run(290)  # the scripted hand does not pull yet
    assert bench.mode is Mode.READY
    bench.press(False)
    bench.run(5)
    bench.press(True)
    bench.run(5)
    assert bench.mode > Mode.READY


def test_one_channel_of_the_dead_man_is_no_press(bench: Bench) -> None:
    bench.until(Mode.READY)
    bench.run(110)  # long enough to be at rest
    bench.plc.dead_man = (True, False)
    bench.run(50)
    assert bench.mode is Mode.READY


REFUSALS: dict[str, tuple[Callable[[Bench], object], str]] = {
    # name: (what happens while the machine waits, why the press then starts nothing)
    "frames missing": (lambda b: setattr(b.joints[0], "tamper", faults.drop(4)), "not all devices answer"),
    "device not in OP": (lambda b: fall(b.nodes["force_torque"]), "not all devices answer"),
    "drive fault": (lambda b: setattr(b.joints[2], "fault", 0x2310), "devices report an error; reset"),
    "e-stop": (lambda b: setattr(b.plc, "emergency_stop", (True, True)), "the emergency stop is pressed"),
    "STO": (lambda b: setattr(b.plc, "latched", True), "the safety PLC holds the torque off"),
    "no recorder": (lambda b: b.run(1, Command.UNRECORDED), "the recorder is gone"),
    "latched stop": (
        lambda b: b.cycle.stops.latch.take(Verdict(Reaction.HOLD, "test", "a test"), 0),
        "a stop is latched",
    ),
    "stale frames": (
        lambda b: (setattr(b.joints[1], "tamper", faults.duplicate(20)), b.run(8)),
        "stale or repeated frames",
    ),
    "a drive in another mode": (lambda b: setattr(b.joints[1], "mode", 8), "is in mode 8 (6061h) instead of"),
    "a drive with power": (lambda b: weld(b.last_drive), "the safety PLC holds the torque off"),
    "a machine that moves": (lambda b: drift(b, 0.3), "the machine moves"),
    "wrench is NaN": (lambda b: b.break_sensor("force_torque", "wrench", [nan] * 6), "gives nothing valid"),
    "joint outside": (stand_outside, "stands outside its limits"),
}
LATCHED = ("drive fault", "e-stop", "a drive with power")
"""They forbid to start even when they are gone again."""
GIANT_REFUSALS: dict[str, tuple[Callable[[Bench], object], str]] = {
    "carriage IMU is NaN": (
        lambda b: b.break_sensor("imu_carriage", "acceleration", [nan] * 3),
        "gives nothing valid",
    ),
}


@pytest.mark.parametrize(
    ("machine", "name"),
    [("giant", name) for name in (*REFUSALS, *GIANT_REFUSALS)] + [("rhi", "joint outside")],
)
def test_a_press_starts_nothing_while_something_is_amiss(bench: Bench, name: str) -> None:
    happen, why = {**REFUSALS, **GIANT_REFUSALS}[name]
    bench.until(Mode.READY)
    bench.run(110)  # long enough to be at rest
    bench.run(5)
    happen(bench)
    bench.run(2)
    bench.press(True)
    bench.run(5)
    assert bench.mode is (Mode.STOPPED if name in LATCHED else Mode.READY)
    assert bench.safe
    (event,) = [event for event in bench.said if event.startswith("not started")]
    assert why in event


def test_a_stop_of_a_waiting_machine_leaves_it_waiting(bench: Bench) -> None:
    bench.until(Mode.READY)
    bench.run(110)  # long enough to be at rest
    bench.run(5, Command.STOP)
    assert bench.mode is Mode.READY
    assert bench.reason == ""
    assert bench.said[-1] == "stop commanded: no drive has power"


def test_an_emergency_stop_of_a_waiting_machine_is_latched(bench: Bench) -> None:
    bench.until(Mode.READY)
    bench.run(110)  # long enough to be at rest
    bench.plc.emergency_stop = (True, False)
    bench.run(3)
    bench.plc.emergency_stop = (False, False)
    bench.run(5)
    assert bench.mode is Mode.STOPPED
    assert bench.reason == "e_stop"
    assert bench.plc.request == SafetyRequest.STO
    bench.run(60, Command.RESET)
    assert bench.mode is Mode.READY
    assert bench.plc.request == 0 and not bench.plc.sto


def test_arming_by_command_needs_the_command_before_the_press(machine: str) -> None:
    bench = Bench(
        ('by = "dead-man"', 'by = "command"'),
        ('dead_man = [{ at = "0.3 s", pressed = true }]', "dead_man = []"),
        machine=machine,
    )
    bench.until(Mode.READY)
    bench.run(110)  # long enough to be at rest
    bench.press(True)
    bench.run(10)
    assert bench.mode is Mode.READY
    assert any("arming was not commanded" in event for event in bench.said)
    bench.press(False)
    bench.run(10)
    bench.run(10, Command.ARM)
    bench.press(True)
    bench.run(10)
    assert bench.mode > Mode.READY
    bench.press(False)  # a stop and its reset take the command back
    bench.until(Mode.STOPPED)
    bench.run(50, Command.RESET)
    bench.press(True)
    bench.run(10)
    assert bench.mode is Mode.READY
    assert bench.said[-1].startswith("not started: arming was not commanded")


def test_a_missing_device_fails_the_bring_up_without_moving_anything(bench: Bench) -> None:
    bench.joints[-1].silent = True
    bench.until(Mode.FAILED, limit=4000)
    name = bench.joints[-1].device.name
    assert any(name in event for event in bench.said)
    bench.run(50)
    assert bench.safe
    assert bench.mode is Mode.FAILED
    assert len(bench.lockstep.outputs.frames) == 0


def second_start(strength: float) -> Bench:
    """The redundant interface stopped and reset, a hand pulling at it with so many newtons."""
    bench = Bench(machine="rhi")
    bench.until(Mode.ENGAGING)
    bench.run(300)
    bench.press(False)
    bench.until(Mode.STOPPED)
    hand, place = bench.plant.hand, bench.plant.arm.position.tolist()  # type: ignore[attr-defined]

    class Aside:
        @staticmethod
        def at(t: float) -> tuple[list[float], list[float]]:
            return [place[0], place[1] + 0.3, place[2]], [0.0, 0.0, 0.0]

    hand._course, hand._strength = Aside, strength
    bench.run(300)
    bench.run(1, Command.RESET)
    bench.until(Mode.READY, limit=600)
    return bench


def test_a_hand_that_is_stronger_than_the_motors_cannot_start() -> None:
    bench = second_start(40.0)
    bench.press(True)
    bench.run(5)
    assert bench.mode is Mode.READY and bench.safe
    assert "more than the motors hold; pull less" in bench.said[-1]


def test_a_hand_that_holds_on_is_held_as_the_brakes_open_and_let_go_gently() -> None:
    bench = second_start(3.0)
    arm = bench.plant.arm  # type: ignore[attr-defined]
    bench.press(True)
    bench.until(Mode.ENGAGING, limit=20)
    before = np.array(bench.torques)
    limits = np.array([axis.command for axis in bench.cycle.machine.axes])
    for tick in range(400):
        bench.run(1)
        now = np.array(bench.torques)
        if tick > 5:
            assert (np.abs(now - before) < 0.05 * limits).all()
        if tick < 50:
            assert np.abs(arm.qd).max() < 0.2
        before = now
    assert bench.mode is Mode.ENGAGING
