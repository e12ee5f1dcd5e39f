"""What only the model can tell of an arm's configuration."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pinocchio as pin

from ...devices.device import Device
from ...devices.force_torque import ForceTorque
from ...devices.joint_drive import JointDrive
from ...devices.safety_plc import SafetyPlc
from ...devices.slide_drive import SlideDrive
from ...devices.torque_drive import TorqueDrive
from ...models import Array, Robot
from ...runtime.core.machine import MOST_PERMILLE
from ...runtime.core.sampling import fastest, integrates
from ..rendering.check import (
    Found,
    check_control,
    check_devices,
    check_friction,
    check_gains,
    check_inertia,
    check_motors,
    check_peak,
    check_ramp,
    check_range,
    check_springs,
    check_weight,
    check_wire,
    inverse_inertia,
)
from ..rendering.giving_way import check_compliance, check_pushes
from ..rendering.own_plant import check_own_plant, own_robot
from ..rendering.sections import ChainTwin
from ..rendering.surroundings import check_pairs
from ..rendering.tool import check_tool
from .config import DIRECTIONS, ArmConfig, PrismaticJoint, PrismaticPlant, PrismaticSum
from .machine import directions, drive_friction, joint_ratings, joint_sums
from .simulation import plant_values

FEWEST, MOST = 3, 7
"""Joints of an arm."""
SINGULAR = 1e-4
"""Smallest part of the largest singular value of the handle's Jacobian, in the coupled directions and with
lengths in metres, at which a posture counts as regular."""


def check_arm(config: ArmConfig, robot: Robot) -> Found:
    """What only the model can tell of an arm's configuration: key, problem, fix."""
    wrong = _joints(config, robot) or _frames(config, robot) or _directions(config)
    if wrong:
        return wrong
    friction = drive_friction(config)
    keys = [f"arm.joints.{name}.gear_friction" for name in config.arm.joints]
    found = check_friction(keys, (friction.gear + friction.bearing).tolist(), robot)
    found += _limits(config, robot) + _sums(config) + _boxes(config) + _posture(config)
    found += check_pairs(robot, config.look_ahead)
    found += check_compliance(config.compliance, config.arm.force_control)
    arm = config.arm
    frames = arm.frames.handle, arm.frames.sensor
    found += check_tool(arm.handle, config.devices, robot, frames, ("arm.handle", "force_torque"))
    found += check_ramp(joint_ratings(config, robot).braking, config.safety.stop_time)
    found += check_control("arm", arm.force_control, arm.twin, arm.twins, 1.0 / config.loop.rate)
    found += _devices(config, robot)
    return found or _plant(config, robot) + _gains(config, robot)


def _joints(config: ArmConfig, robot: Robot) -> Found:
    """The model's moving joints, in its order, of its kinds."""
    joints = config.arm.joints
    if not FEWEST <= robot.nv <= MOST:
        problem = f"has {robot.nv} moving joints"
        return [("model", problem, f"give a serial arm with {FEWEST} to {MOST}; fix the others")]
    for before, after in pairwise(range(1, robot.nv + 1)):
        if robot.model.parents[after] != before:
            return [("model", f"{robot.names[after - 1]} branches off", "fix the joints of other branches")]
    if list(joints) != robot.names:
        return [("arm.joints", f"has {', '.join(joints)}", f"give the model's: {', '.join(robot.names)}")]
    found: Found = []
    for (name, joint), slides in zip(joints.items(), robot.sliding, strict=True):
        if isinstance(joint, PrismaticJoint) != slides:
            kind = "prismatic" if slides else "revolute"
            found.append((f"arm.joints.{name}.type", f"the model's {name} is another", f'write "{kind}"'))
    yields = [joint.stiffness is not None for joint in joints.values()]
    if any(yields) and not all(yields):
        name = list(joints)[yields.index(False)]
        fix = "give all joints a stiffness, or none"
        found.append((f"arm.joints.{name}.stiffness", "is missing, but others have one", fix))
    if config.arm.stiffness_tolerance is not None and not any(yields):
        found.append(("arm.stiffness_tolerance", "is of no spring", "remove it, or give stiffnesses"))
    return found


def _frames(config: ArmConfig, robot: Robot) -> Found:
    """Frames that exist; handle and sensor are carried by the last joint."""
    frames, last = config.arm.frames, robot.names[-1]
    wanted = {"arm.frames.handle": frames.handle, "arm.frames.sensor": frames.sensor}
    wanted |= {f"arm.boxes[{i}].frame": box.frame for i, box in enumerate(config.arm.boxes or ())}
    found: Found = []
    for key, name in wanted.items():
        if not robot.model.existFrame(name):
            known = ", ".join(frame.name for frame in robot.model.frames[1:])
            found.append((key, f"the model lacks the frame '{name}'", f"known: {known}"))
        elif robot.model.frames[robot.frame(name)].parentJoint == 0:
            found.append((key, f"the frame '{name}' never moves", "name one behind the first joint"))
        elif (
            key.startswith("arm.frames")
            and robot.model.names[robot.model.frames[robot.frame(name)].parentJoint] != last
        ):
            found.append((key, f"'{name}' is carried by another joint", f"fix it to what {last} moves"))
    return found


def _directions(config: ArmConfig) -> Found:
    arm, chosen = config.arm, directions(config)
    key, m = "arm.directions", len(config.arm.joints)
    if sorted(set(chosen)) != list(chosen):
        return [(key, "repeats or reorders directions", f"keep the order of {', '.join(DIRECTIONS)}")]
    if len(chosen) > m:
        return [(key, f"are {len(chosen)}, the arm has {m} joints", f"name at most {m}")]
    twins = {"twin": arm.twin, **{f"twins.{name}": twin for name, twin in arm.twins.items()}}
    chains = [at for at, twin in twins.items() if isinstance(twin, ChainTwin)]
    if chains and len(chosen) < len(DIRECTIONS):
        fix = f"couple all of {', '.join(DIRECTIONS)}, or take a free mass"
        problem = f"the end of a chain moves in six directions, not {len(chosen)}"
        return [(f"arm.{at}.kind", problem, fix) for at in chains]
    if arm.force_control.detection != "gauss" and (m, len(chosen)) != (6, 6):
        problem = f"{arm.force_control.detection!r} needs six joints and six directions"
        return [("arm.force_control.detection", problem, 'write "gauss"')]
    return []


def _limits(config: ArmConfig, robot: Robot) -> Found:
    """Empty ranges and limits beyond the model's."""
    found: Found = []
    for name, joint in config.arm.joints.items():
        key = f"arm.joints.{name}"
        lower, upper = joint.range
        found += _empty(f"{key}.range", lower, upper)
        keys = f"{key}.range", f"{key}.range", f"{key}.velocity"
        found += check_range(robot, name, keys, (lower, upper, joint.velocity))
        if isinstance(joint, PrismaticJoint) and config.safety.slide_margin is None:
            found.append(("safety.slide_margin", "is missing", f"{name} slides: give a length"))
    return found


def _empty(key: str, lower: float, upper: float) -> Found:
    if lower < upper:
        return []
    return [(key, f"{lower:g} is not below {upper:g}", "every lower limit must be below its upper one")]


def _sums(config: ArmConfig) -> Found:
    """Sums of joints that exist and are of one kind."""
    found: Found = []
    joints = config.arm.joints
    for i, total in enumerate(config.arm.sums or ()):
        key = f"arm.sums[{i}]"
        found += _empty(f"{key}.range", *total.range)
        if not any(total.weights.values()):
            found.append((f"{key}.weights", "are all 0", "name joints that the sum is of"))
        for name in total.weights:
            if name not in joints:
                found.append((f"{key}.weights", f"no joint '{name}'", f"known: {', '.join(joints)}"))
            elif isinstance(joints[name], PrismaticJoint) != isinstance(total, PrismaticSum):
                fix = "sum joints of one kind, and name it in type"
                found.append((f"{key}.weights", f"'{name}' is of another kind", fix))
    return found


def _boxes(config: ArmConfig) -> Found:
    return [
        wrong
        for i, box in enumerate(config.arm.boxes or ())
        for low, high in zip(box.lower, box.upper, strict=True)
        for wrong in _empty(f"arm.boxes[{i}].lower", low, high)
    ]


def _posture(config: ArmConfig) -> Found:
    """Somewhere to be drawn to, where the handle leaves joints free, and only there."""
    arm = config.arm
    free = len(arm.joints) - len(arm.directions)
    if free and arm.posture is None:
        fix = "give stiffness and damping, and a home to every joint"
        return [("arm.posture", f"is missing: the handle leaves {free} of the joints free", fix)]
    if not free and arm.posture is not None:
        return [("arm.posture", "has nothing to decide: the handle leaves no joint free", "remove it")]
    found: Found = []
    for name, joint in arm.joints.items():
        key, (lower, upper) = f"arm.joints.{name}.home", joint.range
        if not free and joint.home is not None:
            found.append((key, "has nothing to decide: the handle leaves no joint free", "remove it"))
        if free and joint.home is None:
            found.append((key, "is missing", "say where the joint is drawn to"))
        if joint.home is not None and not lower <= joint.home <= upper:
            found.append((key, f"{joint.home:g} is outside {lower:g} to {upper:g}", "stay inside"))
    return found


def _devices(config: ArmConfig, robot: Robot) -> Found:
    """A drive for each joint by its name, sensor and safety PLC."""
    needed: dict[str, type[Device]] = {
        **{
            name: SlideDrive if isinstance(joint, PrismaticJoint) else JointDrive
            for name, joint in config.arm.joints.items()
        },
        "force_torque": ForceTorque,
        "safety_plc": SafetyPlc,
    }
    if found := check_devices(config.devices, needed, "the arm"):
        return found
    rows = zip(robot.names, robot.effort.tolist(), config.arm.joints.values(), strict=True)
    for name, effort, joint in rows:
        drive = config.devices[name]
        assert isinstance(drive, TorqueDrive)
        unit = "N" if isinstance(joint, PrismaticJoint) else "N m"
        found += check_wire(name, MOST_PERMILLE * drive.rated, effort, unit)
        found += check_peak(name, drive, effort, config.arm.force_control)
        if isinstance(drive, SlideDrive):
            found += _counts(name, drive, joint.range)
    return found


def _counts(name: str, drive: SlideDrive, limits: Sequence[float]) -> Found:
    """Encoders that leave their 32 bits within a sliding joint's range."""
    motor, shaft = drive.gear_ratio
    turns = max(map(abs, limits)) / drive.lead
    found: Found = []
    for key, counts in (
        ("counts_per_turn", drive.counts_per_turn * motor / shaft),
        ("link_counts_per_turn", float(drive.link_counts_per_turn)),
    ):
        if not turns * counts < 2**31:
            problem = f"{turns:g} turns of the spindle leave 32 bits"
            found.append((f"devices.{name}.{key}", problem, "lower it, or take a longer lead"))
    return found


def _gains(config: ArmConfig, robot: Robot) -> Found:
    """Motor-side gains beside the inertia that they move: the rotors', or all of it where nothing yields."""
    joints, dt = config.arm.joints, 1.0 / config.loop.rate
    rotor, p, d = (
        np.array([getattr(joint, key) for joint in joints.values()], float)
        for key in ("rotor_inertia", "p_gain", "d_gain")
    )
    if all(joint.stiffness is None for joint in joints.values()):
        inverse = _whole(robot, _typical(config), rotor)
        return check_gains({"arm.joints": (fastest(inverse, p), fastest(inverse, d))}, dt)
    spring = np.array([joint.stiffness or 0.0 for joint in joints.values()])
    motors = (np.array([p, d, spring]) / rotor).T.tolist()
    keys = [f"arm.joints.{name}.d_gain" for name in joints]
    return check_motors(dict(zip(keys, map(tuple, motors), strict=True)), dt)


def _whole(robot: Robot, q: Array, rotor: Array) -> Array:
    """Inverse inertia of rotors and links that move as one, (m, m)."""
    inverse: Array = np.linalg.inv(np.linalg.inv(inverse_inertia(robot, q)) + np.diag(rotor))
    return inverse


def _typical(config: ArmConfig) -> Array:
    """A posture at which inertias are judged: where the plant begins, or between the limits."""
    if config.simulation is not None:
        return np.array([joint.start for joint in config.simulation.arm.joints.values()], float)
    ranges = [np.clip(joint.range, -np.pi, np.pi) for joint in config.arm.joints.values()]
    return np.array([(low + high) / 2.0 for low, high in ranges])


def _plant(config: ArmConfig, robot: Robot) -> Found:
    """A plant that begins inside its limits, at rest, where the handle can move as it should."""
    if config.simulation is None:
        return []
    plant = config.simulation.arm
    yields = any(joint.stiffness is not None for joint in config.arm.joints.values())
    if wrong := _plant_joints(config) + check_own_plant(config.simulation.plant, robot.nv, yields):
        return wrong
    own = own_robot(robot, robot.names, config.simulation.plant)
    key = "simulation.arm"
    found = check_inertia(f"{key}.handle_inertia", plant.handle_inertia)
    q = _typical(config)
    found += _begins(config, robot, q)
    found += check_pushes(robot, config.simulation.pushes or ())
    brakes = [joint.brake for joint in plant.joints.values()]
    found += check_weight(own, q, brakes, [f"{key}.joints.{name}.brake" for name in plant.joints])
    rotor, stiffness, friction = plant_values(config, robot)
    damping = np.array([joint.spring_damping or 0.0 for joint in plant.joints.values()], float)
    dt = 1.0 / config.loop.rate
    if stiffness.any():
        springs = rotor, stiffness, damping
        found += check_springs(f"{key}.substeps", own, q, springs, friction, plant.substeps, dt)
    elif not integrates(0.0, fastest(_whole(own, q, rotor), friction), dt / plant.substeps):
        problem = f"{plant.substeps} are too few for the friction in steps of {dt / plant.substeps:g} s"
        found.append((f"{key}.substeps", problem, "give more, or less friction"))
    hand = config.simulation.hand
    turning = (hand.torque, hand.rotational_stiffness, hand.rotational_damping)
    if any(value is None for value in turning) and any(value is not None for value in turning):
        fix = "give torque, rotational_stiffness and rotational_damping, or none of them"
        found.append(("simulation.hand", "turns the handle by halves", fix))
    return found


def _plant_joints(config: ArmConfig) -> Found:
    """The same joints as the controller's, of the same kinds; springs where it has springs."""
    assert config.simulation is not None
    joints, own = config.arm.joints, config.simulation.arm.joints
    if list(own) != list(joints):
        fix = f"give the controller's: {', '.join(joints)}"
        return [("simulation.arm.joints", f"has {', '.join(own)}", fix)]
    found: Found = []
    for name, joint in joints.items():
        key = f"simulation.arm.joints.{name}"
        if isinstance(joint, PrismaticJoint) != isinstance(own[name], PrismaticPlant):
            found.append((f"{key}.type", f"{name} is another", "write that of arm.joints"))
        yields = joint.stiffness is not None
        if yields != (own[name].spring_damping is not None):
            fix = "give it" if yields else "remove it, or give the joint a stiffness"
            problem = "is missing" if yields else "damps no spring"
            found.append((f"{key}.spring_damping", problem, fix))
        if own[name].stiffness is not None and not yields:
            found.append((f"{key}.stiffness", "is of no spring", "remove it, or give the joint a stiffness"))
    return found


def _begins(config: ArmConfig, robot: Robot, q: Array) -> Found:
    """Inside all limits, in a posture in which all coupled directions can be moved."""
    arm, found = config.arm, []
    for (name, joint), place in zip(arm.joints.items(), q.tolist(), strict=True):
        found += _inside(f"simulation.arm.joints.{name}.start", name, place, joint.range)
    for total, weights in zip(arm.sums or (), joint_sums(config), strict=True):
        found += _inside("simulation.arm.joints", total.name, float(np.dot(weights.weight, q)), total.range)
    for box in arm.boxes or ():
        place = robot.placement(q, box.frame)[:3, 3].tolist()
        for axis, x, low, high in zip("xyz", place, box.lower, box.upper, strict=True):
            found += _inside("simulation.arm.joints", f"{box.frame} {axis}", x, (low, high))
    frame = robot.frame(arm.frames.handle)
    J = pin.computeFrameJacobian(
        robot.model, robot.data, robot.configuration(q), frame, pin.LOCAL_WORLD_ALIGNED
    )
    values = np.linalg.svd(J[list(directions(config))], compute_uv=False)
    if values[-1] < SINGULAR * values[0]:
        problem = "in the initial posture the handle cannot move in all of them"
        fix = "name fewer, or begin in another posture"
        found.append(("arm.directions", problem, fix))
    return found


def _inside(key: str, name: str, place: float, limits: Sequence[float]) -> Found:
    low, high = limits
    if low <= place <= high:
        return []
    return [(key, f"{place:g} of {name} is outside {low:g} to {high:g}", "begin inside the limits")]
