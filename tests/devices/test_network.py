from __future__ import annotations

from collections.abc import Mapping

import pytest
from hapticd.devices.axis_drive import AxisDrive
from hapticd.devices.cia301 import Address
from hapticd.devices.device import Device, Field, Quantity, Word
from hapticd.devices.errors import NetworkError
from hapticd.devices.imu import Imu
from hapticd.devices.joint_drive import JointDrive
from hapticd.devices.network import Network, OutputFrame, Slot
from msgspec.structs import replace


def test_slots_follow_the_header_in_the_order_of_the_devices(devices: list[Device]) -> None:
    network = Network(devices)
    assert network.slots[:2] == (Slot(0, 4, 4), Slot(0, 8, 4))
    assert network.slots[6:] == (Slot(0, 28, 6), Slot(0, 34, 6), None, None, None, Slot(0, 40, 1))
    assert network.output_frames == (OutputFrame(0x080, 48, network.raw_inputs),)


def test_slots_that_do_not_fit_into_sync_go_into_frames_sent_before_it() -> None:
    drives = [AxisDrive(name=f"axis{i}", node=i, counts_per_metre=1000) for i in range(1, 26)]
    network = Network(drives)
    assert [network.slots[i] for i in (9, 10, 20)] == [Slot(0, 58, 6), Slot(1, 4, 6), Slot(2, 4, 6)]
    assert [(f.can_id, f.length) for f in network.output_frames] == [(0x101, 64), (0x102, 48), (0x080, 64)]


def test_a_later_small_slot_fills_the_gap_in_an_earlier_frame() -> None:
    drives: list[Device] = [AxisDrive(name=f"axis{i}", node=i, counts_per_metre=1000) for i in range(1, 10)]
    joints = [replace(joint(i), group="j") for i in range(20, 23)]
    network = Network([*drives, *joints])
    assert network.slots[-3:] == (Slot(0, 58, 4), Slot(1, 4, 4), Slot(1, 8, 4))


def joint(node: int) -> JointDrive:
    return JointDrive(
        name=f"joint{node}",
        node=node,
        counts_per_turn=4096,
        gear_ratio=(50, 1),
        link_counts_per_turn=4096,
        rated_torque=10.0,
    )


def test_every_byte_of_the_raw_image_has_a_name(devices: list[Device]) -> None:
    network = Network(devices)
    names = [network.field_at(i) for i in range(network.raw_size)]
    assert all(names)
    assert names[:7] == ["joint1.counter"] * 2 + ["joint1.al_state"] + ["joint1.statusword"] * 2 + [
        "joint1.mode",
        "joint1.position",
    ]
    assert names[22:24] == ["joint1.padding"] * 2
    start = network.tpdo_raw[network.index("ft")]
    assert names[start + 3] == "ft.wrench[0]"
    assert names[start + 26] == "ft.wrench[5]"
    assert (
        names[network.raw_inputs :][:10]
        == ["0x080.counter"] * 2
        + ["0x080.flags", "0x080.reserved"]
        + ["joint1.controlword"] * 2
        + ["joint1.target_torque"] * 2
        + ["joint2.controlword"] * 2
    )
    assert names[-1] == "0x080.padding"


def test_impossible_scaling_is_refused() -> None:
    with pytest.raises(NetworkError, match="must be positive"):
        replace(joint(1), counts_per_turn=0)
    with pytest.raises(NetworkError, match="write 1 or -1"):
        replace(joint(1), sign=0)


def test_an_empty_list_is_refused() -> None:
    with pytest.raises(NetworkError, match="at least one device"):
        Network([])


def test_a_group_holds_devices_with_the_same_fields() -> None:
    with pytest.raises(NetworkError, match="put it into a group of its own"):
        Network([joint(1), Imu(name="imu", node=2, group="joints", acceleration=40.0)])


class Confused(AxisDrive, frozen=True, kw_only=True):
    def outputs(self) -> Mapping[Address, Field]:
        return {(0x6040, 0): Word("statusword"), (0x60FF, 0): Quantity("target_velocity")}


def test_a_field_cannot_be_input_and_output() -> None:
    with pytest.raises(NetworkError, match=r"axes\.statusword.*two different things"):
        Network([Confused(name="axis", node=1, counts_per_metre=1)])


class Forgetful(AxisDrive, frozen=True, kw_only=True):
    def outputs(self) -> Mapping[Address, Field]:
        return {(0x6040, 0): Word("controlword")}


def test_every_output_needs_a_field() -> None:
    with pytest.raises(NetworkError, match=r"60FFh:00.*has no field"):
        Network([Forgetful(name="axis", node=1, counts_per_metre=1)])


def test_an_unknown_name_is_an_error(devices: list[Device]) -> None:
    with pytest.raises(NetworkError, match="no device is called 'joint9'"):
        Network(devices).index("joint9")
