"""A kind of device is a file, and what simulates it another that knows no more than the first."""

from __future__ import annotations

import pytest
from hapticd.configs import plugins
from hapticd.configs.quantities import AccelerationScale, Force, Length, Torque
from hapticd.devices.device import Quantity
from hapticd.devices.network import Network
from hapticd.sim.gateway import NEVER
from hapticd.sim.nodes import SimNodes

JOINT = {
    "counts_per_turn": 4096,
    "gear_ratio": (101, 1),
    "link_counts_per_turn": 65536,
    "rated_torque": Torque(50.0),
}
TABLES = {
    "axis_drive": {"counts_per_metre": 10**6},
    "base_drive": {},
    "buttons": {},
    "foot_paddle": {},
    "force_torque": {"force": Force(100.0), "torque": Torque(10.0)},
    "head_tracker": {},
    "imu": {"acceleration": AccelerationScale(40.0)},
    "joint_drive": JOINT,
    "neck_arm": {},
    "remote_avatar": {},
    "remote_body": {},
    "remote_glove": {},
    "remote_hand": {},
    "remote_operator": {},
    "remote_pilot": {},
    "safety_plc": {},
    "sense_glove": {},
    "sih_hand": {},
    "slide_drive": {**JOINT, "lead": Length(0.01)},
    "svh_hand": {},
}
BEGINS = {"age": NEVER}


def test_every_kind_of_ours_is_known_here() -> None:
    ours = [
        name
        for name in plugins.names(plugins.DEVICES)
        if plugins.folder(plugins.DEVICES, name) == "hapticd.devices"
    ]
    assert ours == sorted(TABLES)


@pytest.mark.parametrize("name", TABLES)
def test_a_kind_and_its_simulation_lie_in_files_of_its_name(name: str) -> None:
    kind = plugins.plugin(plugins.DEVICES, name)
    simulated = plugins.plugin(plugins.SIMULATED_DEVICES, name)
    assert (kind.__module__, kind.__struct_config__.tag) == (f"hapticd.devices.{name}", name)
    assert (simulated.__module__, simulated.__name__) == (f"hapticd.sim.{name}", f"Sim{kind.__name__}")


@pytest.mark.parametrize("name", TABLES)
def test_a_simulated_device_begins_with_all_that_its_kind_describes(name: str) -> None:
    device = plugins.plugin(plugins.DEVICES, name)(name="it", node=1, **TABLES[name])
    node = SimNodes(Network([device]))["it"]
    assert type(node) is plugins.plugin(plugins.SIMULATED_DEVICES, name)
    fields = [*device.inputs().values(), *device.outputs().values()]
    for field in fields:
        value = getattr(node, field.field)
        width = sum(other.field == field.field for other in fields)
        if width > 1:
            assert value == (0.0,) * width
        elif isinstance(field, Quantity):
            assert value == BEGINS.get(field.field, 0.0)
        else:
            assert isinstance(value, int)


def test_a_device_says_itself_what_is_wrong_with_its_table() -> None:
    kind = plugins.plugin(plugins.DEVICES, "joint_drive")
    assert kind(name="it", node=1, **JOINT).check() == []
    coarse = kind(name="it", node=1, **{**JOINT, "link_counts_per_turn": 999})
    assert coarse.check() == [("link_counts_per_turn", "999 counts a turn of the shaft", "give 1000 or more")]
