"""A hand presses an avatar against a wall over a network: delay, jitter, loss, with and without the layer."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, pi

import numpy as np

from ..control.avatar_law import Impedance
from ..control.link_passivity import AVATAR_TANK, OPERATOR_TANK, AvatarPort, OperatorPort, Tank
from ..models import Array

DT = 1e-3
NEVER = -1


@dataclass(frozen=True, slots=True)
class Network:
    """Packets one way: delay [s], by how much it varies evenly to either side [s], share that is lost."""

    delay: float
    jitter: float = 0.0
    loss: float = 0.0


class Way:
    """One direction of a network: which packet is the newest that has come, by the tick it was sent in."""

    def __init__(self, network: Network, ticks: int, seed: list[int]) -> None:
        random = np.random.default_rng(seed)
        delays = network.delay + network.jitter * random.uniform(-1.0, 1.0, ticks)
        arrive = np.arange(ticks) + np.maximum(np.round(delays / DT), 1).astype(int)
        kept = (random.uniform(size=ticks) >= network.loss) & (arrive < ticks)
        newest = np.full(ticks, NEVER)
        np.maximum.at(newest, arrive[kept], np.flatnonzero(kept))
        self.newest: list[int] = np.maximum.accumulate(newest).tolist()


@dataclass(frozen=True, slots=True)
class Press:
    """What a hand and a wall are like, and how the hand moves.

    Attributes:
        wall, wall_damping: [N/m], [N s/m]; its surface is at 0.
        hand, hand_damping: of the grip [N/m], [N s/m].
        mass: of hand and operator arm together [kg]; avatar: of the avatar's arm at its palm [kg].
        depth: to which the hand wants to press, were there no wall [m].
        period: of coming, pressing and going [s].
        speed: with which it comes [m/s].
        tool: what hangs on the avatar's sensor, whose inertia is felt, too [kg].
    """

    wall: float
    wall_damping: float = 5.0
    hand: float = 300.0
    hand_damping: float = 12.0
    mass: float = 3.0
    avatar: float = 3.5
    depth: float = 0.06
    period: float = 20.0
    speed: float = 0.08
    tool: float = 0.0

    def wanted(self, t: float) -> tuple[float, float]:
        """Where the hand wants to be, and how fast that moves: there, rest, back, rest."""
        away = -0.08
        move = 0.5 * pi * (self.depth - away) / self.speed
        s = t % self.period
        if s < move:
            return _eased(away, self.depth, s, move)
        if s < 0.75 * self.period:
            return self.depth, 0.0
        return _eased(self.depth, away, s - 0.75 * self.period, move)


def random_case(seed: int) -> tuple[Press, Network]:
    """Another hand, wall and network, either way alike: round trips to 700 ms, walls of 1 to 10 kN/m."""
    r = np.random.default_rng([seed, 7])
    delay = float(r.uniform(0.0, 0.35))
    network = Network(delay, float(r.uniform(0.0, 0.33)) * delay, float(r.uniform(0.0, 0.05)))
    case = Press(
        wall=float(np.exp(r.uniform(np.log(1e3), np.log(1e4)))),
        wall_damping=float(r.uniform(0.0, 20.0)),
        hand=float(r.uniform(150.0, 600.0)),
        hand_damping=float(r.uniform(8.0, 25.0)),
        mass=float(r.uniform(2.0, 5.0)),
        avatar=float(r.uniform(2.5, 5.0)),
        depth=float(r.uniform(0.03, 0.08)),
        speed=float(r.uniform(0.04, 0.1)),
    )
    return case, network


def _eased(begin: float, end: float, t: float, seconds: float) -> tuple[float, float]:
    if t >= seconds:
        return end, 0.0
    w = pi / seconds
    return begin + 0.5 * (end - begin) * (1.0 - cos(w * t)), 0.5 * (end - begin) * w * float(np.sin(w * t))


@dataclass(frozen=True, slots=True)
class Pressed:
    """One row a tick.

    Attributes:
        t: [s]; hand, avatar: places [m]; felt: by the operator, world: by the avatar [N]; (k,) each.
        given: work done on hand and wall, less what came back and went in, since the start [J].
        taken: work that the layer kept from being done at the hand [J].
        level: of either tank [J], (k, 2).
        work: that the hand did on all in all, as the sum of its magnitude [J].
    """

    t: Array
    hand: Array
    avatar: Array
    felt: Array
    world: Array
    given: Array
    taken: Array
    level: Array
    work: float


def pressed(table: Array, work: float) -> Pressed:
    """The rows of a simulation, (k, 9), as columns."""
    t, hand, avatar, felt, world, given, taken = table[:, :7].T
    return Pressed(t, hand, avatar, felt, world, given, taken, table[:, 7:], work)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Of a press, the last period alone for what is steady.

    Attributes:
        swing: of the hand while it rests in contact [m].
        force: largest at hand and wall [N].
        given: most that was given out beyond what went in [J].
        share: of the avatar's force that the operator feels at rest; pressed: that force [N].
    """

    swing: float
    force: float
    given: float
    share: float
    pressed: float


def judge(case: Press, seen: Pressed) -> Verdict:
    """Look at the last second and a half of the last rest in contact."""
    end = seen.t[-1] - 0.25 * case.period
    rest = (seen.t > end - 1.6) & (seen.t < end - 0.1)
    world, felt = float(seen.world[rest].mean()), float(seen.felt[rest].mean())
    force = float(max(np.abs(seen.felt).max(), np.abs(seen.world).max()))
    share = felt / world if world else 0.0
    return Verdict(float(np.ptp(seen.hand[rest])), force, float(seen.given.max()), share, -world)


def press(
    case: Press,
    there: Network,
    back: Network,
    seconds: float,
    seed: int,
    layer: bool,
    tanks: tuple[Tank, Tank] = (OPERATOR_TANK, AVATAR_TANK),
) -> Pressed:
    """Simulate a pair of arms along one direction, x.

    What the link gives out is counted by the simulation, apart from the layer: the work that the rendered
    force does on the hand, and that the avatar does on the wall.
    """
    ticks = round(seconds / DT)
    out, home = (Way(n, ticks, [seed, k]).newest for k, n in enumerate((there, back)))
    k = Impedance()
    v_hand, v_avatar, force, eye = np.zeros(6), np.zeros(6), np.zeros(6), np.eye(3)
    operator = OperatorPort(eye, v_hand, DT, tanks[0])
    avatar = AvatarPort(eye, v_avatar, force, k, DT, tanks[1])
    x, v = case.wanted(0.0)[0], 0.0
    y, w = x, 0.0
    avatar.position[0] = x
    avatar.reset()
    share = 1.0 - exp(-2.0 * pi * 15.0 * DT)
    sensed, given, work = 0.0, 0.0, 0.0
    poses, forces, granted, returned = [x], [0.0], [0.0], [0.0]
    rows = []
    for i in range(ticks):
        at = out[i] + 1
        avatar.position[0] = poses[at]
        v_avatar[0], force[0] = w, sensed
        avatar.update(granted[at])
        goal = float(avatar.reference[0]) if layer else poses[at]
        at = home[i] + 1
        v_hand[0], operator.wrench[0] = v, forces[at]
        operator.update(returned[at])
        felt = float(operator.felt[0]) if layer else forces[at]
        wanted, rate = case.wanted(i * DT)
        pull = case.hand * (wanted - x) + case.hand_damping * (rate - v)
        before = v
        v += DT * (pull + felt) / case.mass
        x += DT * v
        given += felt * 0.5 * (v + before) * DT
        work += abs(pull * v) * DT
        wall = min(0.0, -case.wall * y - case.wall_damping * w) if y > 0.0 else 0.0
        before = w
        w += DT * (k.stiffness * (goal - y) - k.damping * w + wall) / case.avatar
        y += DT * w
        given -= wall * 0.5 * (w + before) * DT
        sensed += share * (wall - case.tool * (w - before) / DT - sensed)
        poses.append(x)
        forces.append(sensed)
        granted.append(operator.sent)
        returned.append(avatar.sent)
        rows.append((i * DT, x, y, felt, wall, given, operator.taken, operator.level, avatar.level))
    table = np.array(rows)
    return pressed(table, work)
