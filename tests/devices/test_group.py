from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hapticd.devices.axis_drive import AxisDrives
from hapticd.devices.errors import NetworkError
from hapticd.devices.force_torque import ForceTorques, SensorStatus
from hapticd.devices.imu import Imus
from hapticd.devices.torque_drive import JointDrives
from hapticd.sim.axis_drive import SimAxisDrive
from hapticd.sim.joint_drive import SimJointDrive

if TYPE_CHECKING:
    from ..conftest import Rig


def test_joints_are_read_and_written_as_arrays(enabled: Rig) -> None:
    joints = JointDrives(enabled.image)
    simulated = enabled.nodes.of(SimJointDrive)
    for i, node in enumerate(simulated):
        node.position, node.link_position, node.velocity, node.load_torque = 0.1 * i, 0.2 * i, -i, 2.0 * i
    enabled.image["joints.target_torque"][:] = np.arange(6) - 3.0
    enabled.run(2)
    np.testing.assert_allclose(joints.position, 0.1 * np.arange(6), atol=1e-6)
    np.testing.assert_allclose(joints.link_position, 0.2 * np.arange(6), atol=1e-5)
    np.testing.assert_allclose(joints.velocity, -np.arange(6), atol=1e-6)
    np.testing.assert_allclose(joints.load_torque, 2.0 * np.arange(6), atol=0.05)
    np.testing.assert_allclose([node.torque for node in simulated], np.arange(6) - 3.0)
    assert joints.mode.tolist() == [10] * 6
    assert (joints.statusword & 0x6F == 0x27).all()
    assert joints.controlword.tolist() == [0x0F] * 6
    assert not joints.error_code.any()


def test_axes_are_read_and_written_as_arrays(enabled: Rig) -> None:
    axes = AxisDrives(enabled.image)
    simulated = enabled.nodes.of(SimAxisDrive)
    for node, position in zip(simulated, (1.5, -0.5), strict=True):
        node.position, node.velocity = position, -position
    enabled.image["axes.target_velocity"][:] = (0.25, -0.125)
    enabled.run(2)
    assert axes.position.tolist() == [1.5, -0.5]
    assert axes.velocity.tolist() == [-1.5, 0.5]
    assert [node.velocity_command for node in simulated] == [0.25, -0.125]
    assert axes.mode.tolist() == [9, 9]


def test_sensors_are_read_as_arrays(ready: Rig) -> None:
    ready.run(1)
    assert ForceTorques(ready.image).wrench.shape == (1, 6)
    assert ForceTorques(ready.image).status.tolist() == [SensorStatus.READY]
    imus = Imus(ready.image)
    assert imus.acceleration.shape == imus.angular_velocity.shape == (2, 3)
    assert imus.status.tolist() == [SensorStatus.READY] * 2
    assert imus.ready(0) and imus.ready(1)
    imus.status[0] = SensorStatus.FAULT
    assert not imus.ready(0) and imus.ready(1)
    sensor = ForceTorques(ready.image)
    assert sensor.ready(0)
    sensor.status[0] = SensorStatus.READY | SensorStatus.SATURATED
    assert not sensor.ready(0)


def test_a_group_is_where_its_kind_says_unless_another_is_named(ready: Rig) -> None:
    assert (JointDrives(ready.image).position == JointDrives(ready.image, "joints").position).all()
    with pytest.raises(NetworkError, match=r"no group 'arms'; there are .*joints"):
        JointDrives(ready.image, "arms")
    with pytest.raises(NetworkError, match=r"axes\.link_position"):
        JointDrives(ready.image, "axes")


def test_nobody_writes_a_quantity_past_the_gate(ready: Rig) -> None:
    for view in (JointDrives(ready.image).target_torque, AxisDrives(ready.image).target_velocity):
        with pytest.raises(ValueError, match="read-only"):
            view[0] = 1.0
    ready.image["joints.target_torque"][0] = 1.0
    assert JointDrives(ready.image).target_torque[0] == 1.0
    JointDrives(ready.image).controlword[0] = 6
    assert ready.image.word("joints.controlword")[0] == 6
