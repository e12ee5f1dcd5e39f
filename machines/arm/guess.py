"""Numbers for an arm of which only a description is known: what it can do, and a controller in proportion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, inf, isfinite, pi

import numpy as np
import pinocchio as pin

from ...models import Array, Robot
from ...runtime.core.sampling import fastest
from .ability import Look, best_directions, best_home, free_reach
from .config import DIRECTIONS
from .description import GRIP_LENGTH, Description
from .errors import InitError
from .urdf_write import write_urdf

SAMPLES = 300
"""Postures at which the arm is looked at."""
STOP_TIME = 0.5
MARGIN = {False: 0.03, True: 0.01}
"""Behind the controller's limits, of joints that turn [rad] and that slide [m]."""
SPEED, SLIDE_SPEED = 2.0, 0.8
"""Nobody leads an arm faster [rad/s, m/s]."""
ACCELERATION, SLIDE_ACCELERATION = 60.0, 30.0
BRAKING = 0.75 * STOP_TIME
"""In this time a joint stops from full speed [s]."""
EFFORT_SHARE = 0.9
"""Share of the largest torque that motion and gravity together may take."""
FRICTION_SHARE = 0.2
"""The same of viscous friction at full speed."""
HOLD = 1.3
"""Least effort beside the largest weight that a joint has to hold."""
HAND_SHARE = 0.25
"""Share of the largest torque that the hand may take beside them."""
HAND_FORCE, HAND_TORQUE = 20.0, 1.0
"""Strength of a gentle hand [N, N m]."""
STRONGEST, FASTEST = {False: 2000.0, True: 20e3}, {False: 100.0, True: 20.0}
"""Efforts and speeds beyond these are slips of the pen: turning [N m, rad/s], sliding [N, m/s]."""
LEAST_FORCE, LEAST_TORQUE = 0.1, 0.001
"""Of a hand that leads anything [N, N m]."""
LEAST_EFFORT, LEAST_SPEED = 0.1, 0.01
UNKNOWN_SPEED = {False: 2.0, True: 0.5}
ROTOR_SHARE = 0.3
"""A rotor's inertia beside that of what its joint moves, where nobody knows better."""
BANDWIDTH, LEAST_BANDWIDTH, DAMPING = 63.0, 20.0, 0.95
"""Of the joints' gains on the least inertia that a joint may move; the least that leads anything [rad/s]."""
MOST_P, MOST_D = {False: 1e6, True: 1e6}, {False: 1e4, True: 1e5}
"""Gains beyond these are slips of the pen: turning [N m/rad, N m s/rad], sliding [N/m, N s/m]."""
SHRINK = 0.9
PERIOD = 1e-3
MOST_SUBSTEPS = 64


@dataclass(frozen=True, slots=True)
class Guess:
    """A controller and a plant for an arm; one entry a joint where it is a list.

    Attributes:
        arm: its description, with efforts and speeds that it can live with.
        urdf: its text.
        sliding: which joints slide.
        lower, upper, velocity, acceleration: limits of the controller.
        rotor, p_gain, d_gain: of the drives.
        home: posture in which it begins, far from limits and singularities.
        directions: numbers 0 to 5 of those that the twin moves in.
        mass, inertia: of the twin.
        box: corners (3,) of the handle's range, infinite in directions that are not coupled.
        force, torque: of the hand; no torque where it cannot turn the handle as it wants.
        scales: full scales of the force-torque sensor [N, N m].
        path: times, places (3,) and rotation vectors (3,) of the hand.
        touches: sides of the box that it pulls the handle to, by their directions.
        brake: torques.
        substeps: of the plant in a period of PERIOD.
    """

    arm: Description
    urdf: str
    sliding: list[bool]
    lower: list[float]
    upper: list[float]
    velocity: list[float]
    acceleration: list[float]
    rotor: list[float]
    p_gain: list[float]
    d_gain: list[float]
    home: list[float]
    directions: tuple[int, ...]
    mass: float
    inertia: float
    box: tuple[list[float], list[float]]
    force: float
    torque: float | None
    scales: tuple[float, float]
    path: list[tuple[float, list[float], list[float]]]
    touches: dict[int, str]
    brake: list[float]
    substeps: int


def guess(arm: Description) -> Guess:
    """A controller in proportion to an arm, and a hand that pulls at it gently.

    Raises:
        InitError: the arm is too heavy to be held, or too weak to be led.
        ModelError: the description has what no machine that a person holds may have.
    """
    arm = _ranges(_speeds(arm))
    robot = _robot(replace(arm, joints={k: replace(joint, effort=1.0) for k, joint in arm.joints.items()}))
    lower, upper = _own_limits(robot)
    postures = _postures(lower, upper)
    looked = [Look(robot, q) for q in postures]
    gravity = np.max([np.abs(look.gravity) for look in looked], axis=0)
    typical = np.median([np.diag(look.M) for look in looked], axis=0)
    arm = _efforts(arm, gravity, typical, _gentle(robot, looked))
    robot = _robot(arm)
    scale = max(float(np.linalg.norm(look.place)) for look in looked) / 3.0
    chosen = best_directions(looked, scale)
    if len(chosen) < 6:
        words = ", ".join(DIRECTIONS[i] for i in chosen)
        arm.remarks.append(f"the twin moves in the directions {words}: those that the joints can give")
    home = best_home(looked, postures, lower, upper, chosen, scale)
    rotor, stiff = _inertias(looked, robot)
    p_gain, d_gain = _gains(arm, stiff)
    force, torque = _hand(arm, robot, looked, chosen)
    scales = _scales(force, torque, arm.handle)
    velocity = _velocities(robot)
    pulled = np.max([_load(look, force, torque or 0.0) for look in looked], axis=0)
    acceleration = _accelerations(robot, looked, rotor, gravity + robot.damping * velocity + pulled)
    velocity = np.minimum(velocity, BRAKING * acceleration)
    there = Look(robot, home)
    mass, inertia = _twin(there, chosen)
    reach = free_reach(robot, home, lower, upper, chosen, scale)
    box = _box(there.place, reach, chosen)
    leg = max(LEG, 1.5 * _slowest(there, chosen, reach, (velocity, acceleration), (force / mass, 2.0)))
    arm.remarks.append(
        f"the sensor is for at most {scales[0]:g} N and {scales[1]:g} N m: a stronger hand stops the machine"
    )
    arm.remarks.append("joints are taken to be rigid; drives, sensors and gains are guessed in proportion")
    if any(i < 3 for i in chosen):
        arm.remarks.append(f"a box keeps the handle within {1e3 * reach:.0f} mm of where it begins")
    return Guess(
        arm=arm,
        urdf=write_urdf(arm),
        sliding=robot.sliding,
        lower=lower.tolist(),
        upper=upper.tolist(),
        velocity=velocity.tolist(),
        acceleration=acceleration.tolist(),
        rotor=rotor.tolist(),
        p_gain=p_gain.tolist(),
        d_gain=d_gain.tolist(),
        home=home.tolist(),
        directions=chosen,
        mass=mass,
        inertia=inertia,
        box=box,
        force=force,
        torque=torque,
        scales=scales,
        path=_path(there.place, reach, chosen, torque is not None, leg),
        touches={i: side for i, side in zip(chosen, ("upper", "lower", "upper"), strict=False) if i < 3},
        brake=[
            min(1.5 * effort, STRONGEST[slides])
            for effort, slides in zip(robot.effort.tolist(), robot.sliding, strict=True)
        ],
        substeps=_substeps(robot, looked, rotor),
    )


def _robot(arm: Description) -> Robot:
    return Robot.from_urdf(write_urdf(arm), f"{arm.name}.urdf")


def _slides(kind: str) -> bool:
    return kind == "prismatic"


def _ranges(arm: Description) -> Description:
    """Sliding joints end somewhere; what turns further than a full turn either way turns without end."""
    joints = {}
    for name, joint in arm.joints.items():
        if _slides(joint.kind) and not (isfinite(joint.lower) and isfinite(joint.upper)):
            arm.remarks.append(f"'{name}' slides without end: guessed -0.5 m to 0.5 m")
            joint = replace(joint, lower=-0.5, upper=0.5)
        elif joint.kind == "revolute" and max(-joint.lower, joint.upper) > 2.0 * pi:
            why = "turns further than a full turn" if isfinite(joint.lower) else "has no limits"
            arm.remarks.append(f"'{name}' {why}: taken to be continuous")
            joint = replace(joint, kind="continuous", lower=-inf, upper=inf)
        joints[name] = joint
    return replace(arm, joints=joints)


def _speeds(arm: Description) -> Description:
    """Speeds and efforts that a machine may have; 0 means that nothing is known."""
    joints, unknown = {}, []
    for name, joint in arm.joints.items():
        slides = _slides(joint.kind)
        velocity = min(joint.velocity, FASTEST[slides])
        if velocity < LEAST_SPEED:
            velocity = UNKNOWN_SPEED[slides]
            unknown.append(name)
        effort = min(max(joint.effort, 0.0), STRONGEST[slides])
        joints[name] = replace(joint, velocity=velocity, effort=effort)
    if unknown:
        arm.remarks.append(f"no speed is given of {', '.join(unknown)}: guessed 2 rad/s, or 0.5 m/s")
    return replace(arm, joints=joints)


def _own_limits(robot: Robot) -> tuple[Array, Array]:
    """The model's, less a margin on both sides."""
    width = robot.upper - robot.lower
    margin = np.minimum([MARGIN[slides] for slides in robot.sliding], 0.05 * width)
    margin[~np.isfinite(width)] = 0.0
    return robot.lower + margin, robot.upper - margin


def _postures(lower: Array, upper: Array) -> Array:
    """Within the limits, or half a turn either way, (SAMPLES, m); always the same."""
    random = np.random.default_rng(1)
    low, high = np.maximum(lower, -pi), np.minimum(upper, pi)
    low, high = np.where(low < high, low, lower), np.where(low < high, high, upper)
    return random.uniform(low, high, (SAMPLES, len(lower)))


def _gentle(robot: Robot, looked: Sequence[Look]) -> Array:
    """Torques of drives that bear a gentle hand, no stronger than the arm's weight, beside it, (m,)."""
    share = min(1.0, pin.computeTotalMass(robot.model) * 9.81 / HAND_FORCE)
    push, twist = _levers(looked)
    bears: Array = share * (HAND_FORCE * push + HAND_TORQUE * twist) / HAND_SHARE
    return bears


def _levers(looked: Sequence[Look]) -> tuple[Array, Array]:
    """Largest torques against 1 N, and 1 N m, along all axes at once, (m,) each."""
    push: Array = np.max([np.abs(look.J[:3]).sum(axis=0) for look in looked], axis=0)
    twist: Array = np.max([np.abs(look.J[3:]).sum(axis=0) for look in looked], axis=0)
    return push, twist


def _efforts(arm: Description, gravity: Array, inertia: Array, gentle: Array) -> Description:
    """Torques that can hold the arm wherever it is, and move it, from what that takes at most, (m,) each.

    Where nobody knows better, the hand has its part.
    """
    joints, unknown, raised = {}, [], []
    rows = zip(arm.joints.items(), gravity.tolist(), inertia.tolist(), gentle.tolist(), strict=True)
    for (name, joint), weight, M, hand in rows:
        most = STRONGEST[_slides(joint.kind)]
        if (hold := HOLD * weight) > most:
            unit = "N" if _slides(joint.kind) else "N m"
            raise InitError(
                f"{arm.source}: the joint '{joint.written}' carries too much: it needs {hold:.3g} {unit} to "
                f"hold the arm, at most {most:g} {unit} are possible; the arm is too heavy or too large, or "
                "its masses or lengths are in another unit than kg and m"
            )
        effort = joint.effort
        if effort == 0.0:
            effort = min(max(2.0 * weight + 15.0 * M + hand, LEAST_EFFORT), most)
            unknown.append(name)
        elif effort < (needed := min(HOLD * weight + 3.0 * M, most)):
            effort = min(1.2 * needed, most)
            raised.append(f"'{name}' from {joint.effort:g} to {float(f'{effort:.2g}'):g}")
        joints[name] = replace(joint, effort=float(f"{effort:.2g}") if effort != joint.effort else effort)
    if unknown:
        arm.remarks.append(f"no effort is given of {', '.join(unknown)}: guessed from arm and hand")
    if raised:
        arm.remarks.append(f"efforts that hardly hold the arm are raised: {', '.join(raised)}")
    return replace(arm, joints=joints)


def _inertias(looked: Sequence[Look], robot: Robot) -> tuple[Array, Array]:
    """Inertia of the rotors, and the least that each joint may have to move, (m,) each."""
    typical = np.median([np.diag(look.M) for look in looked], axis=0)
    rotor = np.maximum(ROTOR_SHARE * typical, 1e-3 * np.minimum(robot.effort, 100.0))
    least = [1.0 / np.diag(np.linalg.inv(look.M + np.diag(rotor))) for look in looked]
    stiff: Array = np.min(least, axis=0)
    return rotor, stiff


def _gains(arm: Description, stiff: Array) -> tuple[Array, Array]:
    """Position and velocity gains, (m,) each, of one bandwidth for the least inertias (m,) that joints move.

    Raises:
        InitError: no drive has gains that lead such inertias.
    """
    w = BANDWIDTH
    for joint, moved in zip(arm.joints.values(), stiff.tolist(), strict=True):
        slides = _slides(joint.kind)
        possible = min((MOST_P[slides] / moved) ** 0.5, MOST_D[slides] / (2.0 * DAMPING * moved))
        if possible < LEAST_BANDWIDTH:
            most = min(
                MOST_P[slides] / LEAST_BANDWIDTH**2, MOST_D[slides] / (2.0 * DAMPING * LEAST_BANDWIDTH)
            )
            unit = "kg" if slides else "kg m^2"
            raise InitError(
                f"{arm.source}: the joint '{joint.written}' moves too much: {moved:.3g} {unit} and more, of "
                f"which a drive can lead {most:.3g} {unit}; the arm is too heavy or too large, or its "
                "masses or lengths are in another unit than kg and m"
            )
        w = min(w, possible)
    return w * w * stiff, 2.0 * DAMPING * w * stiff


def _velocities(robot: Robot) -> Array:
    """As fast as a hand leads joints, and as their friction lets them be driven."""
    most = np.array([SLIDE_SPEED if slides else SPEED for slides in robot.sliding])
    driven = FRICTION_SHARE * robot.effort / np.maximum(robot.damping, 1e-9)
    slowest: Array = np.minimum(np.minimum(robot.velocity, most), driven)
    return slowest


def _load(look: Look, force: float, torque: float) -> Array:
    """Torques against the worst force and torque of the hand, (m,)."""
    load: Array = force * np.linalg.norm(look.J[:3], axis=0) + torque * np.linalg.norm(look.J[3:], axis=0)
    return load


def _accelerations(robot: Robot, looked: Sequence[Look], rotor: Array, other: Array) -> Array:
    """All joints at once within the efforts, beside the other torques (m,) that they have to give."""
    load = np.max([np.abs(look.M + np.diag(rotor)) for look in looked], axis=0)
    left = np.maximum(EFFORT_SHARE * robot.effort - other, 0.1 * robot.effort)
    most = np.array([SLIDE_ACCELERATION if slides else ACCELERATION for slides in robot.sliding])
    wanted = np.minimum(left / (2.0 * np.diag(load)), most)
    for _ in range(200):
        taken = load @ wanted / left
        if taken.max() <= 1.0:
            break
        i = int(np.argmax(taken))
        wanted *= np.where(load[i] * wanted > 0.1 * left[i], SHRINK, 1.0)
    least: Array = np.maximum(wanted, 0.5)
    return least


def _inverse(M: Array) -> Array:
    return np.array(np.linalg.inv(M), float)


def _substeps(robot: Robot, looked: Sequence[Look], rotor: Array) -> int:
    """As many as keep the friction of the joints well inside what symplectic Euler integrates."""
    worst = max(fastest(_inverse(look.M + np.diag(rotor)), robot.damping) for look in looked)
    return int(min(max(1, ceil(PERIOD * worst)), MOST_SUBSTEPS))


def _twin(look: Look, chosen: Sequence[int]) -> tuple[float, float]:
    """Mass and inertia about half as large as what the handle is felt to have at home without control."""
    felt = np.linalg.inv(look.J @ np.linalg.inv(look.M) @ look.J.T + 1e-6 * np.eye(6))
    along = [felt[i, i] for i in chosen if i < 3]
    about = [felt[i, i] for i in chosen if i >= 3]
    mass = float(np.clip(0.5 * min(along, default=2.0), 1.0, 8.0))
    inertia = float(np.clip(0.5 * min(about, default=0.05), 0.01 * mass, 0.04 * mass))
    return float(f"{mass:.2g}"), float(f"{inertia:.2g}")


def _box(place: Array, reach: float, chosen: Sequence[int]) -> tuple[list[float], list[float]]:
    lower = [place[i] - reach if i in chosen else -inf for i in range(3)]
    upper = [place[i] + reach if i in chosen else inf for i in range(3)]
    return [float(f"{x:.5f}") for x in lower], [float(f"{x:.5f}") for x in upper]


def _hand(
    arm: Description, robot: Robot, looked: Sequence[Look], chosen: Sequence[int]
) -> tuple[float, float | None]:
    """A force and a torque that leave most of every drive's effort alone."""
    push, twist = _levers(looked)
    left = HAND_SHARE * robot.effort
    bears = left / np.maximum(push, 1e-9)
    force = min(HAND_FORCE, float(np.min(bears)))
    if force < LEAST_FORCE:
        weakest = int(np.argmin(bears))
        joint, unit = list(arm.joints.values())[weakest], "N" if robot.sliding[weakest] else "N m"
        raise InitError(
            f"{arm.source}: the joint '{joint.written}' is too weak: with {joint.effort:g} {unit} it bears "
            f"{force:.2g} N at the handle beside the arm itself, and no hand leads anything with less than "
            f"{LEAST_FORCE:g} N; the arm is too small, or its efforts are wrong"
        )
    torque = min(HAND_TORQUE, float(np.min(left / np.maximum(twist, 1e-9))))
    others = [i for i in range(3, 6) if i not in chosen]
    loose = any(np.abs(look.J[others]).max() > 1e-6 for look in looked) if others else False
    turns = any(i >= 3 for i in chosen) and not loose and torque >= LEAST_TORQUE
    return float(f"{force:.2g}"), float(f"{torque:.2g}") if turns else None


def _scales(force: float, torque: float | None, handle: float) -> tuple[float, float]:
    """Full scales of a sensor for ten times the hand, and three times what the handle weighs.

    It is as small as it may be: larger ones drift by what a weak arm is led with.
    """
    forces = max(10.0 * force, 3.0 * 9.81 * handle)
    torques = max(10.0 * (torque or 0.0), 0.5 * GRIP_LENGTH * forces)
    return float(f"{forces:.2g}"), float(f"{torques:.2g}")


def _slowest(
    look: Look,
    chosen: Sequence[int],
    reach: float,
    joints: tuple[Array, Array],
    hand: tuple[float, float],
) -> float:
    """How long the handle takes to a side of the box at most [s].

    Args:
        look: at home.
        chosen: directions.
        reach: to the sides.
        joints: largest velocities and accelerations.
        hand: acceleration that it gives the twin, and the twin's damping over its mass.
    """
    inverse = np.linalg.pinv(look.J[list(chosen)])
    longest = 0.0
    for k, _ in enumerate(i for i in chosen if i < 3):
        share = np.maximum(np.abs(inverse[:, k]), 1e-9)
        a = min(hand[0], float(np.min(joints[1] / share)))
        v = min(hand[0] / hand[1], float(np.min(joints[0] / share)))
        longest = max(longest, reach / v + v / a)
    return longest


WAIT, PULL, LEG = 3.4, 0.06, 1.1
"""How long the hand waits for the machine [s], pulls beyond the box [m], and takes for a way at least [s]."""


def _path(
    place: Array, reach: float, chosen: Sequence[int], turns: bool, leg: float
) -> list[tuple[float, list[float], list[float]]]:
    """Out of the box on one side after the other and back; a little turn where the handle can be turned."""
    along, about = [i for i in chosen if i < 3], [i for i in chosen if i >= 3]
    start, none, t = [float(f"{x:.5f}") for x in place], [0.0, 0.0, 0.0], WAIT
    path = [(0.0, start, none), (t, start, none)]
    legs = max(leg, (reach + PULL) / 0.25)
    for k, i in enumerate(along):
        out = list(start)
        out[i] = float(f"{out[i] + (-1) ** k * (reach + PULL):.5f}")
        path += [(t + legs, out, none), (t + legs + 0.4, out, none), (t + 2.0 * legs + 0.4, start, none)]
        t += 2.0 * legs + 0.6
        path.append((t, start, none))
    if turns:
        turned = [0.25 if i + 3 == about[-1] else 0.0 for i in range(3)]
        path += [(t + 0.8, start, turned), (t + 1.6, start, none), (t + 1.8, start, none)]
    return [(float(f"{at:.3f}"), where, how) for at, where, how in path]
