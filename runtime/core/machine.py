"""What the cycle needs to know of a machine; each system implements it once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ...models import ModelError
from ...safety import AxisLimits, Plausibility, SetPoint, Thresholds
from .modes import Mode

GATE_SHARE = 0.5
"""Where between a joint's limit and the monitor's margin the gate neutralises commands further out."""
MOST_PERMILLE = 32.767
"""Largest torque in multiples of the rated one that an INT16 in permille carries."""
RAMP_SHARE = 0.8
"""Share of the declared stop time that is left for braking after detection."""
SPEED_MARGIN = 1.1
"""Measured over-speed that stops the machine (docs/fault-matrix.md, row 25)."""
DRIFT = 0.04
"""Part of a force-torque sensor's full scale that it may show before arming, when nobody pulls (row 13)."""
GRAVITY, GRAVITY_MARGIN = 9.81, 1.0
"""What an accelerometer at rest measures, and how far it may be off before arming [m/s^2]."""
REST_S = 10e-3
"""For so long axes must be slow to be at rest."""


class UnfitError(ModelError):
    """What a machine finds of its configuration only while it is built.

    Attributes:
        key: of the configuration.
    """

    def __init__(self, key: str, problem: str, fix: str) -> None:
        self.key = key
        super().__init__(key, 0, problem, fix)


NEAR, NEAR_SHARE = 5e-3, 0.01
"""Touching a limit: so close to it [rad, m or N m], and no further than this part of the way between both."""


def near(lower: float, upper: float) -> float:
    """How close to a limit counts as touching it, and how far beyond it as not yet passing it."""
    return min(NEAR, NEAR_SHARE * (upper - lower))


@dataclass(frozen=True, slots=True)
class LimitSpec:
    """A limit that a session may touch.

    Attributes:
        name: for people, with the unit of its values.
        lower, upper: infinite where there is none.
        unit: "rad", "m" or "N m".
    """

    name: str
    lower: float
    upper: float
    unit: str

    @property
    def near(self) -> float:
        """See ``near``."""
        return near(self.lower, self.upper)


class Machine(Protocol):
    """One machine's controller between the process image and the gate; synchronous, free of clocks.

    Attributes:
        outputs: of the drives, as pairs of group and quantity in the process image; the gate writes them.
        axes: what the gate checks, one entry an axis.
        thresholds: what the monitor compares with.
        play: how far a hand may pull each axis from where it is held or braked: as far as the whole torque
            of the hold goes, and what is further is not held [rad or m].
        plausibility: what its measurements must pass; takes each tick before ``estimate``.
        state: numpy structure of what the log keeps of a tick.
        braking: longest time that ``brake`` takes from full speed [s].
        position, velocity: measured, one an axis.
        astray: whether each axis is further from where its controller has it than loads explain, or dragged
            over a limit that its motor does not hold.
        overload: axis of which more torque is asked than is rated, now or lately; "" for none.
        raw_wrench: as the sensor reports it, None where a sensor it needs gives nothing valid.
        inertial: whether the other accelerometers give valid values.
        commands: for the gate, one an axis.
        solved: whether the last ``update`` ended with an answer to stand by.
    """

    outputs: tuple[tuple[str, str], ...]
    axes: tuple[AxisLimits, ...]
    thresholds: Thresholds
    play: tuple[float, ...]
    plausibility: Plausibility
    state: np.dtype[np.void]
    commands: list[float]
    solved: bool
    position: list[float]
    velocity: list[float]
    astray: list[bool]
    overload: str
    raw_wrench: list[float] | None
    inertial: bool
    braking: float

    @property
    def inside_limits(self) -> bool:
        """Whether the measured posture may be engaged."""

    def unrest(self, first: bool) -> list[str]:
        """What sensors show at rest and must not before a start, each as a sentence for people (row 13).

        Args:
            first: whether it is the first start: nobody holds the handle yet.
        """

    def estimate(self) -> None:
        """Take the latched process image."""

    def engage(self) -> None:
        """Start from the measured posture, at rest."""

    def update(self, gain: float, trust: float) -> None:
        """Compute the commands of this tick.

        Args:
            gain: 0 to 1, how far the operator's wrench moves the machine while it engages.
            trust: 0 to 1, how far the measured wrench is believed.
        """

    def brake(self, dropped: Sequence[bool]) -> bool:
        """Compute commands that bring the machine to rest and hold it; whether it is at rest, as measured.

        A stop trusts no force sensor: what the last wrench contributed fades out. It begins with what was
        written last.

        Args:
            dropped: one an axis, whether its drive was switched off because nobody knows what it does.
        """

    def bind_state(self, state: NDArray[np.void]) -> None:
        """Where ``fill`` writes: (1,) of ``state``."""

    def fill(self) -> None:
        """Write the state of this tick."""


@runtime_checkable
class Announcing(Protocol):
    """A machine that does things by itself of which people are told.

    Attributes:
        notes: what to tell them, in words; whoever tells it empties the list.
    """

    notes: list[str]


@runtime_checkable
class Exchanging(Protocol):
    """A machine that renders one of several digital twins.

    Attributes:
        twins: their names; the first is the one that a session begins with.
        abandoned: why an exchange that had begun was given up, in words; whoever tells it empties it.
    """

    twins: tuple[str, ...]
    abandoned: str

    @property
    def rendered(self) -> int:
        """Index of the twin that is rendered."""

    @property
    def wanted(self) -> int:
        """Index of the one that an exchange under way leads to; -1 for none."""

    def exchange(self, index: int, at_rest: bool) -> None:
        """Render another twin: at once where nothing moves, or once the rendered one has come to rest."""

    def give_up(self, why: str) -> None:
        """An exchange that is under way; why, in words."""


@runtime_checkable
class Preparing(Protocol):
    """A machine that looks for something which only a session that runs needs, and which takes a while."""

    def prepare(self) -> None:
        """Look for it, before the first tick.

        Raises:
            UnfitError: there is no such thing.
        """


@runtime_checkable
class Foreseeing(Protocol):
    """A machine that looks ahead for collisions.

    Attributes:
        ahead: what it would have met, in words, as its last ``update`` saw it; "" for nothing.
        pressed: what comes too near while it is held, as its last ``brake`` saw it; "" for nothing.
    """

    ahead: str
    pressed: str


@dataclass(frozen=True, slots=True)
class Equipment:
    """A device with a controller of its own, which is told set points instead of commands.

    Attributes:
        group, row: of the process image; it has a word ``enable``.
        target, measured: names of its quantities there.
        points: what its coordinates may be told.
    """

    group: str
    row: int
    target: str
    measured: str
    points: tuple[SetPoint, ...]


@runtime_checkable
class Equipped(Protocol):
    """A machine with such devices beside its drives; they have power as long as the drives have.

    Attributes:
        equipment: the devices.
        wanted: what they are to be told at this tick, all their coordinates side by side.
    """

    equipment: tuple[Equipment, ...]
    wanted: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LevelSpec:
    """A level of a hierarchy that is solved in each tick.

    Attributes:
        name: for people.
        unit: of its slack; empty where its rows have several, or none.
    """

    name: str
    unit: str


@runtime_checkable
class Solving(Protocol):
    """A machine that solves a hierarchy in each tick.

    Its ``state`` has the ``status`` of the solver, 0 where it stands by its answer, how many ``levels_done``
    are proven, and the ``slack`` of every level, (levels,).

    Attributes:
        levels: the first outranks all others; none for a machine that was told to solve nothing.
        remarks: what each status but 0 means.
    """

    levels: tuple[LevelSpec, ...]
    remarks: Mapping[int, str]


class MachineLimits(Protocol):
    """What a session of a machine may touch.

    Attributes:
        specs: the limits.
    """

    specs: tuple[LimitSpec, ...]

    def values(self, state: np.void) -> Sequence[float]:
        """Measured values in the order of ``specs``, from one logged state."""


@dataclass(frozen=True, slots=True)
class FigureSpec:
    """A number that sums up a session by its mean and its largest value.

    Attributes:
        name: for people.
        unit: of its values as people read them, e.g. "mm"; empty for counts.
    """

    name: str
    unit: str


class MachineFigures(Protocol):
    """What people see of a machine's state beside its limits.

    Attributes:
        specs: of the figures in the summary.
    """

    specs: tuple[FigureSpec, ...]

    def values(self, state: np.void) -> Sequence[float]:
        """The figures in the order of ``specs``, from a logged state of a tick that was controlled."""

    def live(self, mode: Mode, state: np.void) -> Sequence[str]:
        """Words for the live line, the essential first; nothing that was not measured in this mode."""
