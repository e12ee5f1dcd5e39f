"""What the configuration of a machine that renders a twin, its model and its plant must agree in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pinocchio as pin

from ...configs.words import meant, nearest
from ...devices.device import Device
from ...devices.torque_drive import TorqueDrive
from ...models import Array, Robot
from ...runtime.core.machine import RAMP_SHARE
from ...runtime.core.sampling import controls, fastest, integrates, steady
from .rendering import sensor_pose
from .sections import ForceControl, Handle, Twin, Twins
from .twin import check_twins

Found = list[tuple[str, str, str]]
"""Key, problem and fix of everything that is wrong."""
MASS_SHARE, CENTRE_NEAR = 0.2, 0.02
"""How far a calibrated handle may be from the model's: share of its mass, and of its centre [m]."""


def check_range(
    robot: Robot, name: str, keys: tuple[str, str, str], values: tuple[float, float, float]
) -> Found:
    """Limits of a joint outside those of the model.

    Args:
        robot: the model.
        name: of the joint.
        keys: of its lower, upper and velocity limit.
        values: of those.
    """
    i = robot.names.index(name)
    allowed = robot.lower[i], robot.upper[i], robot.velocity[i]
    outside = values[0] < allowed[0], values[1] > allowed[1], values[2] > allowed[2]
    return [
        (key, f"{value:g} of {name} is outside the model's {most:g}", "stay inside")
        for key, value, most, wrong in zip(keys, values, allowed, outside, strict=True)
        if wrong
    ]


def check_handle(section: Handle, robot: Robot, handle: str, sensor: str, key: str) -> Found:
    """A handle of another weight than the model's: the controller would take the rest for the operator."""
    frames = robot.model.frames
    # pinocchio keeps the inertia of a fixed link at the joint that fixes it
    body = frames[frames[robot.frame(handle)].parentFrame].inertia
    if abs(body.mass - section.mass) > MASS_SHARE * section.mass:
        problem = f"{section.mass:g} kg, but the link '{handle}' of the model has {body.mass:g} kg"
        return [(f"{key}.mass", problem, "let them agree")]
    T = np.linalg.inv(sensor_pose(robot, handle, sensor))
    centre = T[:3, :3] @ body.lever + T[:3, 3]
    if np.linalg.norm(centre - section.centre) > CENTRE_NEAR:
        at = ", ".join(f"{x:.3g}" for x in centre)
        problem = f"the model's is at ({at}) m in the sensor's frame"
        return [(f"{key}.centre", problem, "let them agree")]
    return []


def check_ramp(braking: float, stop_time: float) -> Found:
    """A stop that takes longer than is declared, from the time that braking takes [s]."""
    if braking <= RAMP_SHARE * stop_time:
        return []
    problem = f"{stop_time:g} s, but braking alone takes {braking:g} s"
    fix = "declare a longer stop time, or lower velocity or raise acceleration"
    return [("safety.stop_time", problem, fix)]


def check_devices(devices: Mapping[str, Device], needed: Mapping[str, type[Device]], machine: str) -> Found:
    """Devices that a machine does not know, lacks, has in another order, or of another kind."""
    found: Found = []
    for name in devices:
        if name not in needed:
            missing = [each for each in needed if each not in devices]
            fix = meant(name, missing) if nearest(name, missing) else meant("", needed)
            found.append((f"devices.{name}", f"{machine} has no such device", fix))
    if list(devices) != list(needed):
        return found or [
            ("devices", f"{machine} needs {', '.join(needed)}, in this order", "add or reorder them")
        ]
    return [
        (f"devices.{name}", "has the wrong type", f"it must be a {kind.__name__}")
        for name, kind in needed.items()
        if not isinstance(devices[name], kind)
    ]


def check_wire(name: str, carried: float, effort: float, unit: str) -> Found:
    """A drive whose words cannot carry what the model allows."""
    if effort <= carried:
        return []
    problem = f"the wire carries {carried:g} {unit}, the model allows more"
    return [(f"devices.{name}.rated_torque", problem, "raise it, or lower the effort in the model")]


def check_peak(name: str, drive: TorqueDrive, effort: float, force: ForceControl) -> Found:
    """A drive that may give more for a time, whose joint may give more for ever than the drive."""
    if drive.peak_torque is None:
        return []
    found: Found = []
    if effort > drive.rated:
        problem = (
            f"is for a time, but the model's effort {effort:g} is above the rated {drive.rated:g} for ever"
        )
        found.append((f"devices.{name}.peak_torque", problem, "lower the effort in the model"))
    if force.detection != "gauss":
        problem = f"has no use: with detection {force.detection!r} torque is no level of the hierarchy"
        found.append((f"devices.{name}.peak_torque", problem, 'remove it, or write "gauss"'))
    return found


def check_no_peaks(devices: Mapping[str, Device], machine: str) -> Found:
    """Peaks of drives in a machine whose controller plans with one torque."""
    return [
        (f"devices.{name}.peak_torque", f"{machine} plans with one torque for ever", "remove it")
        for name, drive in devices.items()
        if isinstance(drive, TorqueDrive) and drive.peak_torque is not None
    ]


def check_control(key: str, force: ForceControl, twin: Twin, others: Twins, dt: float) -> Found:
    """Gains and horizons that a period dt [s] cannot follow, and what is wrong with the twins."""
    gains = {f"{key}.force_control.d_gain": (force.p_gain, force.d_gain)}
    times = {
        f"{key}.force_control.viability_horizon": force.viability_horizon,
        f"{key}.force_control.point_horizon": force.point_horizon,
    }
    return check_gains(gains, dt) + check_times(times, dt) + check_twins(key, twin, others, dt)


def check_gains(pairs: Mapping[str, tuple[float, float]], dt: float) -> Found:
    """Springs and dampers over inertia [1/s^2, 1/s] that act faster than a period dt [s]."""
    problem = f"with its spring and its inertia it acts faster than one period of {dt:g} s"
    return [
        (key, problem, "lower the gains, or raise the rate")
        for key, (stiffness, damping) in pairs.items()
        if not controls(stiffness, damping, dt)
    ]


def check_motors(motors: Mapping[str, tuple[float, float, float]], dt: float) -> Found:
    """Motors that swing up, by keys: gains of position and speed, and the spring behind, over inertia."""
    problem = f"swings its motor up by itself: it acts faster than one period of {dt:g} s and a spring let it"
    return [
        (key, problem, "lower the gains, or raise the rate")
        for key, (stiffness, damping, spring) in motors.items()
        if not steady(stiffness, damping, spring, dt)
    ]


def check_times(times: Mapping[str, float], dt: float) -> Found:
    """Times [s] below a period dt [s]."""
    return [
        (key, f"{time:g} s is less than one period of {dt:g} s", "give at least a period")
        for key, time in times.items()
        if time < dt
    ]


def check_inertia(key: str, moments: Sequence[float]) -> Found:
    """Principal moments, (3,), that no rigid body has."""
    low, mid, high = sorted(moments)
    if low + mid >= high * (1.0 - 1e-6):
        return []
    problem = f"{tuple(moments)} belong to no rigid body"
    return [(key, problem, "none is above the sum of the others")]


def check_weight(arm: Robot, q: Array, brakes: Sequence[float], keys: Sequence[str]) -> Found:
    """Gravity at rest at joints (m,) beside brakes, (m,) with the key of each, and the efforts of motors."""
    gravity = np.abs(pin.computeGeneralizedGravity(arm.model, arm.data, arm.configuration(q))).tolist()
    found: Found = []
    rows = zip(*(arm.names, keys, gravity, brakes, arm.effort, arm.sliding), strict=True)
    for name, key, weight, brake, effort, sliding in rows:
        unit = "N" if sliding else "N m"
        if weight > brake:
            problem = f"{brake:g} {unit} of {name} do not hold its {weight:g} {unit} of gravity"
            found.append((key, problem, "give a stronger brake"))
        if weight > effort:
            problem = f"the effort {effort:g} {unit} of {name} does not hold its {weight:g} {unit} of gravity"
            found.append(("model", problem, "mend masses or efforts"))
    return found


def check_friction(keys: Sequence[str], dry: Sequence[float], arm: Robot) -> Found:
    """Dry friction of joints (m,), by the key of each, that leaves their motors nothing."""
    return [
        (key, f"{rubs:g} {'N' if slides else 'N m'} are as much as its motor gives", "lower it")
        for key, rubs, effort, slides in zip(keys, dry, arm.effort.tolist(), arm.sliding, strict=True)
        if rubs >= effort
    ]


def inverse_inertia(arm: Robot, q: Array) -> Array:
    """Inverse inertia of the links alone at joints (m,), (m, m) [1/(kg m^2) or 1/kg]."""
    links = pin.crba(arm.model, arm.data, arm.configuration(q))
    inverse: Array = np.linalg.inv(np.triu(links) + np.triu(links, 1).T)
    return inverse


def check_springs(
    key: str,
    arm: Robot,
    q: Array,
    springs: tuple[Array, Array, Array],
    friction: Array,
    substeps: int,
    dt: float,
) -> Found:
    """Springs between rotors and links beside the substeps that integrate them.

    Args:
        key: of the substeps.
        arm: the links.
        q: joints, (m,), at which they are judged.
        springs: rotor inertia, stiffness and damping, (m,) each.
        friction: viscous, of the links, (m,).
        substeps: in a period.
        dt: the period [s].
    """
    rotor, stiffness, damping = springs
    inverse, h = inverse_inertia(arm, q), dt / substeps
    both = inverse + np.diag(1.0 / rotor)
    total = fastest(both, damping) + fastest(inverse, friction)
    if integrates(fastest(both, stiffness), total, h):
        return []
    problem = f"{substeps} are too few for springs, dampers and inertias in steps of {h:g} s"
    return [(key, problem, "give more, or softer springs and dampers")]
