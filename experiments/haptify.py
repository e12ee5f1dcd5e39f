"""The measurements of Haptify on a simulated giant: what a hand feels, as instruments outside it would tell.

Nothing here is a reading of the machine: force, motion and acceleration are those of the simulated plant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any

import msgspec
import numpy as np

from ..machines.giant.config import GiantConfig
from ..machines.giant.plant import GiantPlant
from ..models import Array
from ..runtime.configuration.config import Loaded, with_twin
from ..runtime.configuration.session import build
from ..runtime.core.modes import Mode
from ..runtime.live.lockstep import Lockstep, unswept
from .own_plant import Doubt

BEGIN_S = 4.0
"""By then the machine is engaged, and the hand begins to move."""
Place = Sequence[float]
"""Position of the handle [m] and yaw, tilt and roll [rad], six numbers."""
Way = Sequence[tuple[float, Place]]
"""Times after the beginning [s], and places."""


@dataclass(frozen=True, slots=True)
class Felt:
    """What became of the handle in k ticks, in the room's axes.

    Attributes:
        t: since the hand began to move, (k,) [s].
        position, velocity, acceleration: of the handle, (k, 3) [m, s].
        spin, spin_rate: angular velocity and acceleration, (k, 3) [rad, s].
        force, torque: of the hand on the handle, (k, 3) [N], [N m].
        strayed: links from where they are led, (k, 6) [rad].
        stop: why the machine stopped, "" where it did not.
    """

    t: Array
    position: Array
    velocity: Array
    acceleration: Array
    spin: Array
    spin_rate: Array
    force: Array
    torque: Array
    strayed: Array
    stop: str

    def part(self, begin: float, end: float) -> Felt:
        """What lies between two times [s]."""
        chosen = (self.t >= begin) & (self.t < end)
        names = [name for name in self.__slots__ if name != "stop"]
        return replace(self, **{name: getattr(self, name)[chosen] for name in names})


def slider(mass: float, inertia: float, damping: float, turning: float, stiffness: float | None) -> str:
    """A twin's file: three slides, the first of them upright, and a wrist; it weighs alike in all directions.

    Args:
        mass: [kg].
        inertia: [kg m^2].
        damping: [N s/m].
        turning: damping of the wrist [N m s/rad].
        stiffness: of a spring along the upright slide [N/m]; None for a hard floor where it begins.
    """
    floor = (
        'range = "0 0.3 m"' if stiffness is None else f'range = "-0.3 0.3 m"\nstiffness = "{stiffness:g} N/m"'
    )
    open_ = 'range = "-2 2 m"'
    slides = [("up", "0 deg", floor), ("left", "90 deg", open_), ("ahead", "0 deg", open_)]
    turns = [("pitch", "0 deg"), ("roll", "90 deg"), ("yaw", "0 deg")]
    lines = ["[twin]", 'kind = "chain"', 'least_mass = "0 kg"', 'least_inertia = "0 kg m^2"']
    for name, theta, extra in slides:
        lines += [f"[twin.joints.{name}]", 'type = "prismatic"', 'start = "0 m"', 'velocity = "3 m/s"']
        lines += ['acceleration = "60 m/s^2"', f'inertia = "{mass:g} kg"', f'damping = "{damping:g} N s/m"']
        lines += [f'dh = {{ theta = "{theta}", alpha = "90 deg" }}', extra]
    for name, theta in turns:
        lines += [f"[twin.joints.{name}]", 'type = "revolute"', 'start = "0 rad"', 'velocity = "8 rad/s"']
        lines += ['acceleration = "200 rad/s^2"', 'range = "-1.2 1.2 rad"']
        lines += [f'inertia = "{inertia:g} kg m^2"', f'damping = "{turning:g} N m s/rad"']
        lines += [f'dh = {{ theta = "{theta}", alpha = "90 deg" }}']
    return "\n".join(lines) + "\n"


def with_slider(loaded: Loaded, stiffness: float | None) -> Loaded:
    """The giant with a floor or a spring under the handle; mass and damping are those of its free mass."""
    config = loaded.config
    assert isinstance(config, GiantConfig)
    free: Any = config.giant.twin
    text = slider(free.mass, free.inertia, free.damping, free.rotational_damping, stiffness)
    return with_twin(loaded, "slider.toml", text, PurePath())


def first_place(loaded: Loaded) -> Place:
    """Where the simulated giant's handle begins."""
    config = loaded.config
    assert isinstance(config, GiantConfig) and config.simulation
    first = config.simulation.hand.path[0]
    return [*first.position, *first.angles]


def felt(
    loaded: Loaded, way: Way, seed: int, doubt: Doubt, progress: Callable[[str], None], strength: float
) -> Felt:
    """A session in lockstep in which the hand goes a way; it ends where the way does, or at a stop.

    Args:
        loaded: the giant.
        way: of the hand; it must begin where the handle does, at 0 s.
        seed: draws plant and sensors' errors.
        doubt: how the plant differs from what the controller believes.
        progress: is told how far it is.
        strength: largest force of the hand [N].
    """
    config = loaded.config
    assert isinstance(config, GiantConfig) and config.simulation
    hand = config.simulation.hand
    first: Any = hand.path[0]
    path = [
        msgspec.structs.replace(first, at=type(first.at)(t), position=tuple(p[:3]), angles=tuple(p[3:]))
        for t, p in _held(way)
    ]
    moved = msgspec.structs.replace(hand, path=tuple(path), away=None, force=type(hand.force)(strength))
    simulation = msgspec.structs.replace(config.simulation, hand=moved, seed=seed, touches={})
    varied = doubt.vary(msgspec.structs.replace(config, simulation=simulation), seed)
    with unswept():
        return _watched(Lockstep(build(replace(loaded, config=varied))), BEGIN_S + way[-1][0], progress)


def _held(way: Way) -> Way:
    """At rest at its first place until the machine is engaged: a spline swings a little before it leaves."""
    first = way[0][1]
    still = [(t, first) for t in (0.0, *(BEGIN_S - 0.1 * i for i in (3, 2, 1)))]
    return [*still, *((BEGIN_S + t, place) for t, place in way)]


def _watched(lockstep: Lockstep, seconds: float, progress: Callable[[str], None]) -> Felt:
    plant, cycle, rate = lockstep.plant, lockstep.session.cycle, lockstep.session.config.loop.rate
    assert isinstance(plant, GiantPlant)
    machine: Any = cycle.machine
    arm, ppu, control = plant.arm, plant.ppu, machine.force_control
    rows: list[Array] = []
    for tick in range(round(seconds * rate)):
        led = control.q.copy()
        lockstep.tick()
        if cycle.stops.last or cycle.mode is Mode.FAILED:
            break
        if tick >= BEGIN_S * rate:
            row = np.concatenate([arm.position, arm.twist, arm.acceleration, arm.hold.wrench, arm.q - led])
            for i in range(2):
                row[i] += ppu.position[i]
                row[3 + i] += ppu.velocity[i]
                row[9 + i] += ppu.acceleration[i]
            rows.append(row)
        if tick % 2000 == 0:
            progress(f"{tick / rate:.0f} of {seconds:.0f} s")
    trip = cycle.stops.last
    table = np.array(rows).reshape(-1, 27)
    position, velocity, spin, acceleration, spin_rate, force, torque = (
        table[:, 3 * i : 3 * i + 3] for i in range(7)
    )
    t = np.arange(len(table)) / rate
    stop = str(trip.verdict.detail) if trip else "" if cycle.mode is not Mode.FAILED else "it did not start"
    return Felt(t, position, velocity, acceleration, spin, spin_rate, force, torque, table[:, 21:], stop)


def size(vectors: Array) -> Array:
    """Lengths of vectors (k, 3), (k,)."""
    return np.asarray(np.linalg.norm(vectors, axis=1))


@dataclass(frozen=True, slots=True)
class Vibration:
    """What shakes the handle above a frequency.

    Attributes:
        rms: of the three axes together [m/s^2].
        centroid: of their amplitude spectra [Hz].
        frequency, density: the spectrum, (n,) [Hz], [(m/s^2)^2/Hz].
    """

    rms: float
    centroid: float
    frequency: Array
    density: Array


def vibration(acceleration: Array, rate: float, above: float, window: int = 2000) -> Vibration:
    """Welch's spectrum of an acceleration (k, 3) at a rate [Hz], axes added by power, above a frequency [Hz].

    Hann windows that overlap by half; a sine shows the RMS that it has.
    """
    if len(acceleration) < window:
        raise ValueError(f"a spectrum needs {window} samples, not {len(acceleration)}")
    hann = np.hanning(window)[:, None]
    parts = []
    for begin in range(0, len(acceleration) - window + 1, window // 2):
        part = acceleration[begin : begin + window]
        parts.append(np.abs(np.fft.rfft((part - part.mean(0)) * hann, axis=0)) ** 2)
    density = 2.0 * np.mean(parts, axis=0).sum(1) / (rate * float((hann**2).sum()))
    frequency = np.fft.rfftfreq(window, 1.0 / rate)
    high = frequency >= above
    amplitude = np.sqrt(density[high])
    rms = float(np.sqrt(density[high].sum() * rate / window))
    centroid = float((frequency[high] * amplitude).sum() / amplitude.sum())
    return Vibration(rms, centroid, np.asarray(frequency[high], float), density[high])


def inertia_and_damping(effort: Array, acceleration: Array, velocity: Array) -> tuple[float, float, float]:
    """Least squares of effort = inertia x acceleration + damping x velocity + constant, (k,) each.

    Returns:
        Inertia, damping, and the RMS of what they leave of the effort.
    """
    A = np.stack([acceleration, velocity, np.ones_like(effort)], axis=1)
    found, *_ = np.linalg.lstsq(A, effort, rcond=None)
    rest = effort - A @ found
    return float(found[0]), float(found[1]), float(np.sqrt((rest**2).mean()))


def stiffness(force: Array, displacement: Array) -> float:
    """Slope of a force over a displacement, (k,) each [N/m]."""
    return float(np.polyfit(displacement, force, 1)[0])
