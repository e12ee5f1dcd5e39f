"""Sessions of a simulated machine under random hands, in lockstep."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import isfinite
from typing import Any

import numpy as np

from ..models import Array, Robot
from ..runtime.command_line.arguments import meant
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build, require_sound
from ..runtime.configuration.system import Stance, System, find_system
from ..runtime.core.modes import RENDERING, Command, Mode
from ..runtime.core.sections import Config
from ..runtime.errors import ConfigError, HapticdError
from ..runtime.live.lockstep import Lockstep, unswept
from ..safety import Reaction
from ..sim.plant import SimPlant
from .ideal_twin import Covered
from .own_plant import Doubt
from .random_hand import stranger
from .random_twin import with_random_chain
from .temper import Temper
from .workers import pool_of

NOT_STARTED = "not_started"
"""Cause of a session in which the machine refused to start."""
MOVING = (Mode.ENGAGING, Mode.ACTIVE, Mode.STOPPING, Mode.HOLDING)
"""Modes in which limits are to be kept."""
AS_CONFIGURED = Doubt()
"""The machine is simulated as its configuration says."""
STOP_S = 1.0
"""A stop comes to rest within so long."""
ENDS = ("lower", "upper")
DRAWS = 20
"""Surroundings that a seed draws at most until one passes the machine's checks."""
BLOCK = 256
"""Ticks that are compared with the limits at once."""


class HandsError(HapticdError):
    """A session cannot be run."""

    code = "hands"
    exit_status = 2


@dataclass(frozen=True, slots=True)
class Session:
    """What became of a session.

    Attributes:
        seed: of its hand.
        stop: reason of the stop, "" where it went on until its end; detail: the same for people.
        reaction: how strong the stop was.
        seconds: until the stop, or the end.
        excess: how far beyond each limit, or beyond where it began outside, the machine went; negative
            inside.
        returned: energy that the hand got back beyond what it had put in until then [J].
        covered: share of an ideal twin's way that the handle went; None where there is none.
    """

    seed: int
    stop: str
    detail: str
    reaction: int
    seconds: float
    excess: dict[str, float] = field(default_factory=dict)
    returned: float = 0.0
    covered: float | None = None


def sessions(
    loaded: Loaded,
    seeds: Sequence[int],
    seconds: float,
    temper: Temper,
    workers: int,
    doubt: Doubt = AS_CONFIGURED,
    chains: bool = False,
    vary: str = "",
) -> Iterator[Session]:
    """One session a seed, in their order, on so many processes; with a random chain each as twin if asked.

    ``vary`` names one of the machine's variations.

    Raises:
        HandsError: the configuration simulates nothing, or cannot simulate what the controller doubts, or
            its limits leave the machine no room for a hand.
    """
    if loaded.config.simulation is None:
        raise HandsError(f"{loaded.source} has no [simulation]; add it, or name a built-in machine")
    if not doubt.fits(loaded.config):
        raise HandsError(f"the machine of {loaded.source} has no [simulation.plant]; leave --wrong-model out")
    one = partial(session, loaded, seconds=seconds, temper=temper, doubt=doubt, chains=chains, vary=vary)
    if workers == 1:
        yield from map(one, seeds)
        return
    with pool_of(workers) as pool:
        yield from pool.map(one, seeds)


def session(
    loaded: Loaded,
    seed: int,
    seconds: float,
    temper: Temper,
    watch: Callable[[Lockstep], None] = lambda lockstep: None,
    doubt: Doubt = AS_CONFIGURED,
    chains: bool = False,
    vary: str = "",
) -> Session:
    """A session under the hand of a seed, ended after so many seconds or by a stop.

    Args:
        loaded: the machine.
        seed: of the hand.
        seconds: of virtual time.
        temper: of the hands.
        watch: called after each tick.
        doubt: how the machine differs from what its controller believes.
        chains: whether the seed also draws the digital twin.
        vary: one of the machine's variations; "" for what it always varies.
    """
    loaded = with_random_chain(loaded, seed) if chains else loaded
    config = loaded.config
    system = find_system(str(type(config).__struct_config__.tag))
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    if vary:
        system = replace(system, stance=_variation(system, vary))

    def drawn(draw: int) -> Config:
        try:
            led = stranger(config, system, robot, seed, seconds, temper, draw)
        except ValueError as error:
            raise HandsError(f"seed {seed}: {error}") from error
        return doubt.vary(led, seed)

    with unswept():
        return _session(_admitted(loaded, seed, drawn), seed, seconds, watch)


def _admitted(loaded: Loaded, seed: int, drawn: Callable[[int], Config]) -> Lockstep:
    """The machine with the first of the drawn surroundings that its checks admit."""
    for draw in range(DRAWS):
        try:
            return Lockstep(build(replace(loaded, config=drawn(draw))))
        except ConfigError as error:
            require_sound(loaded)  # or no draw mends it
            refused = error
    raise HandsError(f"seed {seed}: check refused {DRAWS} random surroundings, the last for: {refused}")


def _variation(system: System[Any], name: str) -> Callable[..., Stance[Any]]:
    if name not in system.variations:
        mend = meant(name, system.variations) if system.variations else "it has none; leave --vary out"
        raise HandsError(f"there is no variation '{name}' of this machine; {mend}")
    return system.variations[name]


def _session(lockstep: Lockstep, seed: int, seconds: float, watch: Callable[[Lockstep], None]) -> Session:
    limits, work, covered = Kept(lockstep), Work(lockstep), Covered(lockstep)
    rate = lockstep.session.config.loop.rate
    cycle, ticks = lockstep.session.cycle, round(seconds * rate)
    moved, said = False, "nobody pressed the dead-man switch"

    def step(command: Command = Command.NONE) -> None:
        nonlocal moved, said
        lockstep.tick(command)
        moved |= cycle.mode is Mode.ENGAGING
        if lockstep.outputs.events and not command:
            said = str(lockstep.outputs.events[-1])
        limits.add()
        work.add()
        covered.add()
        watch(lockstep)

    while lockstep.inputs.tick + 1 < ticks and not (cycle.stops.last or cycle.mode is Mode.FAILED):
        step()
    at = (lockstep.inputs.tick + 1) / rate
    if cycle.stops.last is None:
        step(Command.END)
    until = lockstep.inputs.tick + STOP_S * rate
    while cycle.mode is Mode.STOPPING and lockstep.inputs.tick < until:
        step()
    if last := cycle.stops.last:
        stop, detail, reaction = last.verdict.reason, last.verdict.detail, int(last.verdict.reaction)
    elif not moved:
        stop, detail, reaction = NOT_STARTED, said, int(Reaction.RAMP)
    else:
        stop, detail, reaction = "", "", 0
    share = covered.share(seconds, bool(stop))
    return Session(seed, stop, detail, reaction, at, limits.excess, work.returned, share)


class Kept:
    """How far beyond its limits a machine goes while its drives move it."""

    def __init__(self, lockstep: Lockstep) -> None:
        session = lockstep.session
        self._cycle = session.cycle
        self._limits = limits = session.system.limits(session.config)
        self._record = np.zeros(1, session.cycle.machine.state)
        session.cycle.machine.bind_state(self._record)
        self._state = self._record[0]
        self._lower, self._upper = (np.array([getattr(s, end) for s in limits.specs]) for end in ENDS)
        self._begin: Array | None = None
        self._worst = np.full(len(limits.specs), -np.inf)
        self._values: list[Sequence[float]] = []

    def add(self) -> None:
        """Take a tick."""
        if self._cycle.mode not in MOVING:
            return
        self._cycle.machine.fill()
        self._values.append(self._limits.values(self._state))
        if len(self._values) == BLOCK:
            self._take()

    @property
    def excess(self) -> dict[str, float]:
        """Beyond each limit, or beyond where the machine began if that was outside; negative inside."""
        if self._values:
            self._take()
        if self._begin is None:
            return {}
        rows = zip(self._limits.specs, self._worst.tolist(), self._begin.tolist(), strict=True)
        return {spec.name: worst - begin for spec, worst, begin in rows if isfinite(worst)}

    @property
    def lies(self) -> dict[str, float]:
        """The same of where the machine is now, in whatever mode."""
        self._cycle.machine.fill()
        beyond = self._beyond(np.array(self._limits.values(self._state)))
        begin = np.zeros(len(beyond)) if self._begin is None else self._begin
        rows = zip(self._limits.specs, beyond.tolist(), begin.tolist(), strict=True)
        return {spec.name: now - begin for spec, now, begin in rows if isfinite(now)}

    def _beyond(self, values: Array) -> Array:
        found: Array = np.fmax(self._lower - values, values - self._upper)
        return found

    def _take(self) -> None:
        """The ticks that wait, at once; what is no number is passed over."""
        beyond = self._beyond(np.array(self._values))
        self._values.clear()
        if self._begin is None:
            self._begin = np.fmax(0.0, beyond[0])
        self._worst = np.fmax(self._worst, np.fmax.reduce(beyond))


class Work:
    """What a hand does at the handle of a simulated machine while the machine renders.

    Attributes:
        returned: most that the hand ever had got back beyond what it had put in [J].
    """

    def __init__(self, lockstep: Lockstep) -> None:
        plant = lockstep.plant
        assert isinstance(plant, SimPlant), "let the simulated machine extend SimPlant"
        self._plant, self._cycle = plant, lockstep.session.cycle
        self._half = 0.5 / lockstep.session.config.loop.rate
        self.returned = self._put_in = 0.0
        self._power: float | None = None

    def add(self) -> None:
        """Take a tick."""
        if self._cycle.mode not in RENDERING:
            return
        power = self._plant.hand_power
        if self._power is not None:
            self._put_in += self._half * (self._power + power)
            self.returned = max(self.returned, -self._put_in)
        self._power = power


@dataclass(slots=True)
class Tally:
    """What became of many sessions.

    Attributes:
        sessions: how many; finished: of them.
        stops: by reason; details: one example each.
        worst_excess: of each limit, over all sessions.
        returned: most energy that a hand got back beyond what it had put in [J].
        shares: of an ideal twin's way, of the sessions that have them.
        worst: of all sessions: the strongest stop, of these the earliest, or else the largest excess.
    """

    sessions: int = 0
    finished: int = 0
    stops: Counter[str] = field(default_factory=Counter)
    examples: dict[str, Session] = field(default_factory=dict)
    worst_excess: dict[str, float] = field(default_factory=dict)
    returned: float = 0.0
    shares: list[float] = field(default_factory=list)
    worst: Session | None = None

    @property
    def covered(self) -> float | None:
        """Mean of ``shares``; None without any."""
        return sum(self.shares) / len(self.shares) if self.shares else None

    def add(self, session: Session) -> None:
        """Take one."""
        self.sessions += 1
        self.finished += not session.stop
        if session.stop:
            self.stops[session.stop] += 1
            self.examples.setdefault(session.stop, session)
        self.returned = max(self.returned, session.returned)
        if session.covered is not None:
            self.shares.append(session.covered)
        for name, excess in session.excess.items():
            self.worst_excess[name] = max(excess, self.worst_excess.get(name, excess))
        if self.worst is None or _badness(session) > _badness(self.worst):
            self.worst = session


def _badness(session: Session) -> tuple[int, float]:
    if session.stop:
        return session.reaction, -session.seconds
    return 0, max(session.excess.values(), default=0.0)
