"""The gate of devices with controllers of their own: in range, in small steps, and nothing without leave."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.safety import PASS, Reaction, SetPoint, SetPointGate

FINGER = SetPoint("finger", 0.0, 1.2, 0.01)
WHEEL = SetPoint("wheel", -0.5, 0.5, 0.002, rest=0.0)


class Devices:
    def __init__(self) -> None:
        self.measured = [np.array([0.3]), np.array([0.1])]
        self.told = [np.zeros(1), np.zeros(1)]
        self.enables = [np.zeros(1, np.uint32), np.zeros(1, np.uint32)]
        self.gate = SetPointGate([FINGER, WHEEL], 1000.0, self.measured, self.told, self.enables)

    @property
    def values(self) -> list[float]:
        return [float(x[0]) for x in self.told]

    @property
    def powered(self) -> list[int]:
        return [int(word[0]) for word in self.enables]


@pytest.fixture
def devices() -> Devices:
    made = Devices()
    made.gate.deny()
    return made


def test_without_leave_they_have_no_power_and_are_told_where_they_are_or_to_rest(devices: Devices) -> None:
    assert devices.gate.admit(np.array([1.0, 0.4]), False) is PASS
    assert devices.values == [0.3, 0.0] and devices.powered == [0, 0] and not devices.gate.enable


def test_what_is_measured_beyond_the_range_is_told_as_its_end_and_what_is_no_number_as_before(
    devices: Devices,
) -> None:
    devices.measured[0][0] = 1.5
    devices.gate.deny()
    assert devices.values[0] == 1.2
    devices.measured[0][0] = np.nan
    devices.gate.deny()
    assert devices.values[0] == 1.2


def test_small_steps_within_the_range_pass(devices: Devices) -> None:
    assert devices.gate.admit(np.array([0.305, -0.001]), True) is PASS
    assert devices.values == [0.305, -0.001] and devices.powered == [1, 1] and devices.gate.clamps == 0


@pytest.mark.parametrize("wanted", [[9.0, 0.0], [-9.0, 0.0], [0.3, 0.4], [0.3, -np.inf], [np.inf, np.inf]])
def test_jumps_become_steps_and_are_said(devices: Devices, wanted: list[float]) -> None:
    verdict = devices.gate.admit(np.array(wanted), True)
    assert verdict.reaction is Reaction.SANITISE and verdict.reason == "output_clamped"
    assert ("finger" if wanted[0] != 0.3 else "wheel") in verdict.detail
    for told, begun, want, point in zip(devices.values, [0.3, 0.0], wanted, [FINGER, WHEEL], strict=True):
        assert told == begun + np.clip(want - begun, -point.step, point.step)


def test_a_number_that_is_none_leaves_what_was_told_last(devices: Devices) -> None:
    devices.gate.admit(np.array([0.305, 0.001]), True)
    verdict = devices.gate.admit(np.array([np.nan, 0.002]), True)
    assert verdict.reaction is Reaction.SANITISE and devices.values == [0.305, 0.002]


def test_nothing_leads_out_of_the_range(devices: Devices) -> None:
    for _ in range(500):
        devices.gate.admit(np.array([1.0, 1.0]) * 5.0, True)
    assert devices.values == [1.2, 0.5]


def test_ten_in_a_row_or_twenty_in_a_hundred_stop_the_machine() -> None:
    for bad, rest, expected in ((10, 0, 10), (2, 8, 100)):
        devices = Devices()
        devices.gate.deny()
        for tick in range(1, 200):
            wrong = tick % (bad + rest) < bad
            verdict = devices.gate.admit(devices.gate.admitted + np.array([5.0 if wrong else 0.0, 0.0]), True)
            if verdict.reaction.stops:
                break
        assert verdict.reaction is Reaction.HOLD and verdict.reason == "output_beyond_limit"
        assert tick == expected
    assert not devices.gate.admit(devices.gate.admitted, False).reaction.stops
    assert devices.gate.admit(devices.gate.admitted.copy(), True) is PASS, "forgotten with the power"


def test_a_stop_without_a_bad_tick_of_its_own_is_said_of_all() -> None:
    devices = Devices()
    devices.gate.deny()
    for _ in range(19):
        devices.gate.admit(np.array([9.0, 0.0]), True)
        devices.gate.admit(devices.gate.admitted.copy(), True)
    devices.gate.admit(np.array([9.0, 0.0]), True)
    verdict = devices.gate.admit(devices.gate.admitted.copy(), True)
    assert verdict.reaction is Reaction.HOLD and verdict.detail.startswith("set points")


def test_views_that_are_not_as_many_as_the_points_are_refused() -> None:
    with pytest.raises(ValueError, match="1 outputs for 2 set points"):
        SetPointGate([FINGER, WHEEL], 1000.0, [np.zeros(2)], [np.zeros(1)], [])
    with pytest.raises(ValueError, match="1 measurements for 2 set points"):
        SetPointGate([FINGER, WHEEL], 1000.0, [np.zeros(1)], [np.zeros(2)], [])
