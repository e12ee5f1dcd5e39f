"""A spindle turns turns into metres and torques into forces."""

import math

import pytest
from hapticd.configs.quantities import Length, Torque
from hapticd.devices.cia402 import POSITION, TARGET_TORQUE, TORQUE, VELOCITY
from hapticd.devices.device import Quantity
from hapticd.devices.slide_drive import SlideDrive
from hapticd.devices.torque_drive import LINK_POSITION

DRIVE = SlideDrive(
    name="lift",
    node=1,
    counts_per_turn=4096,
    gear_ratio=(3, 1),
    link_counts_per_turn=65536,
    rated_torque=Torque(0.5),
    lead=Length(0.01),
)


def test_a_turn_of_the_shaft_is_the_lead() -> None:
    inputs = DRIVE.inputs()
    for address, counts in ((POSITION, 3 * 4096), (VELOCITY, 3 * 4096), (LINK_POSITION, 65536)):
        field = inputs[address]
        assert isinstance(field, Quantity)
        assert counts * field.scale == pytest.approx(0.01)


def test_power_is_the_same_on_both_sides_of_the_spindle() -> None:
    assert DRIVE.rated == pytest.approx(0.5 * 2.0 * math.pi / 0.01)
    for field in (DRIVE.inputs()[TORQUE], DRIVE.outputs()[TARGET_TORQUE]):
        assert isinstance(field, Quantity)
        assert 1000.0 * field.scale == pytest.approx(DRIVE.rated)
