"""The twin that a configuration describes: a free mass, or a serial chain."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pinocchio as pin

from ...control.chain_twin import ChainTwin, Detent, Lock, Mechanism
from ...control.limits import Limits
from ...control.twin import CartesianTwin, Twin
from ...models import Array, DhRow, ModelError, Robot
from ...models.dh_robot import END, Body, from_dh
from ...runtime.core.machine import LimitSpec
from ...runtime.core.modes import MOST_TWINS
from ...runtime.core.sampling import controls
from ..telemanipulation.arm import PALM, chain_of
from . import sections as s

SIX = tuple(range(6))
UP_TO_SPEED_S = 0.1
"""How long a joint takes to its full speed where no acceleration is given."""
MOST_JOINTS = 7
LIGHTEST = 1e-4
"""Least eigenvalue of the inertia matrix at the start that a controller can follow [kg m^2 or kg]."""
FOLLOWED, DAMPED = 2.0 * np.pi * 16.0, 0.3
"""Rate at which machines swing on their springs [rad/s]; damping ratio with which a twin of 28 Hz is calm."""
POSTURES = 50
"""In which it is looked how much a chain's end weighs."""
Found = list[tuple[str, str, str]]
"""Key, problem and fix of everything that is wrong."""


def twin_of(section: s.Twin, directions: tuple[int, ...] = SIX) -> Twin:
    """The twin of a section; a free mass moves in these directions.

    Raises:
        ModelError: its URDF is refused.
        ValueError: limits that no joint can have.
    """
    if isinstance(section, s.ChainTwin):
        return chain_twin(section)
    return CartesianTwin(
        section.mass,
        section.inertia,
        section.damping,
        section.rotational_damping,
        (section.velocity, section.rotational_velocity),
        (section.acceleration, section.rotational_acceleration),
        directions,
    )


def degrees_of_freedom(section: s.Twin, directions: tuple[int, ...] = SIX) -> int:
    """How many joints, or directions, a twin moves in."""
    return len(section.joints) if isinstance(section, s.ChainTwin) else len(directions)


def joint_labels(twins: Mapping[str, s.Twin]) -> tuple[str, ...]:
    """The joints of all twins, one after the other: a free mass has none.

    Those of the first go by their own names, the others' have the name of their twin before them.
    """
    return tuple(
        f"{name}_{joint}" if i else joint
        for i, (name, section) in enumerate(twins.items())
        for joint in (section.joints if isinstance(section, s.ChainTwin) else ())
    )


def end_of(section: s.ChainTwin) -> str:
    """The frame that the handle follows."""
    return PALM if section.arm is not None else section.end or END


def chain_twin(section: s.ChainTwin) -> ChainTwin:
    """A serial chain.

    Raises:
        ModelError: its URDF is refused, or has no such frame.
        ValueError: limits that no joint can have.
    """
    robot = robot_of(section)
    roll, pitch, yaw = section.base or (0.0, 0.0, 0.0)
    turned = pin.rpy.rpyToMatrix(roll, pitch, yaw)
    return ChainTwin(robot, end_of(section), mechanism_of(section, robot), turned, section.gravity)


def robot_of(section: s.ChainTwin) -> Robot:
    """The links of a chain, with what is added at its end.

    Raises:
        ModelError: its URDF is refused, or has other joints, or no such frame.
    """
    robot = _links(section)
    mass, inertia = added(section)
    if mass or inertia:
        model = robot.model
        end = model.frames[robot.frame(end_of(section))]
        body = pin.Inertia(mass, np.zeros(3), inertia * np.eye(3))
        model.inertias[end.parentJoint] += end.placement.act(body)
    return robot


def added(section: s.ChainTwin) -> tuple[float, float]:
    """Mass and inertia that a chain needs at its end, so that a stiff hand does not make it swing.

    Sampled over the ranges of its joints: what is lightest at the start may be lighter elsewhere.

    Returns:
        [kg], [kg m^2]; 0 where it is heavy enough.

    Raises:
        ModelError: see ``robot_of``.
    """
    robot = _links(section)
    lower, upper, *_ = limits_of(section, robot)
    # what is infinite at the wrong end is refused later, and sampled before
    lower, upper = np.clip(lower, -np.pi, np.pi), np.clip(upper, -np.pi, np.pi)
    frame, own = robot.frame(end_of(section)), [joint.inertia or 0.0 for joint in section.joints.values()]
    postures = np.random.default_rng(0).uniform(lower, np.maximum(lower, upper), (POSTURES, robot.nv))
    postures[0] = [joint.start for joint in section.joints.values()]
    lightest = np.full(2, np.inf)
    for q in postures:
        at = robot.configuration(q)
        M = pin.crba(robot.model, robot.data, at)
        M = np.triu(M) + np.triu(M, 1).T + np.diag(own)
        J = pin.computeFrameJacobian(robot.model, robot.data, at, frame, pin.LOCAL).reshape(6, robot.nv)
        if np.linalg.eigvalsh(M)[0] <= LIGHTEST:
            return 0.0, 0.0  # refused anyway
        mobility = J @ np.linalg.solve(M, J.T)
        for i, part in enumerate((slice(0, 3), slice(3, 6))):
            freest = float(np.linalg.eigvalsh(mobility[part, part])[-1])
            lightest[i] = min(lightest[i], 1.0 / freest if freest > 0.0 else np.inf)
    missing = np.array([section.least_mass, section.least_inertia]) - lightest
    mass, inertia = np.maximum(missing, 0.0).tolist()
    return mass, inertia


def remarks(twins: Mapping[str, s.Twin]) -> list[str]:
    """What people should know of twins that are fine."""
    found = []
    for name, section in twins.items():
        if not isinstance(section, s.ChainTwin):
            continue
        which = "the twin" if len(twins) == 1 else f"the twin {name}"
        mass, inertia = added(section)
        if mass or inertia:
            found.append(
                f"the end of {which} would be lighter than a machine can render: {mass:.2g} kg and"
                f" {inertia:.2g} kg m^2 are added there (least_mass, least_inertia)"
            )
        found += [
            f"joint {joint} of {which} swings on its spring with {rate / (2.0 * np.pi):.0f} Hz, faster than a"
            " machine of some 16 Hz follows: it may tremble, and more and more; give it less stiffness, more"
            " inertia, or damping"
            for joint, rate in swinging(section)
        ]
    return found


def swinging(section: s.ChainTwin) -> list[tuple[str, float]]:
    """Joints that swing on their springs faster than a machine follows, at the start: names, [rad/s]."""
    twin = chain_twin(section)
    twin.update(np.zeros(6))
    found = []
    for name, joint, free, damping in _free(twin, section):
        rate = ((joint.stiffness or 0.0) * free) ** 0.5
        if rate > FOLLOWED and damping * free < 2.0 * DAMPED * rate:
            found.append((name, rate))
    return found


def _links(section: s.ChainTwin) -> Robot:
    names = list(section.joints)
    if section.urdf is None:
        bodies = [Body(*_body(joint.body)) for joint in section.joints.values()]
        return from_dh([_row(name, joint) for name, joint in section.joints.items()], bodies)
    assert section.kept is not None, "whoever loads a configuration keeps the model of its twin"
    robot = Robot.from_urdf(section.kept.urdf, section.urdf)
    if section.arm is not None:
        robot = chain_of(robot, section.arm)
    if names != robot.names:
        problem = f"its joints are {', '.join(robot.names)}"
        raise ModelError(section.urdf, 0, problem, f"the twin's are {', '.join(names)}: let them agree")
    return robot


def limits_of(section: s.ChainTwin, robot: Robot) -> tuple[Array, Array, Array, Array]:
    """Lower, upper, velocity and acceleration limits, (n,) each; the model's where the section is silent."""
    rows = []
    for i, joint in enumerate(section.joints.values()):
        lower, upper = joint.range or (robot.lower[i], robot.upper[i])
        velocity = joint.velocity or robot.velocity[i]
        rows.append((lower, upper, velocity, joint.acceleration or velocity / UP_TO_SPEED_S))
    lower, upper, velocity, acceleration = np.array(rows, float).T.copy()
    return lower, upper, velocity, acceleration


def twin_limits(twins: Mapping[str, s.Twin]) -> list[LimitSpec]:
    """Position limits of the chains' joints, for a session that touches them; see ``joint_labels``."""
    rows = [
        (joint, low, high)
        for section in twins.values()
        if isinstance(section, s.ChainTwin)
        for joint, low, high in _ranges(section)
    ]
    return [
        LimitSpec(f"twin {name.replace('_', ' ')}", low, high, "rad" if _turns(joint) else "m")
        for name, (joint, low, high) in zip(joint_labels(twins), rows, strict=True)
    ]


def _ranges(section: s.ChainTwin) -> list[tuple[s.TwinJoint, float, float]]:
    lower, upper, *_ = limits_of(section, robot_of(section))
    return list(zip(section.joints.values(), lower.tolist(), upper.tolist(), strict=True))


def _turns(joint: s.TwinJoint) -> bool:
    return isinstance(joint, s.RevoluteTwinJoint)


def mechanism_of(section: s.ChainTwin, robot: Robot) -> Mechanism:
    """What drives the joints of a chain."""
    joints, names = list(section.joints.values()), list(section.joints)

    def of_each(key: str) -> Array:
        return np.array([getattr(joint, key) or 0.0 for joint in joints], float)

    damping = [robot.damping[i] if joint.damping is None else joint.damping for i, joint in enumerate(joints)]
    return Mechanism(
        Limits(*limits_of(section, robot)),
        start=of_each("start"),
        inertia=of_each("inertia"),
        damping=np.array(damping, float),
        drive=of_each("drive"),
        stiffness=of_each("stiffness"),
        rest=of_each("rest"),
        detents=[
            Detent(i, detent.at, detent.torque, detent.width)
            for i, joint in enumerate(joints)
            for detent in joint.detents or ()
        ],
        locks=[
            Lock(i, names.index(joint.lock.key), joint.lock.unlock, joint.lock.relock)
            for i, joint in enumerate(joints)
            if joint.lock
        ],
    )


def _row(name: str, joint: s.TwinJoint) -> DhRow:
    row = joint.dh or s.Row()
    kind = "revolute" if _turns(joint) else "prismatic"
    return DhRow(name, kind, row.theta, row.d, row.a, row.alpha)  # type: ignore[arg-type]


def _body(body: s.Body | None) -> tuple[float, Sequence[float], Sequence[float]]:
    return (body.mass, body.centre, body.moments) if body else (0.0, (0.0,) * 3, (0.0,) * 3)


def check_twins(key: str, first: s.Twin, others: s.Twins, dt: float) -> Found:
    """What is wrong with the twins of a machine, whose sections are below a key, at a period dt [s]."""
    found = check_twin(f"{key}.twin", first, dt)
    twins = s.named_twins(first, others)
    for name, twin in others.items():
        at = f"{key}.twins.{name}"
        if twins[name] is not twin:
            found.append((at, "is also the name of the twin of the start", f"give {key}.twin a name"))
        if twin.name not in (None, name):
            found.append((f"{at}.name", f"'{twin.name}' is not the name of its table", "remove it"))
        found += check_twin(at, twin, dt)
    if len(twins) > MOST_TWINS:
        found.append((f"{key}.twins", f"with the first they are {len(twins)}", f"give {MOST_TWINS} at most"))
    labels = joint_labels(twins)
    if twice := [label for label in dict.fromkeys(labels) if labels.count(label) > 1]:
        found.append((f"{key}.twins", f"two joints would be called {twice[0]}", "rename one of them"))
    return found


def check_twin(key: str, section: s.Twin, dt: float) -> Found:
    """What is wrong with a twin at a key of the configuration, at a period dt [s]."""
    if isinstance(section, s.ChainTwin):
        return _keys(key, section) or _chain(key, section, dt)
    pairs = (
        (f"{key}.damping", section.damping / section.mass),
        (f"{key}.rotational_damping", section.rotational_damping / section.inertia),
    )
    return [_too_fast(name, dt) for name, rate in pairs if not controls(0.0, rate, dt)]


def _too_fast(key: str, dt: float) -> tuple[str, str, str]:
    problem = f"with its spring and its inertia it acts faster than one period of {dt:g} s"
    return key, problem, "lower the gains, or raise the rate"


def _keys(key: str, section: s.ChainTwin) -> Found:
    """Keys that do not go together."""
    joints = section.joints
    if not 1 <= len(joints) <= MOST_JOINTS:
        return [(f"{key}.joints", f"are {len(joints)}", f"give 1 to {MOST_JOINTS}")]
    if section.arm is not None and (section.urdf is None or section.end is not None):
        problem = (
            "is an arm of a URDF, but there is none" if section.urdf is None else "has its own end, its palm"
        )
        return [(f"{key}.arm", problem, f"remove {'arm' if section.urdf is None else 'end'}")]
    if section.urdf is None and section.end is not None:
        return [
            (f"{key}.end", "names a frame, but there is no URDF", "remove it: a table ends at its last row")
        ]
    if section.urdf is not None and section.end is None and section.arm is None:
        return [(f"{key}.end", "is missing", "name the frame of the URDF that the handle follows")]
    found: Found = []
    for name, joint in joints.items():
        at = f"{key}.joints.{name}"
        for own in ("dh", "body"):
            if section.urdf is not None and getattr(joint, own) is not None:
                found.append((f"{at}.{own}", "is also in the URDF", "remove it"))
        for own in ("range", "velocity"):
            if section.urdf is None and getattr(joint, own) is None:
                found.append((f"{at}.{own}", "is missing", "a Denavit-Hartenberg table has none"))
        if joint.lock:
            found += _lock(f"{at}.lock.key", joint.lock.key, name, joints)
    return found


def _lock(at: str, key: str, name: str, joints: dict[str, s.TwinJoint]) -> Found:
    others = [other for other in joints if other != name]
    if key not in others:
        mend = f"known: {', '.join(others)}" if others else "give the chain another joint"
        return [(at, f"no other joint '{key}'", mend)]
    if not _turns(joints[key]):
        return [(at, f"'{key}' slides", "let the key be a joint that turns")]
    return []


def _chain(key: str, section: s.ChainTwin, dt: float) -> Found:
    try:
        robot = robot_of(section)
        lower, upper, _velocity, _ = limits_of(section, robot)
        found: Found = []
        if robot.model.frames[robot.frame(end_of(section))].parentJoint == 0:
            found.append((f"{key}.end", "stands: no joint moves it", "name a frame behind the joints"))
        for i, (name, joint) in enumerate(section.joints.items()):
            at = f"{key}.joints.{name}"
            if robot.sliding[i] == _turns(joint):
                found.append((f"{at}.type", "the URDF says otherwise", "let them agree"))
            if not lower[i] < upper[i]:
                problem = f"{lower[i]:g} is not below {upper[i]:g}"
                found.append((f"{at}.range", problem, "every lower limit must be below its upper one"))
            elif not lower[i] <= joint.start <= upper[i]:
                problem = f"{joint.start:g} is outside {lower[i]:g} to {upper[i]:g}"
                found.append((f"{at}.start", problem, "begin inside the limits"))
            if joint.lock and not np.isfinite(lower[i]):
                found.append(
                    (f"{at}.lock", "the joint has no lower limit", "a lock holds it there: give one")
                )
        return found or _inertia(key, section, dt)
    except ModelError as error:
        return [(key, str(found), "") for found in error.findings]
    except ValueError as error:
        return [(key, str(error), "")]


def _free(twin: ChainTwin, section: s.ChainTwin) -> Iterator[tuple[str, s.TwinJoint, float, float]]:
    """Of each joint: its name, what the configuration says, acceleration for a unit of torque, damping."""
    mobility = np.diag(np.linalg.inv(twin.M)).tolist()
    return zip(section.joints, section.joints.values(), mobility, twin.damping.tolist(), strict=True)


def _inertia(key: str, section: s.ChainTwin, dt: float) -> Found:
    """Inertia that is too light, springs and dampers that are too fast for it, at the start."""
    twin = chain_twin(section)
    twin.update(np.zeros(6))
    least = float(np.linalg.eigvalsh((twin.M + twin.M.T) / 2.0)[0])
    if not least > LIGHTEST:
        problem = f"at the start some motion of the chain has an inertia of {least:.3g} kg m^2"
        return [(f"{key}.joints", problem, "give every joint an inertia, or its link a body")]
    found: Found = []
    for name, joint, free, damping in _free(twin, section):
        stiffest = max(
            [joint.stiffness or 0.0, *(np.e**0.5 * d.torque / d.width for d in joint.detents or ())]
        )
        if not controls(stiffest * free, damping * free, dt):
            found.append(_too_fast(f"{key}.joints.{name}", dt))
    return found
