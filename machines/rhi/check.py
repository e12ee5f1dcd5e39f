"""What only the model can tell of a redundant interface's configuration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import sqrt

import numpy as np

from ...devices.force_torque import ForceTorque
from ...devices.joint_drive import JointDrive
from ...devices.safety_plc import SafetyPlc
from ...models import Robot
from ...runtime.core.machine import DRIFT, MOST_PERMILLE, RAMP_SHARE
from ..rendering.check import check_no_peaks
from .body_check import body_lengths, check_bodies
from .config import RhiConfig
from .directions import check_directions
from .guard import STOP
from .machine import drive_names, redundant_arm
from .manipulability import Shape, force_ellipsoid, velocity_ellipsoid
from .model_check import check_model
from .rates import check_braking, check_rates
from .reach_check import check_reach
from .redundant import AXES, PLACE
from .sampled_walls import check_walls, remarks_on_walls
from .solid_check import check_solids

Found = list[tuple[str, str, str]]
LARGEST_CONDITION = 1e6
"""Condition of J W^2 J^T in the home posture, whose ellipsoid gives the scale of the desired ones."""
LARGEST_CONDITION_OF_T = 1e3
"""Condition of the transmission: motors that drive a joint a thousand times as far as another."""

LONGEST_TRANSITION = 60.0
"""A person waits no longer for it [s]."""


def check_rhi(config: RhiConfig, robot: Robot) -> Found:
    """What only the model can tell of a redundant interface's configuration: key, problem, fix."""
    found = (
        check_solids(config.rhi.bodies, min(PLACE, len(config.rhi.task.directions)))
        or _lengths(config, robot)
        or _transmission(config)
        or check_directions(config)
        or _moved(config, robot)
    )
    if found:
        return found
    bodies, motors = check_bodies(config.rhi.bodies), _motors(config)
    found = check_no_peaks(config.devices, "the interface") + bodies + motors
    found += _task(config, robot) + _devices(config) + check_model(config, robot)
    found += check_rates(config, robot)
    if motors or not robot.model.existFrame(config.rhi.task.frame):
        return found
    found += _home(config, robot) or _transition(config, robot)
    found += [] if bodies else check_reach(config, robot) + check_walls(config, robot)
    return found or check_braking(config, robot)


def remarks_on_rhi(config: RhiConfig, robot: Robot) -> list[str]:
    """What people should know of a configuration that is fine."""
    return remarks_on_walls(config, robot) + _remarks_on_hand(config, robot)


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


def _inside(config: RhiConfig, key: str, posture: Sequence[float], room: float) -> Found:
    """A posture that is not inside all limits by some room [rad], in which the end stop pushes."""
    found: Found = []
    motors = config.rhi.motors
    for i, (low, q, high) in enumerate(zip(motors.lower, posture, motors.upper, strict=True), 1):
        if low + room < q < high - room:
            continue
        what = (
            "outside" if not low <= q <= high else "on one of" if q in (low, high) else "in the end stop of"
        )
        problem = f"{q:g} rad is {what} the limits of motor {i}, {low:g} to {high:g} rad"
        fix = f"give more than {low + room:.4g} and less than {high - room:.4g} rad"
        found.append((key, problem, fix))
    return found


def _transition(config: RhiConfig, robot: Robot) -> Found:
    """A transition that takes no time that a person would wait for, wherever motion and contact point.

    I - P_u - P_F of (19) is no larger than the square root of the number of directions.
    """
    rho, motors, dt = config.rhi.saturation.rho, config.rhi.motors, 1.0 / config.loop.rate
    home = redundant_arm(config, robot).at(np.array(config.rhi.task.home)).J
    scale = Shape.of_home(force_ellipsoid(home, np.array(motors.torque)), config.rhi.task.spread)
    whole = (scale.major - scale.minor) * sqrt(len(home))
    if not rho or dt <= rho * whole <= LONGEST_TRANSITION:
        return []
    problem = f"{rho:g} makes a transition of up to {rho * whole:.3g} s"
    fix = f"give {dt / whole:.2g} to {LONGEST_TRANSITION / whole:.2g}, or 0 for no transition"
    return [("rhi.saturation.rho", problem, fix)]


def _remarks_on_hand(config: RhiConfig, robot: Robot) -> list[str]:
    """A simulated hand that pulls so far from where the handle begins that no session starts."""
    if config.simulation is None:
        return []
    rhi, hand = config.rhi, config.simulation.hand
    joints = np.array(rhi.motors.transmission) @ np.array(config.simulation.rhi.posture)
    handle = robot.placement(joints, rhi.task.frame)[:PLACE, 3]
    rows = [AXES.index(name) for name in rhi.task.directions[:PLACE]]
    away = float(np.linalg.norm((np.array(hand.path[0].position) - handle)[rows]))
    sensor = config.devices["force_torque"]
    assert isinstance(sensor, ForceTorque)
    force = min(hand.force, hand.stiffness * away)
    if force <= DRIFT * sensor.force:
        return []
    place = " ".join(f"{x:.3f}" for x in handle.tolist())
    return [
        f"the simulated hand begins {away:.3g} m from the handle, which is at {place} m, and pulls it with"
        f" {force:.3g} N: nothing starts before it lets go"
    ]


def _task(config: RhiConfig, robot: Robot) -> Found:
    rhi, found = config.rhi, []
    saturation = rhi.saturation
    if saturation.leave >= saturation.come_back:
        problem = f"{saturation.leave:g} is not below come_back = {saturation.come_back:g}"
        found.append(("rhi.saturation.leave", problem, "hysteresis needs a gap"))
    if saturation.leave == 0.0:
        found.append(("rhi.saturation.leave", "0: no reserve is below it, and no posture turns", "give more"))
    if saturation.come_back == 1.0:
        problem = "1: no reserve is above it, and no posture turns back"
        found.append(("rhi.saturation.come_back", problem, "give less"))
    found += _inside(config, "rhi.task.home", rhi.task.home, 0.0)
    for key, posture in _simulated_posture(config):
        found += _inside(config, key, posture, STOP * rhi.null_space.margin)
    return found


def _home(config: RhiConfig, robot: Robot) -> Found:
    """A posture whose ellipsoid has no extent in some direction."""
    task = config.rhi.task
    J = redundant_arm(config, robot).at(np.array(task.home)).J
    if np.linalg.cond(velocity_ellipsoid(J, np.array(config.rhi.motors.torque))) > LARGEST_CONDITION:
        return [("rhi.task.home", "is a singular posture", "choose another")]
    return []


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
