"""Beyond the papers: random motions of machines that could meet themselves and what is around them.

Where the machine truly is judges, by coal on the shapes of its URDF, not where it believes to be. A halt
counts as justified where the same session without the look-ahead comes to a contact.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import count
from math import inf
from random import Random
from typing import Any

import coal
import msgspec
import numpy as np
import pinocchio as pin

from ..configs.quantities import AngleLimits6, AnyAngle, AnyLength, Lengths3, Sizes3
from ..control.look_ahead import Body, Box, standing
from ..machines.arm.machine import foreseen_limits as arm_limits
from ..machines.giant.config import GiantConfig
from ..machines.giant.parts import foreseen_limits as giant_limits
from ..machines.rendering.sections import LookAhead as Section
from ..machines.rendering.sections import Obstacle
from ..machines.rendering.surroundings import obstacles, watched
from ..models import Array, Robot
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.configuration.system import Stance, find_system
from ..runtime.core.modes import RENDERING, Mode
from ..runtime.live.lockstep import Lockstep, unswept
from .own_plant import Doubt
from .random_hand import stranger
from .temper import Temper

SECONDS, BEGINS = 4.5, 0.8
"""Of a motion, and when its hand begins to move: the machine still engages [s]."""
MEETS = (0.3, 0.9)
"""When the hand wants to be where something stands, as shares of its motion."""
LATER = 1.5
"""A motion that nothing halts goes on so much longer: what halts at its end would touch after it [s]."""
AFTER = 0.3
"""So long a halted machine is watched, whose hand goes on pulling [s]."""
LEAVES = 4
"""The knot of a stranger's path up to which the hand stays where it is."""
CLEAR = 0.08
"""Nothing begins nearer than that to anything [m]."""
NEAR = 0.03
"""What is nearer is judged by coal, and in every tick [m]."""
FASTEST = 10.0
"""Nothing here comes nearer faster [m/s]: what is far away is looked at again when it could be near."""
FOLDING = 2.8
"""How far the giant's joints 2 and 3 turn here, either way [rad]."""
LEG = 0.7
"""How far from where it began a hand wants to lead an arm, in each direction [m]."""
TOWARDS, AWAY = ("halted", "too late", "missed"), ("free", "kept away", "halted for nothing")
"""What becomes of motions with and without a contact where nothing halts; one that never began is neither."""


class Truth:
    """How near a machine truly is to itself and its surroundings."""

    def __init__(self, robot: Robot, loaded: Loaded, section: Section, limits: tuple[Array, Array]) -> None:
        self._robot = robot
        self._data = robot.model.createData()
        self._geometry = pin.buildGeomFromUrdfString(
            robot.model, loaded.model_text, pin.GeometryType.COLLISION
        )
        self._placed = self._geometry.createData()
        found, always = watched(robot, section, limits)
        self._quick = standing(robot, found, section.margin)
        together = {frozenset((first.name, second.name)) for first, second in always}
        shapes = list(self._geometry.geometryObjects)
        links = [robot.model.frames[shape.parentFrame].name for shape in shapes]
        self._pairs = [
            (i, j)
            for i in range(len(shapes))
            for j in range(i)
            if abs(shapes[i].parentJoint - shapes[j].parentJoint) > 1
            and frozenset((links[i], links[j])) not in together
        ]
        around = [(body.name, _solid(body)) for body in obstacles(section)]
        self._around = [
            (i, solid)
            for i, shape in enumerate(shapes)
            for name, solid in around
            if shape.parentJoint > 0 and frozenset((links[i], name)) not in together
        ]

    def near(self, q: Array) -> float:
        """Least distance at joints (n,) [m]; coal's, where it is small."""
        least = float(self._quick.distances(q).min())
        return self._least(q) if least < NEAR else least

    def _least(self, q: Array) -> float:
        configuration = self._robot.configuration(q)
        pin.updateGeometryPlacements(
            self._robot.model, self._data, self._geometry, self._placed, configuration
        )
        shapes, at = self._geometry.geometryObjects, self._placed.oMg
        solids = [
            (shape.geometry, coal.Transform3s(M.rotation, M.translation))
            for shape, M in zip(shapes, at, strict=True)
        ]
        own = [_distance(solids[i], solids[j]) for i, j in self._pairs]
        return min(own + [_distance(solids[i], solid) for i, solid in self._around])


def _solid(body: Body) -> tuple[Any, Any]:
    if isinstance(body, Box):
        return coal.Box(*(2.0 * body.half)), coal.Transform3s(body.axes, body.centre)
    normal, point = body.normal, body.point  # type: ignore[union-attr]
    return coal.Halfspace(normal, float(normal @ point)), coal.Transform3s()


def _distance(first: tuple[Any, Any], second: tuple[Any, Any]) -> float:
    return float(coal.distance(*first, *second, coal.DistanceRequest(), coal.DistanceResult()))


@dataclass(frozen=True, slots=True)
class Motion:
    """What became of a motion.

    Attributes:
        stop: reason of the stop, "" for none; at: when [s]; detail: for people.
        began: whether the machine followed the hand at all.
        least: smallest true distance until then, and while it stood after a halt [m].
        contact: when something touched first [s], infinite where nothing did.
    """

    stop: str
    at: float
    detail: str
    began: bool
    least: float
    contact: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """A motion, and the same without the look-ahead where that halted it.

    Attributes:
        seed: of all that is random in it.
        margin: of the look-ahead [m].
        ahead, without: the same motion twice.
    """

    seed: int
    margin: float
    ahead: Motion
    without: Motion | None

    @property
    def kind(self) -> str:
        """What it says of the look-ahead."""
        ahead, without = self.ahead, self.without
        if without is None:
            if not ahead.began:
                return "never began"
            if ahead.contact < inf:
                return "missed"
            return "other stop" if ahead.stop else "free"
        if ahead.contact < inf:
            return "too late"
        if without.contact < inf:
            return "halted"
        return "kept away" if without.least < self.margin else "halted for nothing"


def judge(loaded: Loaded, seed: int) -> Verdict:
    """A random motion in random surroundings, of a machine that is not as its controller believes.

    Raises:
        ChildProcessError: what went on without the halt told nothing of it.
    """
    drawn, truth = draw(loaded, seed)
    config: Any = drawn.config
    ahead, without = run(drawn, truth, SECONDS)
    return Verdict(seed, float(config.look_ahead.margin), ahead, without)


def draw(loaded: Loaded, seed: int) -> tuple[Loaded, Truth]:
    """A machine without the limits that keep it from collisions, where nothing is near yet."""
    course = GiantCourse() if isinstance(loaded.config, GiantConfig) else ArmCourse()
    free = course.free(loaded)
    robot = Robot.from_urdf(free.model_text, free.model_source)
    random = Random(f"surroundings {seed}")
    for k in count():
        led: Any = stranger(free.config, course.system, robot, 1000 * seed + k, SECONDS, Temper())
        section = _surroundings(led, course.room(led), random, towards=seed % 2 == 1)
        surrounded = msgspec.structs.replace(led, look_ahead=section)
        truth = Truth(robot, free, section, course.limits(surrounded, robot))
        if truth.near(course.first(surrounded)) > CLEAR:
            break
    varied = Doubt(model=True, errors=course.errors).vary(_hastened(surrounded), seed)
    return replace(free, config=varied), truth


def _surroundings(config: Any, room: Room, random: Random, towards: bool) -> Section:
    """A floor that the handle may reach or not, and a few boxes; one stands where the hand wants to go."""
    low, high, floor = room
    places = [
        [random.uniform(*ends) for ends in zip(low, high, strict=True)] for _ in range(random.randint(1, 3))
    ]
    if towards:
        places[0] = _led(config.simulation.hand.path, (SECONDS - BEGINS) * random.uniform(*MEETS))
    boxes = tuple(
        Obstacle(f"box {i + 1}", Lengths3(place), Sizes3([random.uniform(0.1, 0.6) for _ in range(3)]))
        for i, place in enumerate(places)
    )
    return Section(config.look_ahead.margin, AnyLength(random.uniform(*floor)), boxes)


def _led(path: Sequence[Any], after: float) -> list[float]:
    """Where a hand wants to be so long after it has begun, (3,) [m]."""
    times, places = [p.at - path[LEAVES].at for p in path], np.array([p.position for p in path])
    return [float(np.interp(after, times, way)) for way in places.T]


def _hastened(config: Any) -> Any:
    """The hand begins while the machine still engages, and is at rest before."""
    simulation = config.simulation
    path = simulation.hand.path
    earlier = path[LEAVES].at - BEGINS
    moved = [path[0], *(msgspec.structs.replace(p, at=p.at - earlier) for p in path[1:])]
    hand = msgspec.structs.replace(simulation.hand, path=tuple(moved))
    return msgspec.structs.replace(config, simulation=msgspec.structs.replace(simulation, hand=hand))


Room = tuple[Sequence[float], Sequence[float], tuple[float, float]]
"""Where boxes stand, (3,) each [m], and the heights between which the floor lies [m]."""


class GiantCourse:
    """Other boxes for the handle; joints 2 and 3 turn far enough for the arm to fold onto itself."""

    system, errors = find_system("giant"), True

    def free(self, loaded: Loaded) -> Loaded:
        """Without the limits that keep it from collisions."""
        text = loaded.model_text
        for found in ('lower="0.45" upper="2.4"', 'lower="-2.2" upper="1.2"'):
            text = text.replace(found, f'lower="{-FOLDING}" upper="{FOLDING}"')
        config: Any = loaded.config
        m = config.giant.manipulator
        lower, upper = list(m.lower), list(m.upper)
        lower[1:3], upper[1:3] = (-FOLDING, -FOLDING), (FOLDING, FOLDING)
        manipulator = msgspec.structs.replace(m, lower=AngleLimits6(lower), upper=AngleLimits6(upper))
        box = msgspec.structs.replace(
            config.giant.box, lower=Lengths3([-2.6, -3.0, -1.28]), upper=Lengths3([2.6, 3.0, -0.7])
        )
        giant = msgspec.structs.replace(config.giant, manipulator=manipulator, box=box)
        return replace(loaded, model_text=text, config=msgspec.structs.replace(config, giant=giant))

    def room(self, config: Any) -> Room:
        """Everywhere below the gantry; the handle reaches down to -1.3 m."""
        low, high = config.giant.box.lower, config.giant.box.upper
        return (*low[:2], -1.4), (*high[:2], -0.2), (-1.5, -1.15)

    def limits(self, config: Any, robot: Robot) -> tuple[Array, Array]:
        """Lower and upper ones, (8,) each."""
        return giant_limits(config)

    def first(self, config: Any) -> Array:
        """Where it begins, (8,)."""
        giant = config.simulation.giant
        return np.array([*giant.ppu, *giant.posture])


class ArmCourse:
    """No boxes and no sums; it begins anywhere within its joints' limits.

    Its sensors are true: what is typical of the giant's contradicts itself at an arm's weak joints.
    """

    system, errors = replace(find_system("arm"), stance=lambda *given: _arm_stance(*given)), False

    def free(self, loaded: Loaded) -> Loaded:
        """Without the limits that keep it from collisions."""
        config: Any = loaded.config
        arm = msgspec.structs.replace(config.arm, boxes=None, sums=None)
        return replace(loaded, config=msgspec.structs.replace(config, arm=arm))

    def room(self, config: Any) -> Room:
        """Around it, within its reach."""
        return (-0.8, -0.8, 0.0), (0.8, 0.8, 1.0), (-0.1, 0.0)

    def limits(self, config: Any, robot: Robot) -> tuple[Array, Array]:
        """Lower and upper ones, (m,) each."""
        return arm_limits(config, robot)

    def first(self, config: Any) -> Array:
        """Where it begins, (m,)."""
        return np.array([joint.start for joint in config.simulation.arm.joints.values()])


def _arm_stance(config: Any, robot: Robot, random: Random) -> Stance[Any]:
    """Well within the limits; the hand wants to go anywhere within LEG of there."""
    ranges = (joint.range for joint in config.arm.joints.values())
    q = np.array([random.uniform(0.85 * a + 0.15 * b, 0.15 * a + 0.85 * b) for a, b in ranges])
    simulation = config.simulation
    joints = {
        name: msgspec.structs.replace(joint, start=AnyAngle(at))
        for (name, joint), at in zip(simulation.arm.joints.items(), q.tolist(), strict=True)
    }
    plant = msgspec.structs.replace(simulation.arm, joints=joints)
    begun = msgspec.structs.replace(config, simulation=msgspec.structs.replace(simulation, arm=plant))
    place = robot.placement(q, config.arm.frames.handle)[:3, 3]
    return Stance(begun, place.tolist(), (place - LEG).tolist(), (place + LEG).tolist())


def _place(plant: Any) -> Array:
    """Joints as they truly are, (n,)."""
    return np.array([*(plant.ppu.position if hasattr(plant, "ppu") else ()), *plant.arm.q])


class Parting:
    """Where a look-ahead would halt its machine, another process goes on that does not look.

    The look-ahead changes nothing until it halts, so that both share what came before.

    Attributes:
        blind: whether this is that process.
    """

    def __init__(self) -> None:
        self.blind = False
        self._child, self._pipe = 0, (-1, -1)

    def controller(self, machine: Callable[..., Any]) -> type[Any]:
        """A machine's controller that parts when it is to be halted."""
        assert isinstance(machine, type), "let the machine's System name a class"
        seen: property = machine.ahead  # type: ignore[attr-defined]
        return type(
            machine.__name__, (machine,), {"ahead": property(lambda it: self._parted(seen.__get__(it)))}
        )

    def _parted(self, ahead: str) -> str:
        if ahead and not (self.blind or self._child):
            self._pipe = os.pipe()
            with warnings.catch_warnings():  # threads of the algebra's library, which hold nothing here
                warnings.simplefilter("ignore", DeprecationWarning)
                self._child = os.fork()
            self.blind = not self._child
        return "" if self.blind else ahead

    def join(self, found: Motion) -> Motion | None:
        """What became of the motion without the halt, None where there was none; never of the blind one.

        Raises:
            ChildProcessError: it told nothing.
        """
        read, write = self._pipe
        if self.blind:
            os.write(write, msgspec.msgpack.encode(found))
            os._exit(0)
        if not self._child:
            return None
        os.close(write)
        with os.fdopen(read, "rb") as pipe:
            told = pipe.read()
        os.waitpid(self._child, 0)
        if not told:
            raise ChildProcessError("the motion that was not halted ended without a word")
        return msgspec.msgpack.decode(told, type=Motion)


def run(loaded: Loaded, truth: Truth, seconds: float) -> tuple[Motion, Motion | None]:
    """A motion of so many seconds, until something touches, or a while after a stop.

    Returns:
        It, and the same where the look-ahead halts nothing, if it halted it.

    Raises:
        ChildProcessError: the latter told nothing.
    """
    parting = Parting()
    system = find_system(str(type(loaded.config).__struct_config__.tag))
    with unswept():
        lockstep = Lockstep(build(loaded, controller=parting.controller(system.machine)))
        try:
            motion = _watch(lockstep, truth, seconds, parting)
        except BaseException:
            if parting.blind:
                os._exit(1)
            raise
        return motion, parting.join(motion)


def _watch(lockstep: Lockstep, truth: Truth, seconds: float, parting: Parting) -> Motion:
    cycle, rate = lockstep.session.cycle, lockstep.session.config.loop.rate
    least, contact, left, stopped, tick, look = inf, inf, round(AFTER * rate), inf, 0, 1
    reason, detail, began = "", "", False
    while tick < (seconds + LATER * parting.blind) * rate and left:
        lockstep.tick()
        tick += 1
        began |= cycle.mode in RENDERING
        if cycle.stops.last:
            if not reason:  # a stronger one may follow where the hand goes on pulling
                said = cycle.stops.last.verdict
                reason, detail, stopped = said.reason, said.detail, tick / rate
            left -= cycle.mode is not Mode.STOPPING
        if tick < look:
            continue
        near = truth.near(_place(lockstep.plant))
        look = tick + max(1, int((near - NEAR) * rate / FASTEST))
        least = min(least, near)
        if near <= 0.0:
            contact = tick / rate
            break
    return Motion(reason, stopped, detail, began, least, contact)
