"""Beyond the paper: how well links follow, with the built-in tracking and with plain PD of the same gains.

The plant rubs, and its sensors err. Three laws: PD of each motor about the commanded link; the same with the
torque that the rigid arm needs by its model; and the built-in one, which also knows its springs, what rubs in
them, and the hand. Links are led along slow sines, for error and vibration, and along lines from 0.5 to 40 Hz
of all joints at once, for the bandwidth, while nobody holds the handle; and the twin is rendered for the hand
of the built-in walk, with each law in its place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import pi
from typing import Any

import msgspec
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..control.excitation import EASE_S, HARMONICS, LOWEST, Excitation
from ..devices.image import ProcessImage
from ..machines.giant.config import GiantConfig
from ..machines.giant.machine import Giant
from ..machines.giant.names import PPU_JOINTS
from ..machines.giant.plant import GiantPlant
from ..machines.giant.rig import LedGiant
from ..machines.rendering.led import let_alone
from ..models import Array, Robot
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.core.modes import Mode
from ..runtime.core.stages import Mark
from ..runtime.live.lockstep import Lockstep, unswept
from . import haptify
from .outcome import COLOURS, LINES, Outcome, Progress, Row
from .own_plant import own

TITLE = "the giant: tracking of its joints beside plain PD"
SEED, MANY = 1, 3
"""Of plant and course; how many a study has."""
CENTRE = (-0.9, 1.4, -0.5, 0.65, 0.5, 0.0)
"""About which the links are led [rad]."""
SLOW_SPEED, SLOW_S = 0.06, 14.0
"""Amplitude of the speed of each slow sine [rad/s], and how long they last [s]."""
PERIOD, WANTED = 6.0, (0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 5.5, 7.5, 10.0, 13.0, 17.0, 22.0, 30.0, 40.0)
"""Period of the lines [s], and about where they lie [Hz]: each joint has every sixth multiple for its own."""
FAST, FAST_SPEED, FAST_S = 0.4, 0.03, 11.0
"""Amplitude of a line: its acceleration, unless its speed would be more than the second; and how long the
lines last [rad/s^2], [rad/s], [s]."""
SHAKES = 10.0
"""Above this frequency the slow sines move nothing [Hz]."""
LEAST_DB, MOST_DEG = -3.0, 45.0
"""A link follows with at least this gain; it is prompt within this phase."""
WALK_S, UP_S, GO_S = 30.0, 6.0, 8.0
"""Of the built-in walk; by when the machine is active, and at the centre [s]."""


class Pd:
    """Torques of a PD law for each motor about its commanded link; with those of the rigid arm if asked."""

    def __init__(self, settings: GiantConfig, robot: Robot, machine: Giant, rigid: bool) -> None:
        tracking, control, joints = settings.giant.tracking, machine.force_control, machine._joints
        self._p, self._d = np.array(tracking.p_gain), np.array(tracking.d_gain)
        self._rotor = np.array(tracking.rotor_inertia) if rigid else None
        self._manipulator = Robot(robot.without(PPU_JOINTS).model.copy())
        self._control, self._motor, self._speed = control, joints.position, joints.velocity
        self.reset()

    def reset(self) -> None:
        """Forget where it was led in the last tick."""
        self._last: tuple[Array, Array] | None = None

    def torque(self, base: Array) -> Array:
        """Of this tick, (6,) [N m], on a base with an acceleration (2,) [m/s^2]."""
        control = self._control
        # what is measured is a tick old
        q, qd = self._last or (control.q, control.qd)
        torque = self._p * (q - self._motor) + self._d * (qd - self._speed)
        self._last = control.q.copy(), control.qd.copy()
        if self._rotor is not None:
            torque = torque + self._rotor * control.qdd + self._rigid(base)
        return torque

    def _rigid(self, base: Array) -> Array:
        control, robot = self._control, self._manipulator
        robot.model.gravity.linear = np.array([-base[0], -base[1], -9.81])
        q = robot.configuration(control.q)
        found: Array = pin.rnea(robot.model, robot.data, q, control.qd, control.qdd)
        return found


class _InPlace(Giant):
    """A giant whose motors obey PD instead of its own law, which goes on beside it."""

    rigid = False

    def __init__(self, settings: GiantConfig, robot: Robot, image: ProcessImage, mark: Mark) -> None:
        super().__init__(settings, robot, image, mark)
        self._law = Pd(settings, robot, self, self.rigid)

    def engage(self) -> None:
        """See ``Machine``."""
        super().engage()
        self._law.reset()

    def _command(self, gain: float) -> None:
        super()._command(gain)
        self.commands[: self.force_control.arm.n] = self._law.torque(self._base).tolist()


class _InPlaceRigid(_InPlace):
    rigid = True


class _LedInPlace(_InPlace, LedGiant):
    pass


class _LedInPlaceRigid(_InPlaceRigid, LedGiant):
    pass


LAWS = {
    "PD": (_InPlace, _LedInPlace),
    "PD with rigid body": (_InPlaceRigid, _LedInPlaceRigid),
    "built in": (Giant, LedGiant),
}
"""Controllers that render, and that lead."""


@dataclass(frozen=True, slots=True)
class Along:
    """Links that were led, in k ticks.

    Attributes:
        led, link: commanded and true positions, (k, 6) [rad].
        acceleration: of the links, (k, 6) [rad/s^2].
    """

    led: Array
    link: Array
    acceleration: Array

    @property
    def error(self) -> Array:
        """RMS of each link's distance from where it is led, (6,) [rad]."""
        return np.asarray(np.sqrt(((self.link - self.led) ** 2).mean(0)))

    def shakes(self, rate: float) -> Array:
        """RMS of each link's acceleration above ``SHAKES``, (6,) [rad/s^2]."""
        columns = self.acceleration.T
        return np.array([haptify.vibration(each[:, None], rate, SHAKES).rms for each in columns])

    def response(self, joint: int, rate: float) -> NDArray[np.complex128]:
        """Link over commanded at the lines of a joint over a whole period, (n,)."""
        t = np.arange(len(self.led)) / rate
        wave = np.exp(-2j * pi * np.outer(lines(joint), t))
        found: NDArray[np.complex128] = (wave @ self.link[:, joint]) / (wave @ self.led[:, joint])
        return found


@dataclass(frozen=True, slots=True)
class Tracked:
    """What a law does.

    Attributes:
        slow, fast: links led along slow sines, and along lines.
        rate: of both [Hz].
        strayed: links from where the twin of the walk leads them, (k, 6) [rad]; none if it did not engage.
        stop: why the machine stopped on the walk, "" where it did not; seconds: of the walk until then.
    """

    slow: Along
    fast: Along
    rate: float
    strayed: Array
    stop: str
    seconds: float

    @property
    def walk(self) -> list[float]:
        """RMS of how far each link strays on the walk, six [rad], or none."""
        return np.sqrt((self.strayed**2).mean(0)).tolist() if len(self.strayed) else []

    def responses(self) -> list[NDArray[np.complex128]]:
        """Of each joint at its lines."""
        return [self.fast.response(i, self.rate) for i in range(len(CENTRE))]


def lines(joint: int) -> Array:
    """Frequencies that a joint has for its own, (n,) [Hz]."""
    count = len(CENTRE)
    first = [round(PERIOD * f) for f in WANTED]
    return np.array(sorted({n + (joint - n) % count for n in first})) / PERIOD


def up_to(frequency: Array, good: NDArray[np.bool_]) -> float:
    """The last of k frequencies before one that is not good [Hz]; 0 without one."""
    bad = np.flatnonzero(~good)
    last = int(bad[0]) if bad.size else len(frequency)
    return float(frequency[last - 1]) if last else 0.0


def gain(response: NDArray[np.complex128]) -> Array:
    """Of a response (k,) [dB]."""
    return np.asarray(20.0 * np.log10(np.abs(response)))


def following(frequency: Array, response: NDArray[np.complex128]) -> tuple[float, float, float]:
    """Up to where a link follows, and is prompt, at k frequencies [Hz]; its highest gain [dB]."""
    level, phase = gain(response), np.degrees(np.angle(response))
    follows, prompt = (up_to(frequency, good) for good in (level > LEAST_DB, np.abs(phase) < MOST_DEG))
    return follows, prompt, float(level.max())


def slow_course(seed: int, dt: float) -> Excitation:
    """All joints along slow sines, their phases drawn."""
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * pi, (len(HARMONICS), len(CENTRE)))
    size = (SLOW_SPEED / (2.0 * pi * LOWEST * HARMONICS))[:, None]
    return Excitation(np.array(CENTRE), np.stack([size * np.sin(phases), size * np.cos(phases)]), SLOW_S, dt)


def fast_course(dt: float) -> Excitation:
    """Each joint along its own lines, all at once, without high peaks."""
    frequency = np.unique(np.concatenate([lines(i) for i in range(len(CENTRE))]))
    waves = np.zeros((2, len(frequency), len(CENTRE)))
    for joint in range(len(CENTRE)):
        own = lines(joint)
        w, k = 2.0 * pi * own, np.arange(len(own))
        size, phase = np.minimum(FAST, FAST_SPEED * w) / w**2, pi * k**2 / len(own)  # Schroeder's
        at = np.searchsorted(frequency, own)
        waves[0, at, joint], waves[1, at, joint] = size * np.sin(phase), size * np.cos(phase)
    return Excitation(np.array(CENTRE), waves, FAST_S, dt, frequency)


def tracked(loaded: Loaded, law: str, seed: int, progress: Progress) -> Tracked:
    """A law on the plant of a seed.

    Raises:
        RuntimeError: the machine whose links are led stopped.
    """
    assert isinstance(loaded.config, GiantConfig)
    rendering, leading = LAWS[law]
    rate = loaded.config.loop.rate
    lockstep = _lockstep(loaded, let_alone(loaded.config), leading, seed)
    with unswept():
        progress(f"plant {seed}, {law}: links led along slow sines")
        _begin(lockstep)
        slow = _along(lockstep, slow_course(seed, 1.0 / rate), EASE_S, SLOW_S - 2.0 * EASE_S)
        progress(f"plant {seed}, {law}: links led along lines")
        fast = _along(lockstep, fast_course(1.0 / rate), EASE_S + 1.0, PERIOD)
        progress(f"plant {seed}, {law}: the built-in walk")
        walking = _lockstep(loaded, loaded.config, rendering, seed)
        strayed, stop = _walked(walking)
    return Tracked(slow, fast, rate, strayed, stop, (walking.inputs.tick + 1) / rate)


def _lockstep(loaded: Loaded, settings: GiantConfig, controller: type[Giant], seed: int) -> Lockstep:
    assert settings.simulation
    simulation = msgspec.structs.replace(settings.simulation, touches={})
    changed = replace(loaded, config=msgspec.structs.replace(settings, simulation=simulation))
    return Lockstep(build(own(changed, seed), controller=controller))


def _until(lockstep: Lockstep, there: Callable[[], bool], seconds: float) -> None:
    for _ in range(round(seconds * lockstep.session.config.loop.rate)):
        lockstep.tick()
        if stop := lockstep.session.cycle.stops.last:
            raise RuntimeError(f"the led machine stopped: {stop.verdict.detail}")
        if there():
            return
    raise RuntimeError(f"the led machine is not there after {seconds:g} s: {lockstep.mode.name}")


def _begin(lockstep: Lockstep) -> None:
    """To the centre."""
    led = lockstep.session.cycle.machine
    assert isinstance(led, LedGiant)
    _until(lockstep, lambda: lockstep.mode is Mode.ACTIVE, UP_S)
    led.go(np.array(CENTRE))
    _until(lockstep, lambda: led.arrived, GO_S)


def _along(lockstep: Lockstep, course: Excitation, begin: float, seconds: float) -> Along:
    """Along a whole course; what is kept of it begins at a time, and lasts [s]."""
    led, plant = lockstep.session.cycle.machine, lockstep.plant
    assert isinstance(led, LedGiant) and isinstance(plant, GiantPlant)
    rows: list[tuple[Array, Array, Array]] = []

    def there() -> bool:
        rows.append((course.q.copy(), plant.arm.q.copy(), plant.arm.qdd.copy()))
        return led.arrived

    led.follow(course)
    _until(lockstep, there, 2.0 * course.seconds)
    first = round(begin / course.dt)
    return Along(*np.moveaxis(np.array(rows[first : first + round(seconds / course.dt)]), 1, 0))


def _walked(lockstep: Lockstep) -> tuple[Array, str]:
    """How far links are from where the twin of the built-in walk leads them, (k, 6) [rad]; why it stopped."""
    cycle, plant = lockstep.session.cycle, lockstep.plant
    machine = cycle.machine
    assert isinstance(machine, Giant) and isinstance(plant, GiantPlant)
    rows = []
    for _ in range(round(WALK_S * lockstep.session.config.loop.rate)):
        led = machine.force_control.q.copy()
        lockstep.tick()
        if cycle.stops.last:
            break
        if cycle.mode is Mode.ACTIVE:
            rows.append(plant.arm.q - led)
    trip = cycle.stops.last
    return np.array(rows).reshape(-1, len(CENTRE)), str(trip.verdict.detail) if trip else ""


def run(progress: Progress) -> Outcome:
    """One plant."""
    return _outcome([SEED], progress)


def study(progress: Progress) -> Outcome:
    """Several plants."""
    return _outcome(list(range(SEED, SEED + MANY)), progress)


def _outcome(seeds: list[int], progress: Progress) -> Outcome:
    loaded = config.load("giant")
    found = {law: [tracked(loaded, law, seed, progress) for seed in seeds] for law in LAWS}
    rows = [row for law, each in found.items() for row in _rows(law, each)]
    figures = {
        law: [
            {
                "error": each.slow.error.tolist(),
                "shakes": each.slow.shakes(each.rate).tolist(),
                "following": [following(lines(i), r) for i, r in enumerate(each.responses())],
                "walk": each.walk,
                "stop": each.stop,
                "seconds": each.seconds,
            }
            for each in of
        ]
        for law, of in found.items()
    }
    return Outcome(rows, figures, partial(_draw, {law: of[0] for law, of in found.items()}), (9.0, 5.0))


def _rows(law: str, of: list[Tracked]) -> list[Row]:
    """Of several plants the worst."""

    def written(values: Sequence[Sequence[float] | Array], unit: float, form: str) -> str:
        known = [np.array(value) for value in values if len(value)]
        return " / ".join(f"{unit * x:{form}}" for x in np.max(known, axis=0)) if known else "-"

    found = np.array([[following(lines(i), r) for i, r in enumerate(each.responses())] for each in of])
    (follows, prompt), peak = found[:, :, :2].min(0).T, found[:, :, 2].max(0)
    stops = [f"it stopped after {each.seconds:.1f} s: {each.stop}" for each in of if each.stop]
    return [
        Row(
            f"{law}: links led along slow sines, RMS error, joints 1 to 6 [mrad]",
            "-",
            written([each.slow.error for each in of], 1e3, ".2f"),
        ),
        Row(
            f"{law}: their acceleration above {SHAKES:g} Hz, RMS, joints 1 to 6 [rad/s^2]",
            "-",
            written([each.slow.shakes(each.rate) for each in of], 1.0, ".3f"),
        ),
        Row(
            f"{law}: links led along lines, gain above {LEAST_DB:g} dB up to, joints 1 to 6 [Hz]",
            "-",
            " / ".join(f"{f:.3g}" for f in follows),
            f"of lines up to {lines(0)[-1]:.3g} Hz; highest gain "
            + " / ".join(f"{g:.1f}" for g in peak)
            + " dB",
        ),
        Row(
            f"{law}: the same, phase within {MOST_DEG:g} degrees up to, joints 1 to 6 [Hz]",
            "-",
            " / ".join(f"{f:.3g}" for f in prompt),
        ),
        Row(
            f"{law}: the built-in walk, RMS error, joints 1 to 6 [mrad]",
            "-",
            written([each.walk for each in of], 1e3, ".2f"),
            "; ".join(stops),
        ),
    ]


def _draw(found: dict[str, Tracked], figure: Any) -> None:
    plots = figure.subplots(2, len(CENTRE), sharex=True, sharey="row")
    for joint in range(len(CENTRE)):
        level, phase = plots[:, joint]
        for (law, each), colour, line in zip(found.items(), COLOURS, LINES, strict=False):
            response = each.fast.response(joint, each.rate)
            shown = {"color": colour, "ls": line, "lw": 1.2}
            level.semilogx(lines(joint), gain(response), label=law, **shown)
            phase.semilogx(lines(joint), np.degrees(np.unwrap(np.angle(response))), **shown)
        level.set_title(f"joint {joint + 1}")
        phase.set_xlabel("frequency [Hz]")
    plots[0, 0].set_ylabel("link over commanded [dB]")
    plots[1, 0].set_ylabel("phase [deg]")
    figure.legend(*plots[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
