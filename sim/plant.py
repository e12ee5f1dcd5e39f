"""What every simulated machine has: devices on a bus, plant time, a dead-man switch with a script."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..devices.frames import Frames
from ..devices.network import Network
from .dead_man import DeadManScript
from .drive import SimDrive
from .nodes import SimNodes
from .person import DIRECTIONS, SWITCHES, Deed, Lead, Switch
from .safety_plc import SimSafetyPlc
from .sensor_errors import SensorErrors
from .sensors import Sensors


class Operator(Protocol):
    """The hand on the handle."""

    def take(self) -> None:
        """A person leads it from now on, not the script."""

    def push(self, direction: Sequence[float]) -> None:
        """A person, who has taken it, pushes in a direction (3,)."""

    def lead(self, place: Sequence[float]) -> None:
        """A person, who has taken it, wants it at a place (3,) [m]."""


@dataclass(frozen=True, slots=True)
class Energies:
    """What moves in a plant at a moment, as seen from the room, and what the hand does to it.

    Attributes:
        kinetic: of links, rotors and whatever carries them [J].
        stored: in springs [J].
        potential: in the field of gravity [J].
        hand: power of its force on the machine [W].
        base: power of whatever carries the machine and moves as it is told [W].
    """

    kinetic: float
    stored: float
    potential: float
    hand: float
    base: float = 0.0


class SimPlant(ABC):
    """Advances a whole machine by one period of plant time at a time.

    A machine adds its mechanics in ``_move`` and what its devices measure of them in ``_sense``.

    Attributes:
        nodes: the simulated devices.
        time: plant time [s].
    """

    def __init__(
        self, network: Network, operator: Operator, dead_man: Sequence[tuple[float, bool]], seed: int
    ) -> None:
        """Make the devices of a network; dead_man gives the times at which the switch changes [s]."""
        self.nodes = SimNodes(network)
        self.time = 0.0
        self._operator = operator
        self._random = np.random.default_rng(seed)
        (self._plc,) = self.nodes.of(SimSafetyPlc)
        self._scripts = [DeadManScript(self._plc, Switch.DEAD_MAN, dead_man)]
        self._errors: SensorErrors | None = None

    def spoil(self, sensors: Sensors, seed: int) -> None:
        """From now on the devices measure with errors, which the seed draws."""
        self._errors = SensorErrors(self.nodes.nodes, sensors, seed)
        self._measure()

    def supervise(self, changes: Sequence[tuple[float, bool]]) -> None:
        """A safety operator presses and releases a dead-man switch: times [s], and what from then on."""
        self._scripts.append(DeadManScript(self._plc, Switch.SUPERVISOR, changes))

    def exchange(self, frames_in: Frames, frames_out: Frames) -> None:
        """Let the devices take frames and answer."""
        self.nodes.receive(frames_in, frames_out)

    def step(self, dt: float) -> None:
        """Advance plant time by dt."""
        self._move(dt)
        self.time += dt
        self.nodes.advance(dt)
        self._measure(dt)

    def obey(self, deed: Deed | Lead) -> None:
        """A person acts instead of the script, which lets go of switches and hand for good."""
        for script in self._scripts:
            script.let_go()
        self._operator.take()
        if isinstance(deed, Lead):
            self._operator.lead(deed.place)
        elif deed in DIRECTIONS:
            self._operator.push(DIRECTIONS[deed])
        elif deed in SWITCHES:
            switch, pressed = SWITCHES[deed]
            self._plc.turn(switch, pressed)
        else:
            self._plc.scanner_clear = deed is Deed.LEAVE_FIELD

    @property
    def safe(self) -> bool:
        """Whether every drive is in its safe state: no torque, brake closed."""
        return all(drive.brake for drive in self.nodes.of(SimDrive))

    def _measure(self, dt: float = 0.0) -> None:
        self._sense()
        if self._errors:
            self._errors.spoil(dt)
        for script in self._scripts:
            script.advance(self.time)

    @property
    def hand_power(self) -> float:
        """What the hand gives the handle now [W]; machines whose energies take long have a shorter way."""
        return self.energies().hand

    @abstractmethod
    def energies(self) -> Energies:
        """What moves in it now: tests judge stops by that."""

    @abstractmethod
    def _move(self, dt: float) -> None:
        """Advance the mechanics by dt under what the drives do."""

    @abstractmethod
    def _sense(self) -> None:
        """Give the devices what they would measure now."""
