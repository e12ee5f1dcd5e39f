"""What devices and simulation of a configuration must fulfil, on every machine."""

from __future__ import annotations

from itertools import pairwise
from math import dist

from ...devices.device import Device
from ...devices.force_torque import ForceTorque
from ...devices.imu import Imu
from ...devices.joint_drive import JointDrive
from ..core.sections import Config, SimulatedBus

Found = list[tuple[str, str, str]]
SENSORS: dict[str, type[Device]] = {
    **dict.fromkeys(("motor_encoder", "motor_speed", "link_encoder", "load_torque"), JointDrive),
    **dict.fromkeys(("force", "torque"), ForceTorque),
    **dict.fromkeys(("acceleration", "angular_rate"), Imu),
}
"""Which devices have the sensors whose errors [simulation.sensors] gives."""
FASTEST_HAND = 10.0
"""A boxer's fist [m/s]."""


def check_devices(config: Config) -> Found:
    """What each kind of device knows to be wrong with its table."""
    return [
        (f"devices.{name}.{key}", problem, fix)
        for name, device in config.devices.items()
        for key, problem, fix in device.check()
    ]


def check_simulation(config: Config) -> Found:
    """A simulated bus with nothing to simulate."""
    if config.simulation is not None or not isinstance(config.bus, SimulatedBus):
        return []
    return [("simulation", "is missing", "a simulated bus needs this section")]


def check_sensors(config: Config) -> Found:
    """Errors of sensors that no device has."""
    simulation = config.simulation
    if simulation is None or simulation.sensors is None:
        return []
    found: Found = []
    for key, kind in SENSORS.items():
        if getattr(simulation.sensors, key) and not any(isinstance(d, kind) for d in config.devices.values()):
            problem = f"no device is of type '{kind.__struct_config__.tag}'"
            found.append((f"simulation.sensors.{key}", problem, "remove it"))
    return found


def check_hand_speed(config: Config) -> Found:
    """A hand that moves faster than any hand."""
    if config.simulation is None:
        return []
    for i, (a, b) in enumerate(pairwise(config.simulation.hand.path)):
        way, time = dist(a.position, b.position), b.at - a.at
        if time > 0.0 and way > FASTEST_HAND * time:
            problem = f"{way:g} m in {time:g} s"
            return [(f"simulation.hand.path[{i + 1}]", problem, f"at most {FASTEST_HAND:g} m/s")]
    return []
