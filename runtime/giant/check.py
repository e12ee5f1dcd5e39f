"""What only the model can tell of a giant's configuration."""

from __future__ import annotations

from difflib import get_close_matches
from math import pi

from ...models import Robot
from ...models.giant import DROP
from ..machine import MOST_PERMILLE, RAMP_SHARE
from ..sections import AxisDrive, ForceTorque, Imu, JointDrive, SafetyPlc
from .config import GiantConfig
from .geometry import check_geometry, check_handle
from .machine import braking_time
from .names import JOINTS, PPU_JOINTS
from .plant_check import check_plant
from .rates import check_rates


def check_giant(config: GiantConfig, robot: Robot) -> list[tuple[str, str, str]]:
    """What only the model can tell of a giant's configuration: key, problem, fix."""
    found: list[tuple[str, str, str]] = []
    wrong = check_geometry(robot)
    if wrong:
        return [("model", problem, fix) for problem, fix in wrong]
    found += _beyond_model(config, robot) + check_handle(config, robot)
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
    ramp = braking_time(config)
    if ramp > RAMP_SHARE * config.safety.stop_time:
        found.append(
            (
                "safety.stop_time",
                f"{config.safety.stop_time:g} s, but braking alone takes {ramp:g} s",
                "declare a longer stop time, or lower velocity or raise acceleration",
            )
        )
    return found + _devices_of_giant(config, robot) + check_rates(config) + check_plant(config, robot)


def _beyond_model(config: GiantConfig, robot: Robot) -> list[tuple[str, str, str]]:
    """Limits outside those of the model."""
    manipulator, ppu = config.giant.manipulator, config.giant.ppu
    groups = (
        ("giant.manipulator", JOINTS, manipulator.lower, manipulator.upper, manipulator.velocity),
        ("giant.ppu", PPU_JOINTS, ppu.lower, ppu.upper, (ppu.velocity,) * 2),
    )
    found = []
    for group, names, lower, upper, velocity in groups:
        for k, name in enumerate(names):
            i = robot.names.index(name)
            for key, value, allowed, outside in (
                ("lower", lower[k], robot.lower[i], lower[k] < robot.lower[i]),
                ("upper", upper[k], robot.upper[i], upper[k] > robot.upper[i]),
                ("velocity", velocity[k], robot.velocity[i], velocity[k] > robot.velocity[i]),
            ):
                if outside:
                    problem = f"{value:g} of {name} is outside the model's {allowed:g}"
                    found.append((f"{group}.{key}", problem, "stay inside"))
    return found


def _devices_of_giant(config: GiantConfig, robot: Robot) -> list[tuple[str, str, str]]:
    """Devices that the controller needs, with ratings that can give what it may command."""
    found = []
    effort = dict(zip(robot.names, robot.effort.tolist(), strict=True))
    needed = {
        **dict.fromkeys(JOINTS, JointDrive),
        **dict.fromkeys(PPU_JOINTS, AxisDrive),
        "force_torque": ForceTorque,
        "imu_carriage": Imu,
        "imu_handle": Imu,
        "safety_plc": SafetyPlc,
    }
    for name in config.devices:
        if name not in needed:
            near = get_close_matches(name, set(needed) - set(config.devices), 1)
            fix = f'did you mean "{near[0]}"?' if near else f"known here: {', '.join(needed)}"
            found.append((f"devices.{name}", "the giant has no such device", fix))
    if list(config.devices) != list(needed):
        return found or [
            ("devices", f"the giant needs {', '.join(needed)}, in this order", "add or reorder them")
        ]
    for name, kind in needed.items():
        device = config.devices[name]
        if not isinstance(device, kind):
            found.append((f"devices.{name}", "has the wrong type", f"it must be a {kind.__name__}"))
        elif isinstance(device, JointDrive) and effort[name] > MOST_PERMILLE * device.rated_torque:
            found.append(
                (
                    f"devices.{name}.rated_torque",
                    f"the wire carries {MOST_PERMILLE * device.rated_torque:g} N m, the model allows more",
                    "raise it, or lower the effort in the model",
                )
            )
    return found
