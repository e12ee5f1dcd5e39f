"""Whether a machine would meet itself or its surroundings if it began to stop now (docs/fault-matrix.md, 26).

What moves is covered by capsules, which meet capsules, boxes and planes. The way of the stop is searched by
conservative advancement: a pair is looked at again no later than it can have come as near as it may, since
nothing on a joint's far side moves faster than the joint's speed times its reach: csrc/look_ahead.c.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..binding import bind, pointer
from ..models import Array, Robot
from ._kernels import ffi, lib
from .ability import Ability
from .serial import SerialChain

MOST_PAIRS = int(lib.LOOK_MAX_PAIRS)
"""That can be watched at once."""


@dataclass(frozen=True, slots=True)
class Capsule:
    """All points within a radius of a segment; on a joint, or standing where it is -1.

    Attributes:
        name: for people.
        joint: that carries it.
        a, b: ends of the segment in the joint's frame, (3,) [m].
        radius: [m].
    """

    name: str
    joint: int
    a: Array
    b: Array
    radius: float


@dataclass(frozen=True, slots=True)
class Box:
    """A box that stands: centre (3,) and half of its sides (3,) [m], its axes as columns (3, 3)."""

    name: str
    centre: Array
    half: Array
    axes: Array = field(default_factory=lambda: np.eye(3))


@dataclass(frozen=True, slots=True)
class Plane:
    """What lies behind a plane: a point of it (3,) [m], and its unit normal (3,) towards the machine."""

    name: str
    point: Array
    normal: Array


Body = Capsule | Box | Plane


@dataclass(frozen=True, slots=True)
class Room:
    """Where limits keep a point of the machine, in a stop, too.

    Attributes:
        joint: that carries it; at: in the joint's frame, (3,) [m].
        lower, upper: corners along the axes of the base, (3,) [m].
    """

    joint: int
    at: Array
    lower: Sequence[float]
    upper: Sequence[float]


@dataclass(frozen=True, slots=True)
class Stop:
    """How a stop goes, one entry a joint.

    Attributes:
        drift: speed until it is felt, (n,) [rad/s or m/s].
        reaction: until then, (n,) [s].
        rate: speed from which the joint brakes then, (n,).
        rated: how hard, (n,) [rad/s^2 or m/s^2].
        ability: what the motors of the last joints can give, so that they brake less hard.
    """

    drift: Array
    reaction: Array
    rate: Array
    rated: Array
    ability: Ability | None = None


@dataclass(frozen=True, slots=True)
class Meeting:
    """Two bodies that would come too near.

    Attributes:
        names: of both.
        apart: now [m]; after: in a stop that begins now [m].
        seconds: until they would meet without a stop, by how they approach.
    """

    names: tuple[str, str]
    apart: float
    after: float
    seconds: float

    def __str__(self) -> str:
        """For people."""
        first, second = self.names
        return (
            f"{first} would have met {second} in {1e3 * self.seconds:.0f} ms, {1e3 * self.apart:.0f} mm away"
        )


class LookAhead:
    """Watches pairs of bodies of a serial chain; see the module.

    Attributes:
        pairs: that are watched, as bodies; the first of each moves.
    """

    def __init__(
        self,
        robot: Robot,
        pairs: Sequence[tuple[Capsule, Body]],
        margin: float,
        q: Array,
        stop: Stop,
        rooms: Sequence[Room] = (),
    ) -> None:
        """Bind to the joints (n,) and what a stop would do, which are read where they are.

        Args:
            robot: a serial chain.
            pairs: to watch; the first moves, and is further out than the second.
            margin: no pair may come nearer [m].
            q: measured, (n,) [rad or m].
            stop: of a machine at this tick.
            rooms: that points of it do not leave; a stop is followed as far as none would.

        Raises:
            ModelError: the robot is no serial chain.
            ValueError: more than MOST_PAIRS.
        """
        self.pairs = list(pairs)
        if len(self.pairs) > MOST_PAIRS:
            raise ValueError(f"{len(self.pairs)} pairs; at most {MOST_PAIRS}")
        n, count = robot.nv, len(self.pairs)
        self._n, self._chain = n, SerialChain(robot, [])
        bodies: list[Body] = list({id(body): body for pair in self.pairs for body in pair}.values())
        index = {id(body): i for i, body in enumerate(bodies)}
        table = ffi.new("look_ahead_body[]", [_constants(body) for body in bodies] or 1)
        numbers = [[index[id(first)], index[id(second)]] for first, second in self.pairs]
        m = len(stop.ability.load) if stop.ability else 0
        kept = ffi.new("look_ahead_room[]", [_room(room) for room in rooms])
        sizes = {"n": n, "bodies": len(table), "pairs": count, "m": m, "rooms": len(rooms)}
        self._core = ffi.new("look_ahead *", {**sizes, "chain": self._chain.pointer, "margin": margin})
        reach = np.array([reaches(robot, *pair) for pair in self.pairs]).reshape(count, n)
        self._known, self._distances = np.zeros(count), np.zeros(count)
        bind(
            lib,
            self._core,
            body=table,
            room=kept,
            pair=ffi.new("look_ahead_pair[]", numbers),
            reach=reach,
            q=q,
            drift=stop.drift,
            reaction=stop.reaction,
            rate=stop.rate,
            rated=stop.rated,
            braking=np.ones(n),
            seen=np.zeros(n),
            known=self._known,
            allowed=np.zeros(count),
            **{
                key: getattr(stop.ability, key) if stop.ability else None
                for key in ("inertia", "load", "least", "most")
            },
        )
        self.reset()

    @property
    def looks(self) -> int:
        """Postures of the last tick in which pairs were looked at."""
        return int(self._core.looks)

    def reset(self) -> None:
        """A start: what is nearer than the margin may stay so, and leave."""
        lib.look_ahead_reset(self._core)

    def update(self) -> Meeting | None:
        """The pair that would come too near in a stop from here."""
        core = self._core
        met = lib.look_ahead_update(core)
        if met < 0:
            return None
        first, second = self.pairs[met]
        closing = (core.apart - core.after) / core.time
        seconds = max(core.apart, 0.0) / closing if closing > 0.0 else 0.0
        return Meeting((first.name, second.name), core.apart, core.after, seconds)

    def pressed(self, share: float) -> str:
        """What came nearer than a share of the margin while it is held, for people; "" for nothing."""
        found = lib.look_ahead_pressed(self._core, share)
        if found < 0:
            return ""
        first, second = self.pairs[found]
        return f"{first.name} is pushed towards {second.name}, {1e3 * self._core.apart:.0f} mm away"

    def distances(self, q: Array) -> Array:
        """Distances of all pairs at a posture (n,), (pairs,) [m]; own buffer; not for the tick."""
        at, out = (pointer(x, kind, len(x)) for x, kind in ((q, "const double"), (self._distances, "double")))
        lib.look_ahead_distances(self._core, at, out)
        return self._distances


def standing(robot: Robot, pairs: Sequence[tuple[Capsule, Body]], margin: float) -> LookAhead:
    """A look-ahead of a machine that stands where all joints are 0, for its distances."""
    n = robot.nv
    stop = Stop(np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n))
    return LookAhead(robot, pairs, margin, np.zeros(n), stop)


def reaches(robot: Robot, first: Capsule, second: Body) -> list[float]:
    """Most that two bodies come closer by a unit of each joint's way, (n,) [m/rad or 1].

    A point turns no faster than its distance from the joint, which is no more than the links between them and
    what they slide.
    """
    joints = serial_lengths(robot)
    held = second.joint if isinstance(second, Capsule) else -1
    reach = [0.0] * robot.nv
    arm = max(float(np.linalg.norm(first.a)), float(np.linalg.norm(first.b)))
    for i in range(first.joint, held, -1):
        length, travel, slides = joints[i]
        reach[i] = 1.0 if slides else arm
        arm += length + travel
    return reach


def serial_lengths(robot: Robot) -> list[tuple[float, float, bool]]:
    """Of each joint: distance from the one before [m], how far it slides at most [m], whether it slides."""
    placements = [float(np.linalg.norm(place.translation)) for place in list(robot.model.jointPlacements)[1:]]
    rows = zip(placements, robot.lower.tolist(), robot.upper.tolist(), robot.sliding, strict=True)
    return [(length, max(-low, high) if slides else 0.0, slides) for length, low, high, slides in rows]


def _room(room: Room) -> dict[str, object]:
    at, lower, upper = (list(map(float, x)) for x in (room.at, room.lower, room.upper))
    return {"joint": room.joint, "at": at, "lower": lower, "upper": upper}


def _constants(body: Body) -> dict[str, object]:
    if isinstance(body, Capsule):
        kind, joint, radius, a, b, R = lib.LOOK_CAPSULE, body.joint, body.radius, body.a, body.b, np.eye(3)
    elif isinstance(body, Box):
        kind, joint, radius, a, b, R = lib.LOOK_BOX, -1, 0.0, body.centre, body.half, body.axes
    else:
        kind, joint, radius, a, b, R = lib.LOOK_PLANE, -1, 0.0, body.point, body.normal, np.eye(3)
    lists = {"a": a.tolist(), "b": b.tolist(), "R": R.reshape(-1).tolist()}
    return {"kind": kind, "joint": joint, "radius": radius, **lists}
