"""What a hand feels of the giant's free mass: the admittance at its handle, shaken along all axes at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..machines.giant.config import GiantConfig
from ..machines.giant.plant import GiantPlant
from ..machines.rendering.sections import CartesianTwin
from ..models import Array
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.core.modes import Mode
from ..runtime.live.lockstep import Lockstep, unswept
from ..sim.hold import Hold

AXES = "xyz"
PERIOD = 6.0
"""Of the force [s]: its lines lie on multiples of 1 / PERIOD, and every third one belongs to an axis."""
WANTED = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.5, 8.0, 10.0, 12.5, 15.0, 20.0, 25.0, 30.0)
"""Frequencies [Hz], as far as the lines of an axis allow."""
BEGIN, SETTLED = 4.0, 2.0
"""When the force begins: the machine is engaged; and for how long it is not looked at [s]."""
SPEED, FORCE, FALLING = 0.03, 2.0, 10.0
"""Largest amplitude of the speed of a line [m/s], and of its force [N], which falls beyond a frequency [Hz]:
what springs ask of rotors grows with its square."""
STIFFNESS, DAMPING, STRENGTH = (60.0, 30.0), (8.0, 1.2), (500.0, 50.0)
"""Of the grip that keeps the shaken handle in place, translation and rotation."""
NEAR_DB, NEAR_DEG = 1.0, 10.0
"""What is taken for the twin's own."""


def lines(axis: int) -> Array:
    """Frequencies that the force along an axis has, (k,) [Hz]."""
    first = [round(PERIOD * f) for f in WANTED]
    return np.array([n + (axis - n) % 3 for n in first]) / PERIOD


class Shaker:
    """Holds the handle softly, and adds a periodic force along each axis.

    Attributes:
        gripping: always.
    """

    def __init__(self, mass: float, damping: float) -> None:
        """Of the twin [kg], [N s/m]: it says how far a force moves the handle."""
        self.gripping = True
        self._home: tuple[Array, Array] | None = None
        self._waves = [self._wave(lines(axis), mass, damping) for axis in range(3)]

    @staticmethod
    def _wave(f: Array, mass: float, damping: float) -> tuple[Array, Array, Array]:
        w = 2.0 * np.pi * f
        amplitude = np.minimum(SPEED * np.abs(damping + 1j * w * mass), FORCE * np.minimum(1.0, FALLING / f))
        return w, amplitude, np.pi * np.arange(len(f)) ** 2 / len(f)  # Schroeder's phases: no high peaks

    def take(self) -> None:
        """Nobody leads it."""

    def push(self, direction: Sequence[float]) -> None:
        """Nobody pushes it."""

    def lead(self, place: Sequence[float]) -> None:
        """Nobody leads it."""

    def aim(
        self,
        hold: Hold,
        t: float,
        position: Sequence[float],
        rotation: Array,
        base: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        """See ``Hand``: a soft spring's place, moved so that it pulls with the force."""
        place, orientation = self._home = self._home or (np.array(position), rotation.copy())
        hold.stiffness[:], hold.damping[:], hold.strength[:] = STIFFNESS, DAMPING, STRENGTH
        hold.error[:3], hold.error[3:] = place - position, pin.log3(orientation @ rotation.T)
        if t > BEGIN:
            for axis, (w, amplitude, phase) in enumerate(self._waves):
                hold.error[axis] += amplitude @ np.cos(w * (t - BEGIN) + phase) / STIFFNESS[0]
        hold.rate[:3], hold.rate[3:] = np.negative(base), 0.0


@dataclass(frozen=True, slots=True)
class Felt:
    """Along an axis, at k frequencies [Hz]: speed over force of the handle, and of the twin [m/(N s)]."""

    frequency: Array
    admittance: NDArray[np.complex128]
    twin: NDArray[np.complex128]

    @property
    def gain(self) -> Array:
        """Of the handle over the twin, (k,) [dB]."""
        return np.asarray(20.0 * np.log10(np.abs(self.admittance / self.twin)))

    @property
    def phase(self) -> Array:
        """Of the handle before the twin, (k,) [deg]."""
        return np.asarray(np.degrees(np.angle(self.admittance / self.twin)))

    @property
    def resistance(self) -> Array:
        """Re(F/v), (k,) [N s/m]; where it is negative the handle gives energy."""
        return np.asarray((1.0 / self.admittance).real)

    def true_up_to(self) -> float:
        """Frequency up to which it is within 1 dB and 10 degrees of the twin [Hz]."""
        return self._up_to((np.abs(self.gain) <= NEAR_DB) & (np.abs(self.phase) <= NEAR_DEG))

    def passive_up_to(self, least: float = -10.0) -> float:
        """Frequency up to which Re(F/v) is more than that [Hz]."""
        return self._up_to(self.resistance > least)

    def _up_to(self, good: NDArray[np.bool_]) -> float:
        bad = np.flatnonzero(~good)
        last = bad[0] if bad.size else len(good)
        return float(self.frequency[last - 1]) if last else 0.0


def felt(loaded: Loaded, config: GiantConfig) -> list[Felt]:
    """Shake a giant that renders a free mass.

    Args:
        loaded: the machine.
        config: what of it is changed.

    Returns:
        One an axis.

    Raises:
        RuntimeError: the machine stopped.
    """
    twin = config.giant.twin
    assert isinstance(twin, CartesianTwin)
    lockstep = Lockstep(build(replace(loaded, config=config)))
    plant, dt = lockstep.plant, 1.0 / config.loop.rate
    assert isinstance(plant, GiantPlant)
    plant.hand = Shaker(twin.mass, twin.damping)  # type: ignore[assignment]
    force, speed = [], []
    with unswept():
        for tick in range(round((BEGIN + SETTLED + PERIOD) / dt)):
            lockstep.tick()
            if tick * dt >= BEGIN + SETTLED:
                force.append(plant.arm.hold.wrench[:3].copy())
                speed.append(plant.arm.twist[:3] + np.array([*plant.ppu.velocity, 0.0]))
    if lockstep.mode is not Mode.ACTIVE:
        stop = lockstep.session.cycle.stops.last
        raise RuntimeError(f"the shaken giant stopped: {stop.verdict.detail if stop else lockstep.mode}")
    F, V = np.array(force), np.array(speed)
    found = []
    for axis in range(3):
        w = 2.0 * np.pi * lines(axis)
        wave = np.exp(-1j * np.outer(w, dt * np.arange(len(F))))
        moved = np.asarray((wave @ V[:, axis]) / (wave @ F[:, axis]), np.complex128)
        found.append(
            Felt(lines(axis), moved, np.asarray(1.0 / (twin.damping + 1j * w * twin.mass), np.complex128))
        )
    return found
