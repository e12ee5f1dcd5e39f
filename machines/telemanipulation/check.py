"""What the configuration of a station, its model and its plant must agree in."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...devices.device import Device
from ...devices.force_torque import ForceTorque
from ...devices.joint_drive import JointDrive
from ...devices.remote import MOST_JOINTS
from ...devices.safety_plc import SafetyPlc
from ...devices.torque_drive import TorqueDrive
from ...models import Array, Robot
from ...runtime.core.machine import MOST_PERMILLE
from ...runtime.core.sampling import fastest, integrates
from ...runtime.core.sections import Config
from ..rendering.check import (
    Found,
    check_devices,
    check_gains,
    check_inertia,
    check_no_peaks,
    check_ramp,
    check_weight,
    check_wire,
    inverse_inertia,
)
from ..rendering.own_plant import check_own_plant
from ..rendering.tool import tool_of
from .arm import FLANGE, SIDES, chain_of, weight
from .sections import Chain, OwnChain, Station, StationSimulation
from .station import braking, joint_names

LISTS = ("lower", "upper", "velocity", "home")
LATE = (1.0 + 5.0**0.5) / 2.0
"""A damper that acts two periods late has z^3 - z^2 + dt d = 0, stable where dt d is below the inverse of the
golden ratio: at 250 Hz both built-in stations, with .95, turned until they stopped."""


def check_chain(key: str, chain: Chain, robot: Robot) -> Found:
    """An arm that the model lacks, or whose numbers are not those of its joints."""
    joints = [i for i, name in enumerate(robot.names) if name.startswith(chain.prefix)]
    if not joints:
        return [(f"{key}.prefix", f"no joint of the model begins with '{chain.prefix}'", "check the model")]
    if len(joints) > MOST_JOINTS:
        return [(f"{key}.prefix", f"{len(joints)} joints", f"give an arm with at most {MOST_JOINTS}")]
    if not robot.model.existFrame(f"{chain.prefix}{FLANGE}"):
        problem = f"the model lacks the link '{chain.prefix}{FLANGE}'"
        return [(f"{key}.prefix", problem, "name the last link of the arm so")]
    for name in LISTS:
        if len(getattr(chain, name)) != len(joints):
            problem = f"has {len(getattr(chain, name))} numbers for {len(joints)} joints"
            return [(f"{key}.{name}", problem, "give one for each")]
    found: Found = []
    for place, i in enumerate(joints):
        low, high, home = chain.lower[place], chain.upper[place], chain.home[place]
        if not low < high:
            found.append((f"{key}.lower", f"{low:g} of {robot.names[i]} is not below {high:g}", "mend it"))
        for name, value, most, wrong in (
            ("lower", low, robot.lower[i], low < robot.lower[i]),
            ("upper", high, robot.upper[i], high > robot.upper[i]),
            ("velocity", chain.velocity[place], robot.velocity[i], chain.velocity[place] > robot.velocity[i]),
        ):
            if wrong:
                problem = f"{value:g} of {robot.names[i]} is outside the model's {most:g}"
                found.append((f"{key}.{name}", problem, "stay inside"))
        if not low <= home <= high:
            problem = f"{home:g} of {robot.names[i]} is outside {low:g} to {high:g}"
            found.append((f"{key}.home", problem, "stay inside"))
    return found


def check_station(
    name: str,
    config: Config,
    station: Station,
    simulation: StationSimulation | None,
    robot: Robot,
    others: Mapping[str, type[Device]],
) -> Found:
    """Findings of either station; ``others`` are the devices that only it has."""
    for side in SIDES:
        if wrong := check_chain(f"{name}.arms.{side}", getattr(station.arms, side), robot):
            return wrong
    n = len(station.arms.left.lower)
    if len(station.arms.right.lower) != n:
        fix = "give both arms as many joints"
        return [(f"{name}.arms.right", f"has another number of joints than the left arm's {n}", fix)]
    for key in ("stiffness", "damping", "deceleration"):
        if len(getattr(station.hold, key)) != n:
            problem = f"has {len(getattr(station.hold, key))} numbers for {n} joints"
            return [(f"{name}.hold.{key}", problem, "give one for each joint of an arm")]
    drives = dict.fromkeys(joint_names(station), JointDrive)
    needed: dict[str, type[Device]] = {
        **drives,
        **{f"{side}_force_torque": ForceTorque for side in SIDES},
        **others,
        "safety_plc": SafetyPlc,
    }
    if found := check_devices(config.devices, needed, f"the {name} station"):
        return found
    found = check_ramp(braking(station), config.safety.stop_time)
    found += check_no_peaks(config.devices, "the station")
    for side in SIDES:
        chain: OwnChain = getattr(station.arms, side)
        sensor = config.devices[f"{side}_force_torque"]
        assert isinstance(sensor, ForceTorque)
        for key, unit in (("force", "N"), ("torque", "N m")):
            most, scale = getattr(station.stop, key), getattr(sensor, key)
            if most > scale:
                problem = f"{most:g} {unit} is more than the sensor '{side}_force_torque' measures"
                found.append((f"{name}.stop.{key}", problem, f"give at most {scale:g} {unit}"))
        if (chain.tool is None) == (sensor.kept is None):
            problem = (
                "says a second time what the calibration of the sensor does" if chain.tool else "is missing"
            )
            fix = "say it here, or by the calibration of the sensor: hapticd calibrate ft"
            found.append((f"{name}.arms.{side}.tool", problem, fix))
            continue
        arm = chain_of(robot, chain, weight(tool_of(chain.tool, sensor)))
        for i, effort in enumerate(arm.effort.tolist()):
            drive = config.devices[f"{side}_joint_{i + 1}"]
            assert isinstance(drive, TorqueDrive)
            found += check_wire(f"{side}_joint_{i + 1}", MOST_PERMILLE * drive.rated, effort, "N m")
        if simulation is not None and not found:
            found += _plant(chain, station, simulation, arm, 1.0 / config.loop.rate)
    return found


def _plant(chain: OwnChain, station: Station, simulation: StationSimulation, arm: Robot, dt: float) -> Found:
    """A plant that can be integrated, held by its brakes, and controlled."""
    own, n, q = simulation.arms, arm.nv, np.array(chain.home, float)
    for key in ("rotor_inertia", "brake"):
        if len(getattr(own, key)) != n:
            problem = f"has {len(getattr(own, key))} numbers for {n} joints"
            return [(f"simulation.arms.{key}", problem, "give one for each joint of an arm")]
    found = check_own_plant(simulation.plant, n, False)
    found += check_inertia("simulation.arms.tool_inertia", own.tool_inertia)
    found += check_weight(arm, q, own.brake, ["simulation.arms.brake"] * n)
    whole = _whole(arm, q, np.array(own.rotor_inertia, float))
    if not integrates(0.0, fastest(whole, arm.damping), dt / own.substeps):
        problem = f"{own.substeps} are too few for the friction in steps of {dt / own.substeps:g} s"
        found.append(("simulation.arms.substeps", problem, "give more, or less friction"))
    p, d = (np.array(x, float) for x in (station.hold.stiffness, station.hold.damping))
    late = LATE * dt
    return found + check_gains({"hold.damping": (fastest(whole, p), fastest(whole, d))}, late)


def _whole(arm: Robot, q: Array, rotor: Array) -> Array:
    """Inverse inertia of rotors and links, which move as one, (n, n)."""
    inverse: Array = np.linalg.inv(np.linalg.inv(inverse_inertia(arm, q)) + np.diag(rotor))
    return inverse
