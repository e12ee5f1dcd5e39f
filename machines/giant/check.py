"""What only the model can tell of a giant's configuration."""

from __future__ import annotations

from math import pi

from ...devices.axis_drive import AxisDrive
from ...devices.device import Device
from ...devices.force_torque import ForceTorque
from ...devices.imu import Imu
from ...devices.joint_drive import JointDrive
from ...devices.safety_plc import SafetyPlc
from ...models import Robot
from ...runtime.core.machine import MOST_PERMILLE
from ..rendering.check import (
    Found,
    check_devices,
    check_friction,
    check_peak,
    check_ramp,
    check_range,
    check_wire,
)
from ..rendering.giving_way import check_compliance
from ..rendering.surroundings import check_pairs
from ..rendering.tool import check_tool
from ..telemanipulation.leading_check import check_leads, gateways
from .config import GiantConfig
from .geometry import check_geometry
from .kinematics import DROP
from .names import JOINTS, PPU_JOINTS
from .parts import braking_time, drive_friction
from .plant_check import check_plant
from .rates import check_rates


def check_giant(config: GiantConfig, robot: Robot) -> Found:
    """What only the model can tell of a giant's configuration: key, problem, fix."""
    found: Found = []
    wrong = check_geometry(robot)
    if wrong:
        return [("model", problem, fix) for problem, fix in wrong]
    found += _beyond_model(config, robot) + check_tool(
        config.giant.handle,
        config.devices,
        robot,
        ("handle", "force_torque"),
        ("giant.handle", "force_torque"),
    )
    manipulator, box = config.giant.manipulator, config.giant.box
    for key, lower, upper in (
        ("giant.manipulator.lower", manipulator.lower, manipulator.upper),
        ("giant.manipulator.tilt", manipulator.tilt[:1], manipulator.tilt[1:]),
        ("giant.box.lower", box.lower, box.upper),
        ("giant.ppu.lower", config.giant.ppu.lower, config.giant.ppu.upper),
    ):
        if any(low >= high for low, high in zip(lower, upper, strict=True)):
            found.append(
                (key, f"{lower} is not below {upper}", "every lower limit must be below its upper one")
            )
    if not 0.0 < manipulator.tilt[0] < manipulator.tilt[1] < pi:
        found.append(
            ("giant.manipulator.tilt", f"{manipulator.tilt} leaves (0, pi)", "stay clear of 0 and pi")
        )
    if not box.lower[2] < -DROP < box.upper[2]:
        found.append(
            ("giant.box.lower", f"the elbow's constant height {-DROP} m is outside", "let the box contain it")
        )
    friction, key = drive_friction(config), "giant.tracking.gear_friction"
    dry = (friction.gear + friction.bearing).tolist()
    found += check_friction([key] * len(JOINTS), dry, robot.without(PPU_JOINTS))
    found += check_pairs(robot, config.look_ahead)
    found += check_compliance(config.compliance, config.giant.force_control)
    found += check_leads(config.leads, "giant", config.giant.twin)
    if config.leads and config.giant.twins:
        found.append(("giant.twins", "no twin but the first leads an avatar's arm", "remove them"))
    found += check_ramp(braking_time(config), config.safety.stop_time)
    return found + _devices_of_giant(config, robot) + check_rates(config) + check_plant(config, robot)


def _beyond_model(config: GiantConfig, robot: Robot) -> Found:
    """Limits outside those of the model."""
    manipulator, ppu = config.giant.manipulator, config.giant.ppu
    groups = (
        ("giant.manipulator", JOINTS, manipulator.lower, manipulator.upper, manipulator.velocity),
        ("giant.ppu", PPU_JOINTS, ppu.lower, ppu.upper, (ppu.velocity,) * 2),
    )
    return [
        found
        for group, names, lower, upper, velocity in groups
        for name, low, high, speed in zip(names, lower, upper, velocity, strict=True)
        for found in check_range(
            robot, name, (f"{group}.lower", f"{group}.upper", f"{group}.velocity"), (low, high, speed)
        )
    ]


def _devices_of_giant(config: GiantConfig, robot: Robot) -> Found:
    """Devices that the controller needs, with ratings that can give what it may command."""
    needed: dict[str, type[Device]] = {
        **dict.fromkeys(JOINTS, JointDrive),
        **dict.fromkeys(PPU_JOINTS, AxisDrive),
        "force_torque": ForceTorque,
        "imu_carriage": Imu,
        "imu_handle": Imu,
        **gateways(config.leads),
        "safety_plc": SafetyPlc,
    }
    if found := check_devices(config.devices, needed, "the giant"):
        return found
    for name, effort in zip(robot.names, robot.effort.tolist(), strict=True):
        device = config.devices[name]
        if isinstance(device, JointDrive):
            found += check_wire(name, MOST_PERMILLE * device.rated_torque, effort, "N m")
            found += check_peak(name, device, effort, config.giant.force_control)
    return found
