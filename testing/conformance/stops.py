"""What stops the machine, how fast, why, and that nothing but hand and gravity moves it from then on."""

from __future__ import annotations

from collections.abc import Callable
from math import nan

import numpy as np
import pytest

from ...devices.frames import Frames
from ...runtime.core.modes import Command, Mode
from ...safety.tally import WINDOW
from ...sim import faults
from ...sim.drive import SimDrive
from ..bench import Bench, fall
from ..energy import Energy

DETECTED_S = 25e-3
"""From what happens until the machine brakes: silence counts after 20 ms (docs/fault-matrix.md, row 3)."""
WATCHED_S = 0.1
"""A machine that came to rest is watched for so long."""
OFF_TICKS = 3
"""Ticks until drives that were told to switch off have done so."""
STIFF_J = 1e-3
STIFF_SHARE = 0.02
"""Kinetic energy after the latch that brakes may pass from one axis to another: a number, and a share of what
there was."""

Happen = Callable[[Bench], object]


def stop(bench: Bench, happen: Happen, reason: str | None, off: bool | None) -> None:
    """Let something happen, and judge how the plant comes to rest and stays there.

    Args:
        bench: a machine with power.
        happen: what happens.
        reason: of the stop; None for any.
        off: whether the drives lose their power (True) or hold the machine (False); None for either.
    """
    happen(bench)
    detected(bench)
    assert reason in (None, bench.reason)
    come_to_rest(bench)
    if off is not None:
        assert (bench.mode is Mode.STOPPED) == off
    mode = bench.mode
    bench.run(bench.ticks(WATCHED_S))
    assert bench.mode is mode, "a stop is latched"
    assert bench.safe == (mode is Mode.STOPPED)


def detected(bench: Bench) -> None:
    """Run until the machine brakes."""
    detect = bench.ticks(DETECTED_S)
    for _ in range(detect):
        bench.run(1)
        if bench.mode >= Mode.STOPPING:
            return
    raise AssertionError(f"goes on {detect} ticks later")


def come_to_rest(bench: Bench) -> None:
    """Run until a machine that brakes stands: in the declared time, with energy of hand and gravity."""
    cycle, energy = bench.cycle, Energy(bench.plant)
    before, stored, most, took = energy.kinetic, energy.stored, 0.0, 0
    while bench.mode is Mode.STOPPING:
        bench.run(1)
        took += 1
        energy.take(bench.dt)
        stored = max(stored, energy.stored)
        most = max(most, energy.kinetic - before - energy.hand - energy.gravity - energy.lifted)
        assert took <= max(cycle.stops.ramp_limit, cycle.stops.hold_limit) + 1, "does not come to rest"
    assert most <= STIFF_J + STIFF_SHARE * before + stored, f"{most:.4f} J that nobody gave"
    assert bench.mode in (Mode.STOPPED, Mode.HOLDING)
    if bench.mode is Mode.STOPPED:
        assert took <= cycle.stops.ramp_limit + 1
        bench.run(OFF_TICKS)
        assert bench.safe, "a drive has power after a stop"


def _second_master(bench: Bench) -> None:
    frames = Frames()
    frames.append(0x000, b"\x01\x00")
    bench.lockstep._bus.send(frames)


PEOPLE: dict[str, tuple[Happen, str]] = {
    "dead-man released": (lambda b: b.press(False), "dead_man"),
    "one dead-man channel open": (lambda b: setattr(b.plc, "dead_man", (True, False)), "dead_man"),
    "e-stop": (lambda b: setattr(b.plc, "emergency_stop", (True, True)), "e_stop"),
    "one e-stop channel": (lambda b: setattr(b.plc, "emergency_stop", (False, True)), "e_stop"),
    "commanded": (lambda b: b.run(1, Command.STOP), "operator"),
    "end of the session": (lambda b: b.run(1, Command.END), "end"),
    "all devices silent": (Bench.silence_all, "device_silent"),
    "second master": (_second_master, "second_master"),
}
"""Stops that every machine has: what happens, and the reason that is latched; each takes the power away."""


@pytest.mark.parametrize("name", PEOPLE)
def test_people_and_the_bus_stop_a_machine_that_engages(engaging: Bench, name: str) -> None:
    stop(engaging, *PEOPLE[name], True)


@pytest.mark.parametrize("name", PEOPLE)
def test_people_and_the_bus_stop_a_machine_that_moves(moving: Bench, name: str) -> None:
    stop(moving, *PEOPLE[name], True)


def _stale(drive: SimDrive) -> None:
    drive.tamper = faults.duplicate(8)


def _lost(drive: SimDrive) -> None:
    drive.tamper = faults.drop(6)


DRIVES: dict[str, tuple[Callable[[SimDrive], object], str, bool]] = {
    "fault": (lambda drive: setattr(drive, "fault", 0x2310), "device_fault", True),
    "another mode": (lambda drive: setattr(drive, "mode", 8), "drive_state", True),
    "restarts": (lambda drive: drive.reset(), "device_state", True),
    "stale frames": (_stale, "stale_frames", False),
    "five frames lost": (_lost, "device_silent", False),
}
"""What a drive may do: to it, the reason of the stop, and whether it takes the power of all."""


@pytest.mark.parametrize("name", DRIVES)
def test_a_drive_that_fails_stops_a_machine_that_moves(moving: Bench, drive_name: str, name: str) -> None:
    happen, reason, off = DRIVES[name]
    drive = moving.nodes[drive_name]
    assert isinstance(drive, SimDrive)
    stop(moving, lambda _: happen(drive), reason, off)
    if name == "five frames lost":
        assert not drive.powered, "nobody knows what it does"


def test_a_device_that_falls_silent_stops_a_machine_that_moves(moving: Bench, device_name: str) -> None:
    moving.nodes[device_name].silent = True
    detected(moving)
    assert moving.reason == "device_silent"
    come_to_rest(moving)
    if moving.mode is Mode.HOLDING:  # held as long as it may be back in a moment
        moving.until(Mode.STOPPED, limit=moving.ticks(DETECTED_S) + moving.cycle.stops.ramp_limit)
        moving.run(OFF_TICKS)
    assert moving.safe


def test_a_device_that_leaves_its_operating_state_stops_the_machine(
    engaging: Bench, device_name: str
) -> None:
    stop(engaging, lambda b: fall(b.nodes[device_name]), None, True)


def test_four_of_five_frames_lost_stop_the_machine(engaging: Bench, device_name: str) -> None:
    count = 0

    def thin(can_id: int, data: bytes) -> list[tuple[int, bytes]]:
        nonlocal count
        answer = can_id & 0x780 == 0x180
        count += answer
        return [] if answer and count % 5 else [(can_id, data)]

    engaging.nodes[device_name].tamper = thin
    stop(engaging, lambda _: None, "device_silent", None)


@pytest.mark.parametrize("value", [nan, 1e30])
def test_a_sensor_that_measures_nonsense_makes_no_machine_lurch(
    moving: Bench, sensor_field: tuple[str, str], value: float
) -> None:
    """It may need the sensor or not: it goes on, or comes to rest."""
    name, field = sensor_field
    size = np.size(getattr(moving.nodes[name], field))
    moving.break_sensor(name, field, [value] * size if size > 1 else value)
    for _ in range(moving.ticks(DETECTED_S)):
        moving.run(1)
        assert np.isfinite(moving.cycle.gate.admitted).all()
        if moving.mode is not Mode.ACTIVE:
            come_to_rest(moving)
            return
    moving.run(moving.ticks(WATCHED_S))
    assert moving.mode is Mode.ACTIVE


def test_up_to_four_lost_frames_and_a_malformed_one_stop_nothing(moving: Bench, device_name: str) -> None:
    node = moving.nodes[device_name]
    for tamper in (faults.drop(4), faults.truncate(1)):
        moving.run(WINDOW)
        node.tamper = tamper
        moving.run(WINDOW)
    assert moving.mode is Mode.ACTIVE


def test_a_daemon_that_sleeps_finds_its_drives_safe(moving: Bench) -> None:
    moving.run(1, skipped=moving.ticks(DETECTED_S))
    moving.run(3)
    assert moving.safe
    assert moving.mode >= Mode.STOPPING
