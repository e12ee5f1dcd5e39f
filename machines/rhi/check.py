"""What only the model can tell of a redundant interface's configuration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...devices.force_torque import ForceTorque
from ...devices.joint_drive import JointDrive
from ...devices.safety_plc import SafetyPlc
from ...models import Robot
from ...runtime.core.machine import MOST_PERMILLE, RAMP_SHARE
from ..rendering.check import check_no_peaks
from .body_check import body_lengths, check_bodies
from .config import RhiConfig
from .directions import check_directions
from .machine import drive_names, redundant_arm
from .manipulability import velocity_ellipsoid
from .model_check import check_model
from .rates import check_braking, check_rates
from .redundant import PLACE

Found = list[tuple[str, str, str]]
LARGEST_CONDITION = 1e6
"""Condition of J W^2 J^T in the home posture, whose ellipsoid gives the scale of the desired ones."""
LARGEST_CONDITION_OF_T = 1e3
"""Condition of the transmission: motors that drive a joint a thousand times as far as another."""


def check_rhi(config: RhiConfig, robot: Robot) -> Found:
    """What only the model can tell of a redundant interface's configuration: key, problem, fix."""
    found = (
        _lengths(config, robot)
        or _transmission(config)
        or check_directions(config)
        or _moved(config, robot)
        or check_bodies(config.rhi.bodies)
    )
    if found:
        return found
    found = (
        check_no_peaks(config.devices, "the interface")
        + _motors(config)
        + _task(config, robot)
        + _devices(config)
    )
    found += check_model(config, robot) + check_rates(config, robot)
    return found or check_braking(config, robot)


def _lengths(config: RhiConfig, robot: Robot) -> Found:
    """Entries per motor and per direction."""
    rhi, n, m = config.rhi, robot.nv, min(PLACE, len(config.rhi.task.directions))
    motors, hold = rhi.motors, rhi.hold
    counted = {
        "rhi.motors.transmission": (len(motors.transmission), n),
        "rhi.motors.rotor_inertia": (len(motors.rotor_inertia), n),
        "rhi.motors.friction": (len(motors.friction), n),
        "rhi.motors.torque": (len(motors.torque), n),
        "rhi.motors.lower": (len(motors.lower), n),
        "rhi.motors.upper": (len(motors.upper), n),
        "rhi.motors.velocity": (len(motors.velocity), n),
        "rhi.motors.acceleration": (len(motors.acceleration), n),
        "rhi.task.home": (len(rhi.task.home), n),
        "rhi.hold.stiffness": (len(hold.stiffness), n),
        "rhi.hold.damping": (len(hold.damping), n),
    }
    counted |= {key: (count, want) for key, count, want in body_lengths(rhi.bodies, m)}
    if config.simulation is not None:
        plant = config.simulation.rhi
        counted |= {
            "simulation.rhi.posture": (len(plant.posture), n),
            "simulation.rhi.friction": (len(plant.friction), n),
            "simulation.rhi.brake_torque": (len(plant.brake_torque), n),
        }
        if not isinstance(plant.masses, float):
            counted["simulation.rhi.masses"] = len(plant.masses), n
    found = [
        (key, f"holds {have} entries", f"give {want}")
        for key, (have, want) in counted.items()
        if have != want
    ]
    ragged = {len(row) for row in motors.transmission} - {n}
    if ragged:
        found.append(("rhi.motors.transmission", f"has a row of {ragged.pop()} numbers", f"give {n}"))
    return found


def _motors(config: RhiConfig) -> Found:
    motors, found = config.rhi.motors, []
    for i, (low, high) in enumerate(zip(motors.lower, motors.upper, strict=True), 1):
        if low >= high:
            found.append(
                ("rhi.motors.lower", f"{low:g} of motor {i} is not below {high:g}", "swap or mend them")
            )
    ramp = max(v / a for v, a in zip(motors.velocity, motors.acceleration, strict=True))
    if ramp > RAMP_SHARE * config.safety.stop_time:
        problem = f"{config.safety.stop_time:g} s, but braking a motor alone takes {ramp:g} s"
        fix = "declare a longer stop time, or lower velocity or raise acceleration"
        found.append(("safety.stop_time", problem, fix))
    return found


def _transmission(config: RhiConfig) -> Found:
    T = np.array(config.rhi.motors.transmission)
    if np.linalg.cond(T) > LARGEST_CONDITION_OF_T:
        return [("rhi.motors.transmission", "is singular", "every joint needs its motor")]
    return []


def _moved(config: RhiConfig, robot: Robot) -> Found:
    """More directions than joints can move the hand in."""
    m, n = len(config.rhi.task.directions), robot.nv
    if m <= n:
        return []
    return [
        (
            "rhi.task.directions",
            f"names {m}, and {n} joints move the hand in {n} at most",
            f"name {n} or fewer, or add joints; with as many there is no posture to turn",
        )
    ]


def _simulated_posture(config: RhiConfig) -> Iterator[tuple[str, Sequence[float]]]:
    if config.simulation is not None:
        yield "simulation.rhi.posture", config.simulation.rhi.posture


def _task(config: RhiConfig, robot: Robot) -> Found:
    rhi, found = config.rhi, []
    saturation = rhi.saturation
    if saturation.leave >= saturation.come_back:
        problem = f"{saturation.leave:g} is not below come_back = {saturation.come_back:g}"
        found.append(("rhi.saturation.leave", problem, "hysteresis needs a gap"))
    for key, places in (("rhi.task.home", rhi.task.home), *_simulated_posture(config)):
        if not all(a <= q <= b for a, q, b in zip(rhi.motors.lower, places, rhi.motors.upper, strict=True)):
            found.append((key, "is outside the motors' limits", "give a posture inside"))
    if robot.model.existFrame(rhi.task.frame):
        J = redundant_arm(config, robot).at(np.array(rhi.task.home)).J
        if np.linalg.cond(velocity_ellipsoid(J, np.array(rhi.motors.torque))) > LARGEST_CONDITION:
            found.append(("rhi.task.home", "is a singular posture", "choose another"))
    return found


def _devices(config: RhiConfig) -> Found:
    found: Found = []
    drives, n = drive_names(config), len(config.rhi.motors.torque)
    if len(drives) != n:
        found.append(("devices", f"has {len(drives)} joint drives", f"give one a motor, {n}, in their order"))
    for name, kind in (("force_torque", ForceTorque), ("safety_plc", SafetyPlc)):
        if not isinstance(config.devices.get(name), kind):
            found.append(("devices", f"lacks a {kind.__name__} named {name}", "add it"))
    spare = set(config.devices) - {*drives, "force_torque", "safety_plc"}
    found += [(f"devices.{name}", "the interface has no such device", "remove it") for name in sorted(spare)]
    for name, most in zip(drives, config.rhi.motors.torque, strict=False):
        drive = config.devices[name]
        assert isinstance(drive, JointDrive)
        carried = MOST_PERMILLE * drive.rated_torque
        if most > carried:
            problem = f"the wire carries {carried:g} N m, the motor may give {most:g}"
            found.append((f"devices.{name}.rated_torque", problem, "raise it"))
    return found
