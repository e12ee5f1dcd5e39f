"""The device types that a configuration can name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from .device import Device
from .drive import AxisDrive, JointDrive
from .force_torque import ForceTorque
from .imu import Imu
from .safety_plc import SafetyPlc

DEVICE_TYPES: Final[Mapping[str, type[Device]]] = {
    "joint_drive": JointDrive,
    "axis_drive": AxisDrive,
    "force_torque": ForceTorque,
    "imu": Imu,
    "safety_plc": SafetyPlc,
}
