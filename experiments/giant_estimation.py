"""Speeds and accelerations of the giant's links: differences, Kalman filters, these with the handle's IMU."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np

from ..control.joint_kalman import JointKalman
from ..devices.torque_drive import JointDrives
from ..machines.giant.config import GiantConfig
from ..machines.giant.machine import Giant
from ..machines.giant.names import JOINTS
from ..machines.giant.parts import joint_kalman
from ..machines.giant.plant import GiantPlant
from ..models import Array, Robot
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.core.modes import Mode
from ..runtime.live.lockstep import Lockstep
from .outcome import COLOURS, ExperimentError, Outcome, Progress, Row
from .own_plant import Doubt

TITLE = "the giant: speeds and accelerations of its links, estimated"
SECONDS = 12.0
SETTLED_S = 1.0
"""Left out after the machine is engaged."""
FIRST, PLANTS = 21, 2
"""Seeds of the sessions; the filters were tuned on others."""
COARSE = 65536
"""Counts a turn of a link's encoder like that of the motor, of which 10 urad are believed."""
LOW_PASS_S = 7e-3
LATENCY = 2
"""So many ticks ago what a tick reads was true: it was latched by the tick before."""
FAST, JUDGED = 5.0, 10.0
"""What is fast, and what a delay is judged by [Hz]."""
QUANTITIES = ("speed", "acceleration")
STRONG, WRIST = slice(0, 4), slice(4, 6)


@dataclass(frozen=True, slots=True)
class Walk:
    """What was measured of the links of a session, and what was true; k ticks from the engagement on.

    Attributes:
        measured: motors' angles and speeds, links' angles, torques of the springs, (4, k, 6) [rad, s, N m].
        told: torque of each motor on the way to these, (k, 6) [N m].
        estimated, true: speeds and accelerations of the links, (2, k, 6) [rad/s, rad/s^2].
        dt: of a tick [s].
    """

    measured: Array
    told: Array
    estimated: Array
    true: Array
    dt: float


def coarse(settings: GiantConfig) -> GiantConfig:
    """Encoders of the links that have fewer counts."""
    drives = {name: settings.devices[name] for name in JOINTS}
    few = {name: msgspec.structs.replace(each, link_counts_per_turn=COARSE) for name, each in drives.items()}
    return msgspec.structs.replace(settings, devices={**settings.devices, **few})


CASES: dict[str, tuple[Doubt, Callable[[GiantConfig], GiantConfig]]] = {
    "the built-in plant": (Doubt(), lambda settings: settings),
    "other masses, rotors, springs": (Doubt(model=True, errors=True), lambda settings: settings),
    "also coarse encoders": (Doubt(model=True, errors=True), coarse),
}
"""How the plant differs from what is believed."""


def walk(loaded: Loaded, settings: GiantConfig, seconds: float) -> Walk:
    """A session of the giant with its estimator.

    Raises:
        ExperimentError: the machine stopped, or was not engaged for long enough.
    """
    built = build(replace(loaded, config=settings))
    lockstep, machine = Lockstep(built), built.cycle.machine
    plant, joints = lockstep.plant, JointDrives(built.cycle.image)
    assert isinstance(machine, Giant) and isinstance(plant, GiantPlant) and machine.kalman
    kalman, arm = machine.kalman, plant.arm
    sources = joints.position, joints.velocity, joints.link_position, joints.load_torque
    rows: list[list[Array]] = []
    active: list[bool] = []

    def keep() -> None:
        now = *sources, joints.target_torque, kalman.link_rate, kalman.link_acceleration, arm.qd, arm.qdd
        rows.append([array.copy() for array in now])
        active.append(lockstep.mode is Mode.ACTIVE)

    lockstep.run(round(seconds * settings.loop.rate), keep)
    first = active.index(True) if True in active else len(active)
    if not all(active[first:]) or len(active) - first < 2.0 * SETTLED_S * settings.loop.rate:
        raise ExperimentError(f"the giant was not moved by its hand for long enough: {lockstep.mode.name}")
    every = np.array(rows).transpose(1, 0, 2)
    then = slice(first - LATENCY, -LATENCY)
    here = every[:, first:]
    return Walk(here[:4], every[4, then], here[5:7], every[7:, then], 1.0 / settings.loop.rate)


def low_passed(values: Array, dt: float) -> Array:
    """Behind a low-pass of first order, (k, 6)."""
    out, share = np.empty_like(values), 1.0 - np.exp(-dt / LOW_PASS_S)
    now = values[0]
    for k, value in enumerate(values):
        now = now + share * (value - now)
        out[k] = now
    return out


def differences(walked: Walk, smooth: Callable[[Array, float], Array]) -> Array:
    """Speeds and accelerations, (2, k, 6), by differences of the encoders and of those."""
    angle, dt = walked.measured[2], walked.dt
    rate = smooth(np.diff(angle, axis=0, prepend=angle[:1]) / dt, dt)
    return np.stack([rate, smooth(np.diff(rate, axis=0, prepend=rate[:1]) / dt, dt)])


def alone(walked: Walk, settings: GiantConfig, arm: Robot) -> Array:
    """Speeds and accelerations, (2, k, 6), by the joints' own filters."""
    sources = np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(6)
    kalman: JointKalman = joint_kalman(settings, arm, sources, walked.dt)
    found = np.zeros_like(walked.estimated)
    for k, told in enumerate(walked.told):
        for source, measured in zip(sources, walked.measured, strict=True):
            source[:] = measured[k]
        if k:
            kalman.update(told)
        else:
            kalman.reset()
        found[:, k] = kalman.link_rate, kalman.link_acceleration
    return found


def passed(values: Array, dt: float, least: float, most: float) -> Array:
    """What of (k, 6) lies between two frequencies [Hz]."""
    spectrum, frequency = np.fft.rfft(values, axis=0), np.fft.rfftfreq(len(values), dt)
    spectrum[(frequency < least) | (frequency >= most)] = 0.0
    return np.asarray(np.fft.irfft(spectrum, len(values), axis=0))


def judge(found: Array, walked: Walk) -> dict[str, Array]:
    """Errors of speeds and accelerations, RMS of each joint, (6,), and by how much they are late [ms]."""
    late, dt = slice(round(SETTLED_S / walked.dt), None), walked.dt
    figures = {}
    for name, estimate, true in zip(QUANTITIES, found[:, late], walked.true[:, late], strict=True):
        error = estimate - true
        off = passed(error, dt, 0.0, JUDGED)
        slope = passed(np.gradient(true, dt, axis=0), dt, 0.0, JUDGED)
        figures[name] = np.sqrt((error**2).mean(0))
        figures[f"fast {name}"] = np.sqrt((passed(error, dt, FAST, np.inf) ** 2).mean(0))
        figures[f"{name} late"] = -1e3 * (off * slope).sum(0) / (slope**2).sum(0)
    return figures


def measure(loaded: Loaded, doubt: Doubt, change: Callable[[GiantConfig], GiantConfig], seed: int) -> Any:
    """Figures of ``judge`` by the way of estimating."""
    settings = loaded.config
    assert isinstance(settings, GiantConfig) and settings.simulation
    tracking = msgspec.structs.replace(settings.giant.tracking, estimation="kalman")
    simulation = msgspec.structs.replace(settings.simulation, seed=seed)
    giant = msgspec.structs.replace(settings.giant, tracking=tracking)
    varied = doubt.vary(msgspec.structs.replace(settings, giant=giant, simulation=simulation), seed)
    assert isinstance(varied, GiantConfig)
    varied = change(varied)
    walked = walk(loaded, varied, SECONDS)
    arm = Robot.from_urdf(loaded.model_text, loaded.model_source).without(["ppu_x", "ppu_y"])
    ways = {
        "differences": differences(walked, lambda values, dt: values),
        "low-passed": differences(walked, low_passed),
        "Kalman": alone(walked, varied, arm),
        "with IMU": walked.estimated,
    }
    return {name: judge(found, walked) for name, found in ways.items()}


def run(progress: Progress) -> Outcome:
    """Each plant, by each way, in some sessions."""
    loaded, figures = config.load("giant"), {}
    for name, (doubt, change) in CASES.items():
        several = []
        for seed in range(FIRST, FIRST + PLANTS):
            progress(f"{name}, seed {seed}")
            several.append(measure(loaded, doubt, change, seed))
        figures[name] = {way: _mean([each[way] for each in several]) for way in several[0]}
    rows = [row for name, ways in figures.items() for row in _rows(name, ways)]

    def draw(figure: Any) -> None:
        plots = figure.subplots(1, 2)
        ways = next(iter(figures.values()))
        shown = {way: ways[way] for way in ways if way != "differences"}
        for plot, quantity, unit in zip(plots, QUANTITIES, ("mrad/s", "mrad/s^2"), strict=True):
            for k, ((way, found), colour) in enumerate(zip(shown.items(), COLOURS, strict=False)):
                values = 1e3 * np.array(found[quantity])
                plot.bar(np.arange(6) + 0.27 * k, values, 0.25, color=colour, label=way)
            plot.set_yscale("log")
            plot.set_xticks(np.arange(6) + 0.27, [str(i + 1) for i in range(6)])
            plot.set_xlabel("joint")
            plot.set_ylabel(f"RMS error of the {quantity} [{unit}]")
            plot.legend(fontsize=8)

    return Outcome(rows, figures, draw, (9.0, 4.0))


def _mean(several: list[dict[str, Array]]) -> dict[str, list[float]]:
    return {key: np.mean([each[key] for each in several], axis=0).tolist() for key in several[0]}


def _rows(name: str, ways: dict[str, dict[str, list[float]]]) -> list[Row]:
    rows = []
    for way, found in ways.items():
        late = [f"{_joints(found[f'{quantity} late'], 1.0)} ms late" for quantity in QUANTITIES]
        fast = f"above {FAST:g} Hz {_joints(found['fast acceleration'], 1.0)}"
        what, speed = f"{name}; {way}: error of", _joints(found["speed"], 1e3)
        acceleration = _joints(found["acceleration"], 1.0)
        rows += [
            Row(f"{what} speeds, joints 1 to 6, RMS [mrad/s]", "-", speed, late[0]),
            Row(f"{what} accelerations, RMS [rad/s^2]", "-", acceleration, f"{late[1]}; {fast}"),
        ]
    return rows


def _joints(values: list[float], scale: float) -> str:
    return " / ".join(f"{scale * value:.2g}" for value in values)
