"""Random redundant interfaces: chains of two to seven joints, as somebody would describe one of their own.

Joints turn or slide, in a plane or in space, with weight or without; motors drive them through gears, racks
and belts. Most can be built; some are singular where they begin or too weak for their weight, and a machine
must say so before it starts.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import hypot, pi
from random import Random

import numpy as np
import pinocchio as pin

from ..machines.rhi.guard import STOP
from ..models import Array, Robot
from ..runtime.configuration.config import Loaded, parse
from .temper import Temper

FEWEST, MOST = 2, 7
"""Joints."""
PLANES = {"flat": ("x", "y"), "upright": ("x", "z"), "space": ("x", "y", "z")}
"""Where a chain moves; on a flat table it has no weight."""
ALL = ("x", "y", "z", "rx", "ry", "rz")
SLIDING, BELTED = 0.25, 0.3
"""Share of joints that slide; of those that turn, whose motor stands at the joint before."""
WEAK = 0.08
"""Share of the chains with weight that have a motor which is too weak for it."""
TOO_WEAK, SLIGHT = (0.3, 1.1), 0.1
"""Torque of such a motor over what the weight takes at most; what takes less counts as none [N m]."""
SQUARE = 0.3
"""Share of the chains with as many directions as joints, where there are not more joints than directions."""
LENGTH, MASS = (0.1, 0.45), (0.03, 0.6)
"""Of the links [m], [kg]."""
THICKNESS = 0.02
"""Of the links, which are rods [m]."""
SQUARE_ANGLES = 0.7
"""Share of the angles in space that are multiples of 90 degrees, as in most machines."""
TORQUE = (1.0, 30.0)
"""Of the joints' motors, before the weight [N m], at a lever of ARM also of those that slide [N]."""
ARM = 0.3
CARRIES = (1.4, 4.0)
"""Torque of a motor over what the weight takes at most."""
SWING = 28.0
"""Of a motor on the spring that holds it [rad/s]."""
FRICTION = (0.3, 10.0)
"""Of a motor over its rotor's inertia [1/s]."""
MARGIN = 0.15
"""That targets keep to the limits [rad]."""
LEAST_TIME = 0.012
"""Period over 2 pi of a motor on its end stop, at the least [s]."""
LIVELY = 20.0
"""Least acceleration of a motor without weight [rad/s^2]."""
RAMP_S = 0.4
"""Longest time in which a motor brakes from its top speed [s]."""
BRAKES_S = 0.16
"""In about so long a motor brakes from its top speed where its load is worst [s]."""
PULL = 3.0
"""Of the pull on the posture, over the torque of the weakest motor, which has to brake what it moves."""
RAMP_SHARE = 0.8
"""Of the stop time, in which a motor alone must come to rest."""
COUNTS = (1024, 4096, 20_000, 65_536, 1_048_576)
"""Of motors' encoders a turn; a shaft's have 4096 and more."""
POSTURES, FEW = 1500, 50
"""Random ones in which the weight is looked up, and of these those for the inertia."""
STRONG = 0.6
"""Of what the weakest posture of many can press with, in any direction, the strongest hand."""


@dataclass(slots=True)
class Joint:
    """A joint, the link that it moves, and its motor.

    Attributes:
        slides: or it turns; axis: of it, in the frame that ``turn`` gives (3,).
        reach: of the link before it [m]; turn: against that (3,) [rad].
        length, mass: of its own link [m], [kg].
        ratio: way of the joint over that of its motor [1, or m/rad].
        lower, upper: of the motor [rad]; speed: of the motor [rad/s].
        belted: whether its motor stands at the joint before and turns it against that.
    """

    slides: bool
    axis: Sequence[float]
    turn: Sequence[float]
    length: float
    mass: float
    ratio: float
    lower: float
    upper: float
    speed: float
    belted: bool
    reach: float = 0.0


@dataclass(slots=True)
class Motors:
    """What the numbers of all motors follow from, one entry each."""

    torque: Array
    rotor: Array
    inertia: Array
    friction: Array
    speed: Array
    acceleration: Array
    brake: Array


def random_interface(seed: int, joints: int | None = None, directions: int | None = None) -> Loaded:
    """The configuration of a seed, with so many joints and directions if they are given; not checked.

    Raises:
        ConfigError: the reader refuses it.
    """
    random = Random(f"interface {seed}")
    n = joints or random.randint(FEWEST, MOST)
    plane = random.choice(list(PLANES))
    if directions and directions > len(PLANES[plane]):
        plane = "space"
    task = _task(random, plane, n, directions)
    chain = [_joint(random, plane) for _ in range(n)]
    chain[0].belted = False
    for before, joint in pairwise(chain):
        joint.reach = before.length
        joint.belted &= not (joint.slides or before.slides)
    model = f"own_{seed}.urdf"
    T = _transmission(chain)
    robot = Robot.from_urdf(_urdf(f"own_{seed}", chain, T, np.ones(n)), model)
    motors = _motors(random, chain, robot, T)
    text = _urdf(f"own_{seed}", chain, T, motors.torque)
    own = Interface(model, task, chain, motors, Robot.from_urdf(text, model), T)
    toml = "\n".join(_toml(random, own)) + "\n"
    source = f"own_{seed}.toml"
    return Loaded(source, parse(toml, source), toml, source, text, model)


def gentle(loaded: Loaded) -> Temper:
    """Hands that are not stronger than the motors of an interface."""
    simulation = loaded.config.simulation
    assert simulation is not None
    force = float(simulation.hand.force)
    return Temper(force, 0.1 * force, 0.5)


def _task(random: Random, plane: str, n: int, directions: int | None) -> tuple[str, ...]:
    axes = PLANES[plane]
    most = min(n, len(axes))
    count = directions or (most if random.random() < SQUARE else random.randint(1, most))
    if directions == 6 or (directions is None and plane == "space" and n == 6 and random.random() < SQUARE):
        return ALL
    if directions is None and plane == "space" and n == 7 and random.random() < SQUARE:
        return ALL
    return tuple(sorted(random.sample(axes, count)))


def _between(random: Random, ends: Sequence[float]) -> float:
    """Every octave is as likely as the others."""
    low, high = ends
    return float(low * (high / low) ** random.random())


def _angle(random: Random) -> float:
    if random.random() < SQUARE_ANGLES:
        return random.choice((-0.5, 0.0, 0.5)) * pi
    return random.uniform(-pi / 2, pi / 2)


def _joint(random: Random, plane: str) -> Joint:
    slides = random.random() < SLIDING
    rest = random.uniform(-1.5, 1.5)
    if plane == "space":
        axis, turn = (0.0, 0.0, 1.0), [_angle(random) for _ in range(3)]
    elif plane == "flat":
        axis, turn = (0.0, 0.0, 1.0), [0.0, 0.0, rest]
    else:
        axis, turn = (0.0, 1.0, 0.0), [0.0, rest, 0.0]
    if slides:
        axis = (1.0, 0.0, 0.0)
    travel = random.uniform(0.2, 0.8) if slides else random.uniform(1.5, 4.5)
    ratio = travel / random.uniform(2.5, 8.0) if slides else random.choice((1.0, 1.0, random.uniform(0.4, 2)))
    middle, half = random.uniform(-0.3, 0.3), 0.5 * travel / ratio
    speed = random.uniform(0.6, 1.5) / ratio if slides else random.uniform(3.0, 12.0) / ratio
    return Joint(
        slides,
        axis,
        turn,
        random.uniform(*LENGTH),
        _between(random, MASS),
        ratio,
        middle - half,
        middle + half,
        speed,
        random.random() < BELTED,
    )


def _transmission(chain: Sequence[Joint]) -> Array:
    """Joints from motors, (n, n): a belted motor gives the angle of its link against the one before that."""
    T = np.diag([joint.ratio for joint in chain])
    for i, joint in enumerate(chain):
        if joint.belted:
            T[i, i - 1] = -chain[i - 1].ratio
    return T


def _loads(random: Random, chain: Sequence[Joint], robot: Robot, T: Array) -> tuple[Array, Array]:
    """Largest weight of the chain, and inertia of its links, that each motor meets, (n,) each."""
    rng = np.random.default_rng(random.getrandbits(32))
    postures = rng.uniform(*_ends(chain), (POSTURES, len(chain)))
    weight, inertia = np.zeros(len(chain)), np.zeros(len(chain))
    for q in postures:
        at = robot.configuration(T @ q)
        weight = np.maximum(weight, np.abs(T.T @ pin.computeGeneralizedGravity(robot.model, robot.data, at)))
    for q in postures[:FEW]:
        links = pin.crba(robot.model, robot.data, robot.configuration(T @ q))
        inertia = np.maximum(inertia, np.diag(T.T @ (np.triu(links) + np.triu(links, 1).T) @ T))
    return weight, inertia


def _motors(random: Random, chain: Sequence[Joint], robot: Robot, T: Array) -> Motors:
    """Torques that carry the weight, mostly; rotors, friction and speeds to suit."""
    n, (weight, links) = len(chain), _loads(random, chain, robot, T)
    share = np.array([_between(random, CARRIES) for _ in chain])
    loaded = [i for i, most in enumerate(weight.tolist()) if most > SLIGHT]
    if random.random() < WEAK and loaded:
        share[random.choice(loaded)] = random.uniform(*TOO_WEAK)
    own = [_between(random, TORQUE) * joint.ratio * (1.0 / ARM if joint.slides else 1.0) for joint in chain]
    strong = np.maximum(np.maximum(share * weight, own), LIVELY * links)
    torque = np.where(share < CARRIES[0], share * weight, strong)
    rotor = np.array([random.uniform(0.1, 1.0) for _ in range(n)]) * np.minimum(links, 2.0)
    rotor = np.maximum(rotor, torque / (STOP * MARGIN) * LEAST_TIME**2)
    inertia = links + rotor
    fastest = np.array([joint.speed for joint in chain])
    acceleration = np.minimum(0.5 * torque / inertia, fastest / 0.04)
    able = np.minimum(RAMP_S * acceleration, BRAKES_S * np.abs(torque - weight) / inertia)
    friction = rotor * np.array([_between(random, FRICTION) for _ in chain])
    brake = 3.0 * torque + 2.0 * weight
    return Motors(torque, rotor, inertia, friction, np.minimum(fastest, able), acceleration, brake)


def _ends(chain: Sequence[Joint]) -> tuple[list[float], list[float]]:
    return [joint.lower for joint in chain], [joint.upper for joint in chain]


def _urdf(name: str, chain: Sequence[Joint], T: Array, torque: Array) -> str:
    """Joints whose limits are those of the motors, wherever they are."""
    robot = ET.Element("robot", name=name)
    ET.SubElement(robot, "link", name="base")
    lower, upper = (np.array(ends) for ends in _ends(chain))
    middle, half = T @ (lower + upper) / 2.0, np.abs(T) @ (upper - lower) / 2.0 * 1.001
    effort = np.abs(np.linalg.inv(T).T) @ torque * 1.01
    speed = np.abs(T) @ np.array([joint.speed for joint in chain]) * 1.01
    before = "base"
    for i, link in enumerate(chain, 1):
        body = ET.SubElement(ET.SubElement(robot, "link", name=f"link_{i}"), "inertial")
        ET.SubElement(body, "origin", xyz=f"{link.length / 2:.6f} 0 0", rpy="0 0 0")
        ET.SubElement(body, "mass", value=f"{link.mass:.6f}")
        along = link.mass * THICKNESS**2 / 6.0
        across = link.mass * (link.length**2 + THICKNESS**2) / 12.0
        moments = {"ixx": along, "ixy": 0.0, "ixz": 0.0, "iyy": across, "iyz": 0.0, "izz": across}
        ET.SubElement(body, "inertia", {key: f"{value:.9f}" for key, value in moments.items()})
        kind = "prismatic" if link.slides else "revolute"
        joint = ET.SubElement(robot, "joint", name=f"joint_{i}", type=kind)
        ET.SubElement(joint, "origin", xyz=f"{link.reach:.6f} 0 0", rpy=_row(link.turn))
        ET.SubElement(joint, "parent", link=before)
        ET.SubElement(joint, "child", link=f"link_{i}")
        ET.SubElement(joint, "axis", xyz=_row(link.axis))
        k = i - 1
        ET.SubElement(
            joint,
            "limit",
            effort=f"{effort[k]:.6f}",
            velocity=f"{speed[k]:.6f}",
            lower=f"{middle[k] - half[k]:.6f}",
            upper=f"{middle[k] + half[k]:.6f}",
        )
        ET.SubElement(joint, "dynamics", damping="0")
        before = f"link_{i}"
    ET.SubElement(robot, "link", name="handle")
    mount = ET.SubElement(robot, "joint", name="handle_mount", type="fixed")
    ET.SubElement(mount, "origin", xyz=f"{chain[-1].length:.6f} 0 0", rpy="0 0 0")
    ET.SubElement(mount, "parent", link=before)
    ET.SubElement(mount, "child", link="handle")
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _row(values: Sequence[float] | Array) -> str:
    return " ".join(f"{x:.6g}" for x in values)


@dataclass(frozen=True, slots=True)
class Interface:
    """All that the text of a configuration is made of."""

    model: str
    task: Sequence[str]
    chain: Sequence[Joint]
    motors: Motors
    robot: Robot
    T: Array


def _toml(random: Random, own: Interface) -> Iterator[str]:
    """Lines after configs/rhi.toml."""
    home, posture = _posture(random, own.chain), _posture(random, own.chain)
    ellipsoid = _pressing(own, home)
    motors = own.motors
    stop = float((motors.speed / motors.acceleration).max()) / RAMP_SHARE * 1.3 + 0.03
    spread = random.choice((3, 5))
    yield from ('system = "rhi"', f'model = "{own.model}"')
    yield from ("[loop]", 'rate = "1 kHz"', 'duration = "5 s"', 'on_overrun = "record"')
    yield from ("[bus]", 'kind = "simulated"', "[arming]", 'by = "dead-man"', 'fade = "3 s"')
    yield from ("[safety]", 'position_margin = "50 mrad"', f'stop_time = "{stop:.3f} s"')
    yield from _devices(random, own)
    yield from _motor_lines(own)
    yield from ("[rhi.task]", 'frame = "handle"', f"directions = {list(own.task)}".replace("'", '"'))
    yield from (f'home = "{_row(home)} rad"', f"spread = {spread}")
    yield from _law(random, own, min(0.4 / max(spread * float(ellipsoid[-1]), 1e-6), 10.0))
    hand = own.robot.placement(own.T @ np.array(posture), "handle")[:3, 3]
    yield from _wall(random, [hand[ALL.index(axis)] for axis in own.task[:3]])
    stiff = motors.inertia * SWING**2
    yield from ("[rhi.hold]", f'stiffness = "{_row(stiff)} N m/rad"')
    yield f'damping = "{_row(1.6 * motors.inertia * SWING)} N m s/rad"'
    yield from _simulation(random, own, posture)
    yield from _hand(own, hand, STRONG * max(float(ellipsoid[0]), 0.0) ** 0.5)


def _posture(random: Random, chain: Sequence[Joint]) -> list[float]:
    """Not next to a limit."""
    rows = zip(*_ends(chain), strict=True)
    return [random.uniform(a + 0.2 * (b - a), b - 0.2 * (b - a)) for a, b in rows]


def _devices(random: Random, own: Interface) -> Iterator[str]:
    n = len(own.chain)
    for i, torque in enumerate(own.motors.torque.tolist(), 1):
        gear = random.choice((1, 8, 10, 50, 100, 160))
        counts = random.choice([c for c in COUNTS if c * gear >= 4096])
        yield from (f"[devices.motor_{i}]", 'type = "joint_drive"', f"node = {i}")
        yield from (f"counts_per_turn = {counts}", f"gear_ratio = [{gear}, 1]")
        yield f"link_counts_per_turn = {random.choice((4096, 20_000, 1_048_576))}"
        yield f'rated_torque = "{max(torque / random.uniform(1, 20), 1e-3):.3f} N m"'
    yield from ("[devices.force_torque]", 'type = "force_torque"', f"node = {n + 1}")
    yield from ('force = "500 N"', 'torque = "50 N m"')
    yield from ("[devices.safety_plc]", 'type = "safety_plc"', f"node = {n + 2}")


def _motor_lines(own: Interface) -> Iterator[str]:
    motors, (lower, upper) = own.motors, _ends(own.chain)
    yield from ("[rhi.motors]", f"transmission = {[[float(f'{x:.6g}') for x in row] for row in own.T]}")
    yield f'rotor_inertia = "{_row(motors.rotor)} kg m^2"'
    yield f'friction = "{_row(motors.friction)} N m s/rad"'
    yield f'torque = "{_row(motors.torque)} N m"'
    yield from (f'lower = "{_row(lower)} rad"', f'upper = "{_row(upper)} rad"')
    yield f'velocity = "{_row(motors.speed)} rad/s"'
    yield f'acceleration = "{_row(motors.acceleration)} rad/s^2"'


def _law(random: Random, own: Interface, rho: float) -> Iterator[str]:
    motors, mean = own.motors, float(np.mean(own.motors.torque))
    cap = min(0.7 * mean, PULL * float(motors.torque.min()))
    yield from ("[rhi.null_space]", f'resolution = "{random.choice(("projection", "hqp"))}"')
    yield f'step = "{2 * mean:.4g} N m"'
    yield f'damping = "{0.05 * float(motors.inertia.min()):.4g} N m s/rad"'
    yield from (f'cap = "{cap:.4g} N m"', "scan = 800", f'stiffness = "{2.0 * mean:.4g} N m/rad"')
    yield from ("ratio = 0.35", f'margin = "{MARGIN} rad"')
    yield from ("[rhi.saturation]", "steepness = 1", "leave = 0.7", "come_back = 0.95", f"rho = {rho:.4g}")
    yield from ("held = 0.85", f'moving = "{mean:.4g} N m"', 'release = "50 ms"')


def _wall(random: Random, place: Sequence[float]) -> Iterator[str]:
    normal = [random.gauss(0.0, 1.0) for _ in place]
    ahead = [x + 0.02 * u / max(hypot(*normal), 1e-3) for x, u in zip(place, normal, strict=True)]
    yield from ("[rhi.bodies.wall]", 'kind = "plane"', f'point = "{_row(ahead)} m"')
    yield from (f"normal = [{', '.join(f'{u:.4f}' for u in normal)}]", 'stiffness = "1000 N/m"')


def _simulation(random: Random, own: Interface, posture: Sequence[float]) -> Iterator[str]:
    motors = own.motors
    yield from ("[simulation]", f"seed = {random.randint(1, 1000)}")
    yield from ("[simulation.rhi]", f'posture = "{_row(posture)} rad"')
    yield f'friction = "{_row(motors.friction)} N m s/rad"'
    yield from (f'brake_torque = "{_row(motors.brake)} N m"', 'force_noise = "0.02 N"', "substeps = 4")


def _hand(own: Interface, place: Array, force: float) -> Iterator[str]:
    yield from ("[simulation.hand]", 'stiffness = "2000 N/m"', 'damping = "30 N s/m"')
    yield f'force = "{min(max(force, 1.0), 60.0):.3f} N"'
    if len(own.task) > len(PLANES["space"]):
        yield from ('rotational_stiffness = "20 N m/rad"', 'rotational_damping = "1 N m s/rad"')
        yield 'torque = "5 N m"'
    yield 'dead_man = [{ at = "0.3 s", pressed = true }]'
    for at in (0, 5):
        yield from ("[[simulation.hand.path]]", f'at = "{at} s"', f'position = "{_row(place)} m"')


def _pressing(own: Interface, q: Sequence[float]) -> Array:
    """Eigenvalues of the force ellipsoid in a posture (n,), ascending, (m,); turns at 10 cm."""
    robot, frame = own.robot, own.robot.frame("handle")
    pin.computeJointJacobians(robot.model, robot.data, robot.configuration(own.T @ np.array(q)))
    pin.updateFramePlacements(robot.model, robot.data)
    whole = pin.getFrameJacobian(robot.model, robot.data, frame, pin.LOCAL_WORLD_ALIGNED) @ own.T
    J = np.array([whole[ALL.index(axis)] * (1.0 if axis in ALL[:3] else 0.1) for axis in own.task])
    weighted = J / own.motors.torque
    ellipsoid = np.linalg.pinv(weighted @ weighted.T, rcond=1e-9, hermitian=True)
    found: Array = np.asarray(np.linalg.eigvalsh(ellipsoid), float)
    return found
