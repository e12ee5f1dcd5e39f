"""Beyond the papers: an avatar's limits as constraints of the giant's twin, beside (3) to (6) of Bimanual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..machines.operator.machine import MOST_PUSH
from ..machines.rendering.twin import end_of, mechanism_of, robot_of
from ..machines.telemanipulation.pair import Pair
from ..models import Array, Robot
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.live.lockstep import unswept
from ..sim.hand import Grip, Path
from ..sim.network_model import Conditions, NetworkModel
from .outcome import Outcome, Progress, Row

TITLE = "an avatar's limits, felt as the twin's constraints and by (3) to (6)"
RIGHT = 1
GRIP = Grip((600.0, 20.0), (30.0, 0.8), (60.0, 8.0))
"""Of the hands at both devices."""
FADED_S, OUT_S, HOLD_S, BACK_S = 6.8, 2.0, 1.5, 2.0
PULLS: dict[str, tuple[Array, float]] = {
    "turned down by 1.1 rad": (np.zeros(3), 1.1),
    "pulled back by 0.36 m": (np.array([-0.36, 0.0, 0.0]), 0.0),
}
"""Way of the palm in the avatar's axes [m], and its turn about the axis to the left [rad]."""
TURN = 4
"""Of a hand's six coordinates the one of that turn: the giant's tilt, and a rotation vector's second."""
EVERY, PUSHES = 10, 0.5
"""Ticks between samples; torque at the joint from which on a limit's direction is looked at [N m]."""


BOUNDS = f"{MOST_PUSH[0]:g} N and {MOST_PUSH[1]:g} N m"


class Pulling:
    """A hand that pulls one way after the other, each time with the least jerk, and comes back."""

    def __init__(self, place: Sequence[float]) -> None:
        """Where it is at first (6,)."""
        self._place = np.array(place, float)

    def at(self, t: float) -> tuple[list[float], list[float]]:
        """See ``hapticd.sim.hand.Course``."""
        share, rate, (way, turn) = _phase(t)
        whole = np.zeros(6)
        whole[:3], whole[TURN] = way, turn
        return (self._place + share * whole).tolist(), (rate * whole).tolist()


def _phase(t: float) -> tuple[float, float, tuple[Array, float]]:
    """How far the pull of a time is out, how fast that changes [1/s], and which it is."""
    period = OUT_S + HOLD_S + BACK_S
    i = int(np.clip((t - FADED_S) // period, 0, len(PULLS) - 1))
    since, pull = t - FADED_S - i * period, list(PULLS.values())[i]
    if since < OUT_S + HOLD_S:
        return *_rise(since / OUT_S, OUT_S), pull
    share, rate = _rise((since - OUT_S - HOLD_S) / BACK_S, BACK_S)
    return 1.0 - share, -rate, pull


def _rise(s: float, seconds: float) -> tuple[float, float]:
    s = min(max(s, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s), 30.0 * s * s * (1.0 - s) ** 2 / seconds


@dataclass(frozen=True, slots=True)
class Felt:
    """A session, a row a sample.

    Attributes:
        time: [s].
        excess: of the avatar's joints beyond its limits, the largest [rad]; negative inside.
        torque: at the joint whose limit pushes most [N m].
        angle: between what is felt of the limit and that joint's dynamically consistent wrench, and before
            it is bounded (k, 2) [rad]; NaN where no limit pushes.
        force: of the limit at the palm (k, 2) [N, N m].
        apart: from the hand's palm to the avatar's (k, 2) [m, rad].
        standing: whether nothing stopped.
    """

    time: Array
    excess: Array
    torque: Array
    angle: Array
    force: Array
    apart: Array
    standing: bool


class Chain:
    """The avatar's right arm with its rotors, as the giant has it for a twin."""

    def __init__(self, giant: Loaded) -> None:
        section: Any = giant.config
        twin = section.giant.twin
        self.robot: Robot = robot_of(twin)
        self._end, self._rotors = self.robot.frame(end_of(twin)), mechanism_of(twin, self.robot).inertia
        self.lower, self.upper = (np.array(getattr(section.leads.right, key)) for key in ("lower", "upper"))

    def consistent(self, q: Array) -> tuple[Array, Array]:
        """Wrenches of single joints that accelerate the palm as their torques do, (6, n); mobility (6, 6).

        At the palm in the station's axes, at joints (n,).
        """
        model, data, at = self.robot.model, self.robot.data, self.robot.configuration(q)
        M = pin.crba(model, data, at)
        M = np.triu(M) + np.triu(M, 1).T + np.diag(self._rotors)
        J = pin.computeFrameJacobian(model, data, at, self._end, pin.LOCAL_WORLD_ALIGNED)
        inverse = np.linalg.inv(M)
        mobility = J @ inverse @ J.T
        return np.linalg.solve(mobility, J @ inverse), mobility


def angle(felt: Array, right: Array, mobility: Array) -> float:
    """Between two wrenches (6,), by the accelerations of the palm that they mean [rad]."""
    inner = felt @ mobility @ right
    size = np.sqrt((felt @ mobility @ felt) * (right @ mobility @ right))
    return float(np.arccos(np.clip(inner / size, -1.0, 1.0)))


def _still(loaded: Loaded) -> Loaded:
    """Without a wall."""
    simulation: Any = loaded.config.simulation
    simulation = msgspec.structs.replace(simulation, walls=None)
    return replace(loaded, config=msgspec.structs.replace(loaded.config, simulation=simulation))


class Session:
    """A device, an avatar, and a hand that pulls."""

    def __init__(self, device: str, avatar: str, chain: Chain) -> None:
        self.pair = Pair(config.load(device), _still(config.load(avatar)), NetworkModel(Conditions(), 1))
        self.chain = chain
        self.machine: Any = self.pair.operator.session.cycle.machine
        self.plant: Any = self.pair.operator.plant
        self.avatar: Any = self.pair.avatar.plant
        hand = self.hand()
        hand._stiffness, hand._damping, hand._strength = (
            np.array(both) for both in (GRIP.stiffness, GRIP.damping, GRIP.strength)
        )
        hand.follow(Pulling(hand._path.at(0.0)[0]))

    def hand(self) -> Any:
        """The one that pulls."""
        raise NotImplementedError

    def limit(self) -> tuple[Array, Array, Array, Array]:
        """What is felt of limits at the palm (6,), before its bounds (6,), its torques (n,), joints (n,)."""
        raise NotImplementedError

    def palm(self) -> tuple[Array, Array]:
        """Of the device, in the avatar's station: place (3,) and rotation (3, 3)."""
        raise NotImplementedError

    def run(self) -> Felt:
        """All pulls."""
        seconds = FADED_S + len(PULLS) * (OUT_S + HOLD_S + BACK_S)
        rows = []
        with unswept():
            for k in range(round(seconds / self.pair.dt)):
                self.pair.tick()
                if k % EVERY == 0 and k * self.pair.dt >= FADED_S:
                    rows.append([k * self.pair.dt, *self._sample()])
        columns = np.array(rows).T
        time, excess, torque, *rest = columns
        direction, force, apart = (np.stack(rest[i : i + 2], 1) for i in (0, 2, 4))
        modes = {each.session.cycle.mode.name for each in (self.pair.operator, self.pair.avatar)}
        return Felt(time, excess, torque, direction, force, apart, standing=modes == {"ACTIVE"})

    def _sample(self) -> list[float]:
        felt, unbounded, torque, q = self.limit()
        arm, chain = self.avatar.arms[RIGHT].arm, self.chain
        excess = float(np.maximum(arm.q - chain.upper, chain.lower - arm.q).max())
        joint = int(np.abs(torque).argmax())
        directions = [np.nan, np.nan]
        if abs(torque[joint]) > PUSHES:
            wrenches, mobility = chain.consistent(q)
            right = np.sign(torque[joint]) * wrenches[:, joint]
            directions = [angle(wrench, right, mobility) for wrench in (felt, unbounded)]
        position, rotation = self.palm()
        turn = np.linalg.norm(pin.log3(rotation @ arm.rotation.T))
        sizes = [float(np.linalg.norm(part)) for part in (felt[:3], felt[3:], position - arm.position)]
        return [excess, abs(float(torque[joint])), *directions, *sizes, float(turn)]


class GiantSession(Session):
    """The giant, whose twin is the arm."""

    def hand(self) -> Any:
        """See ``Session``."""
        return self.plant.hand

    def limit(self) -> tuple[Array, Array, Array, Array]:
        """By Gauss's principle: what the twin's acceleration is beside its free one."""
        control = self.machine.force_control
        twin = control.twin
        torque = twin.M @ control._qdd_twin - twin.force
        wrenches, _ = self.chain.consistent(twin.q)
        wrench = wrenches @ torque
        return wrench, wrench, torque, twin.q

    def palm(self) -> tuple[Array, Array]:
        """Of the twin."""
        palm = self.machine.leading.palm.palm
        return palm.position, palm.rotation


class OperatorSession(Session):
    """The operator's station."""

    def hand(self) -> Any:
        """See ``Session``; the left one stays where it is."""
        left = self.plant.hands[1 - RIGHT]
        place = left._path.at(0.0)[0]
        left.follow(Path([0.0, 1.0], np.array([place, place])))
        return self.plant.hands[RIGHT]

    def limit(self) -> tuple[Array, Array, Array, Array]:
        """(6) with the joints that are foreseen."""
        model, palm = self.machine._models[RIGHT], self.machine.arms[RIGHT].task.palm
        felt = self.machine._limits[RIGHT]
        bounded, unbounded = (
            np.concatenate([palm.rotation @ wrench[:3], palm.rotation @ wrench[3:]])
            for wrench in (felt, model.wrench)
        )
        return bounded, unbounded, model.limits.torque * bool(felt.any()), model.q

    def palm(self) -> tuple[Array, Array]:
        """As it is commanded."""
        clutch = self.machine._clutches[RIGHT]
        return clutch.position, clutch.rotation


def held(found: Felt, i: int) -> NDArray[np.bool_]:
    """Which samples are of the last half second in which a pull is held, (k,)."""
    end = FADED_S + i * (OUT_S + HOLD_S + BACK_S) + OUT_S + HOLD_S
    chosen: NDArray[np.bool_] = (found.time >= end - 0.5) & (found.time < end)
    return chosen


def during(found: Felt, i: int) -> NDArray[np.bool_]:
    """Which samples are of a pull, (k,)."""
    begin = FADED_S + i * (OUT_S + HOLD_S + BACK_S)
    chosen: NDArray[np.bool_] = (found.time >= begin) & (found.time < begin + OUT_S + HOLD_S)
    return chosen


def pulled(kind: type[Session], device: str, avatar: str, chain: Chain) -> Felt:
    """A session of all pulls."""
    return kind(device, avatar, chain).run()


def run(progress: Progress) -> Outcome:
    """The same pulls at both devices."""
    giant = config.load("giant_operator")
    chain = Chain(giant)
    sessions: dict[str, tuple[type[Session], str, str]] = {
        "giant, its twin": (GiantSession, "giant_operator", "giant_avatar"),
        "operator's station, (3) to (6)": (OperatorSession, "operator", "avatar"),
    }
    seen: dict[str, Felt] = {}
    for name, (kind, device, avatar) in sessions.items():
        progress(name)
        seen[name] = pulled(kind, device, avatar, chain)
    rows, figures = _rows(seen)

    def draw(figure: Any) -> None:
        upper, lower = figure.subplots(2, 1, sharex=True)
        for name, found in seen.items():
            upper.plot(found.time, 1e3 * found.excess, label=name)
            lower.plot(found.time, np.degrees(found.angle[:, 0]), label=name)
        upper.axhline(0.0, color="k", lw=0.8, ls="-")
        upper.set(ylabel="avatar's joint beyond\nits limit [mrad]", ylim=(-150.0, 60.0))
        lower.set(xlabel="time [s]", ylabel="off the dynamically\nconsistent wrench [deg]")
        figure.legend(*upper.get_legend_handles_labels(), loc="outside lower center", ncols=2)

    return Outcome(rows, figures, draw)


def _rows(seen: dict[str, Felt]) -> tuple[list[Row], dict[str, Any]]:
    rows, figures = [], dict[str, Any]()
    for i, pull in enumerate(PULLS):
        for name, found in seen.items():
            out, stays = during(found, i), held(found, i)
            pushes = found.angle[out & np.isfinite(found.angle[:, 0])]
            degrees = np.degrees([np.median(pushes, axis=0), pushes.max(axis=0)]) if len(pushes) else None
            felt, unbounded = ("never", "never") if degrees is None else _spread(degrees)
            force, moment = found.force[stays].mean(axis=0)
            way, turn = found.apart[stays].mean(axis=0)
            excess = 1e3 * found.excess[out].max()
            what = f"{pull}: {name}"
            figures[what] = {
                "excess_mrad": float(excess),
                "limit_n": float(force),
                "limit_nm": float(moment),
                "apart_mm": 1e3 * float(way),
                "apart_mrad": 1e3 * float(turn),
                "angle_deg": None if degrees is None else degrees.tolist(),
                "standing": found.standing,
            }
            note = "" if found.standing else "a station stopped"
            rows += [
                Row(f"{what}: avatar's joint beyond its limit, at most [mrad]", "-", f"{excess:.0f}", note),
                Row(
                    f"{what}: what the limit does to the palm, held", "-", f"{force:.1f} N, {moment:.2f} N m"
                ),
                Row(
                    f"{what}: off the dynamically consistent wrench, median / most [deg]",
                    "-",
                    felt,
                    "" if felt == unbounded else f"before its bounds of {BOUNDS} {unbounded}",
                ),
                Row(
                    f"{what}: from the hand's palm to the avatar's, held",
                    "-",
                    f"{1e3 * way:.0f} mm, {1e3 * turn:.0f} mrad",
                ),
            ]
    return rows, figures


def _spread(degrees: Array) -> tuple[str, str]:
    """Median and largest of two angles (2, 2), in words."""
    felt, unbounded = (" / ".join(f"{x:.1f}" for x in column) for column in degrees.T)
    return felt, unbounded
