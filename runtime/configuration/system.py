"""What a kind of machine brings along, and the kinds that are installed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

from ...configs import plugins
from ...devices.frames import Frames
from ...devices.image import ProcessImage
from ...devices.network import Network
from ...models import Array, Robot
from ...sim.person import Deed, Lead
from ...sim.sensors import Sensors
from ..core.machine import Machine, MachineFigures, MachineLimits
from ..core.scene import MachineScene
from ..core.sections import Config
from ..core.stages import Mark
from .beside import Beside


class Plant(Protocol):
    """A simulated machine behind its simulated devices."""

    @property
    def time(self) -> float:
        """Plant time [s]."""

    @property
    def safe(self) -> bool:
        """Whether every drive is in its safe state."""

    def exchange(self, frames_in: Frames, frames_out: Frames) -> None:
        """Let the devices take frames and answer."""

    def step(self, dt: float) -> None:
        """Advance plant time by dt."""

    def obey(self, deed: Deed | Lead) -> None:
        """A person acts instead of the script."""

    def supervise(self, changes: Sequence[tuple[float, bool]]) -> None:
        """A safety operator presses and releases a dead-man switch: times [s], and what from then on."""

    def spoil(self, sensors: Sensors, seed: int) -> None:
        """From now on its devices measure with errors, which the seed draws."""


@runtime_checkable
class Connecting(Protocol):
    """A plant that reaches for other machines where it runs in real time."""

    def connect(self) -> None:
        """Do so; it waits for nobody."""


class ScriptError(ValueError):
    """A hand's script in a twin's file that leads nowhere.

    Attributes:
        key: in the file; problem, fix: for people.
    """

    def __init__(self, key: str, problem: str, fix: str) -> None:
        self.key, self.problem, self.fix = key, problem, fix
        super().__init__(f"{key}: {problem}; {fix}")


C = TypeVar("C", bound=Config)


def _same(place: Sequence[float]) -> Sequence[float]:
    return place


@dataclass(frozen=True, slots=True)
class Stance(Generic[C]):
    """Where a simulated session begins, and where a hand may want to lead the machine from there.

    Attributes:
        config: begins there; the hand in it is still the configured one.
        place: of the handle at the beginning: position [m] and, where the hand holds directions, angles
            [rad]; after those of a right palm those of a left one.
        lower, upper: of what the hand may want, one entry a coordinate; beyond the machine's limits here and
            there.
        pose: the handle's position and angles that stand for a place, where they are not the place itself.
        turns: whether the hand holds the handle's orientation, too, where its section can say so.
    """

    config: C
    place: Sequence[float]
    lower: Sequence[float]
    upper: Sequence[float]
    pose: Callable[[Sequence[float]], Sequence[float]] = _same
    turns: bool = True


class Course(Protocol):
    """Motion of joints that begins and ends at rest.

    Attributes:
        q, qd, qdd: of this tick, (m,) each [rad or m, s].
    """

    q: Array
    qd: Array
    qdd: Array

    @property
    def arrived(self) -> bool:
        """Whether it is at its end."""

    def advance(self) -> None:
        """One period along."""


class Led(Machine, Protocol):
    """A controller that leads the joints from place to place or along a course, for calibrations."""

    @property
    def arrived(self) -> bool:
        """Whether the plan has come to its end."""

    def go(self, q: Array) -> None:
        """Plan a way from where the joints are led now to others (m,), at rest at both ends [rad or m]."""

    def follow(self, course: Course) -> None:
        """Go along a course that begins where the joints are at rest now."""


@dataclass(frozen=True, slots=True)
class Mount:
    """Where a force-torque sensor is.

    Attributes:
        device: its name among the devices.
        row: of the sensor in its group.
        frame: of the model.
    """

    device: str
    row: int
    frame: str


@dataclass(frozen=True, slots=True)
class Rig(Generic[C]):
    """How a machine is calibrated.

    Attributes:
        config: of it, with nobody at its handles.
        machine: builds a controller that leads its joints.
        mounts: its force-torque sensors that can be calibrated.
        robot: model of the joints that are led.
        start: where its joints begin, (m,) [rad or m].
        lower, upper: of the joints on the way, (m,) [rad or m].
        velocity, acceleration: rated ones, (m,).
        inside: whether the machine may be led through a place (m,).
    """

    config: C
    machine: Callable[[C, Robot, ProcessImage, Mark], Led]
    mounts: Sequence[Mount]
    robot: Robot
    start: Array
    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    inside: Callable[[Array], bool]


@dataclass(frozen=True, slots=True)
class Pushed(Generic[C]):
    """A state of a machine in which its handle is pushed, for the inertia and friction that a hand feels.

    Attributes:
        name: for people.
        machine: builds its controller; None for the machine's own.
        directions: of the base that the handle moves in, "x" to "z".
    """

    name: str = "as configured"
    machine: Callable[[C, Robot, ProcessImage, Mark], Machine] | None = None
    directions: Sequence[str] = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class System(Generic[C]):
    """A kind of machine; an entry point of the group ``hapticd.machines`` names it.

    Attributes:
        config: the sections of its configuration; its tag is the name of the entry point.
        machine: builds its controller.
        limits: what a session may touch.
        figures: what people see of it besides.
        plant: builds its simulation.
        check: findings (key, problem, fix) that only the model can tell.
        stance: a random beginning of a simulated session; without it every session begins as configured.
        led: for a machine that renders a twin, the path of a simulated hand, as tables of TOML, that leads
            the twin as the [hand] of the twin's file says; raises ScriptError.
        scene: how it is drawn; without it nobody sees more of it than its channels.
        remarks: sentences on what people should know of a configuration that is fine.
        rig: for a machine whose joints can be led, how: its sensors are calibrated, its motors identified.
        variations: other random beginnings than ``stance``, by name.
        pushed: states in which its handle is pushed; without it that is the machine as it is configured.
        beside: files that its sections name and whose content they do not hold yet.
    """

    config: type[C]
    machine: Callable[[C, Robot, ProcessImage, Mark], Machine]
    limits: Callable[[C], MachineLimits]
    figures: Callable[[C], MachineFigures]
    plant: Callable[[C, Robot, Network], Plant]
    check: Callable[[C, Robot], list[tuple[str, str, str]]]
    stance: Callable[[C, Robot, Random], Stance[C]] | None = None
    led: Callable[[C, Robot, Mapping[str, Any]], str] | None = None
    scene: Callable[[C], MachineScene] | None = None
    remarks: Callable[[C, Robot], list[str]] | None = None
    rig: Callable[[C, Robot], Rig[C]] | None = None
    variations: Mapping[str, Callable[[C, Robot, Random], Stance[C]]] = field(default_factory=dict)
    pushed: Callable[[C], Sequence[Pushed[C]]] | None = None
    beside: Callable[[C], Sequence[Beside]] | None = None


def system_names() -> list[str]:
    """The kinds of machines that are installed."""
    return plugins.names(plugins.MACHINES)


def find_system(name: str) -> System[Any]:
    """The kind of machine of a name.

    Raises:
        KeyError: none of that name is installed.
        PluginError: what is installed under it is not such a kind.
    """
    found = plugins.plugin(plugins.MACHINES, name)
    if not isinstance(found, System):
        raise plugins.PluginError(name, f"is a {type(found).__name__}", "let its entry point name a System")
    tag = found.config.__struct_config__.tag
    if tag != name:
        fix = "let the entry point have the name of the tag"
        raise plugins.PluginError(name, f"its configuration has the tag '{tag}'", fix)
    return found
