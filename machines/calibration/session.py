"""A simulated machine in lockstep, led from pose to pose, and what its force-torque sensors read there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...configs.words import meant
from ...control.ft_calibration import CalibrationError, Fit, Sample, Tool, calibrate, theory
from ...devices.cia301 import SERIAL
from ...devices.force_torque import ForceTorque, ForceTorques
from ...models import Array
from ...runtime.configuration.config import Loaded
from ...runtime.configuration.session import build
from ...runtime.configuration.system import Led, Mount, Rig, find_system
from ...runtime.core.modes import Mode
from ...runtime.live.lockstep import Lockstep, unswept
from ...sim.plant import SimPlant
from .errors import CalibrateError
from .poses import choose

READINGS = 100
"""Of a sample, one a tick."""
SETTLE_S = 0.4
"""From the end of a way until springs and structure no longer swing."""
STARTS_S = 10.0
"""The machine is up by then, or never."""

NO_SENSOR = "no six-axis sensor that it could turn about"


@dataclass(frozen=True, slots=True)
class Taken:
    """What one sensor read in all poses, and what that says.

    Attributes:
        mount: the sensor; serial: its number.
        samples: one a pose.
        gravity: of the base, (3,) [m/s^2].
        fit: the calibration.
    """

    mount: Mount
    serial: int
    samples: tuple[Sample, ...]
    gravity: Array
    fit: Fit

    def expected(self, tilt: float) -> Tool:
        """Standard errors by theory, with a base that is out of level by the angle tilt [rad], as a tool."""
        rotations = np.array([sample.rotation for sample in self.samples])
        return theory(rotations, self.gravity, self.fit.tool, self.fit.scatter, tilt)


def rig_of(loaded: Loaded) -> Rig[Any]:
    """How the machine of a configuration is calibrated.

    Raises:
        ConfigError: the configuration does not fit together.
        CalibrateError: it has nothing to calibrate, or is not simulated.
    """
    session = build(loaded)
    kind = str(type(loaded.config).__struct_config__.tag)
    system = find_system(kind)
    if system.rig is None:
        raise CalibrateError(f"a machine of the kind {kind} has {NO_SENSOR}")
    if loaded.config.simulation is None:
        raise CalibrateError("the configuration has no [simulation]; only a simulated machine is driven")
    rig: Rig[Any] = system.rig(loaded.config, session.robot)
    if not rig.mounts:
        raise CalibrateError(f"a machine of the kind {kind} has {NO_SENSOR}")
    return rig


def run(
    loaded: Loaded,
    count: int,
    seed: int,
    sensor: str | None = None,
    progress: Callable[[int, int, str], None] = lambda *_: None,
) -> list[Taken]:
    """Lead a simulated machine through poses and calibrate its sensors.

    Args:
        loaded: its configuration.
        count: of poses.
        seed: of the poses.
        sensor: name of one of its sensors; None for all of them.
        progress: is told poses that are done, how many there are, and what happens.

    Raises:
        ConfigError: the configuration does not fit together.
        CalibrateError: it has nothing to calibrate, or no such sensor.
        CalibrationError: with what speaks against the samples, or why the machine stopped.
    """
    rig = rig_of(loaded)
    mounts = _named(rig, sensor)
    calm = Loaded(loaded.name, rig.config, loaded.text, loaded.source, loaded.model_text, loaded.model_source)
    session = build(calm, controller=rig.machine)
    progress(0, count, "choosing poses")
    frames = [mount.frame for mount in mounts]
    places, _ = choose(session.robot, frames, rig.start, (rig.lower, rig.upper), rig.inside, count, seed)
    lockstep = Lockstep(session)
    driver = _Driver(lockstep, rig, mounts)
    driver.start()
    taken: list[list[Sample]] = [[] for _ in mounts]
    for i, place in enumerate(places):
        progress(i, len(places), f"pose {i + 1}")
        driver.go(place)
        for samples, sample in zip(taken, driver.sample(), strict=True):
            samples.append(sample)
    progress(len(places), len(places), "fitting")
    return [driver.result(mount, samples) for mount, samples in zip(mounts, taken, strict=True)]


def _named(rig: Rig[Any], sensor: str | None) -> list[Mount]:
    """The sensors that are to be calibrated."""
    known = [mount.device for mount in rig.mounts]
    if sensor is None:
        return list(rig.mounts)
    if sensor not in known:
        raise CalibrateError(f"the machine has no such sensor '{sensor}'; {meant(sensor, known)}")
    return [rig.mounts[known.index(sensor)]]


class _Driver:
    """Ticks the machine until it is where it should be."""

    def __init__(self, lockstep: Lockstep, rig: Rig[Any], mounts: Sequence[Mount]) -> None:
        self._lockstep, self._rig, self._mounts = lockstep, rig, mounts
        session = lockstep.session
        machine: Any = session.cycle.machine
        self._led: Led = machine
        self._rate = session.config.loop.rate
        self._robot, self._sensors = session.robot, ForceTorques(session.cycle.image)

    def start(self) -> None:
        """Until the controller leads the joints."""
        with unswept():
            for _ in range(round((STARTS_S + self._rig.config.arming.fade) * self._rate)):
                self._tick()
                if self._lockstep.mode is Mode.ACTIVE:
                    return
        raise CalibrationError([f"the machine did not start; it is {self._lockstep.mode.name}"])

    def go(self, place: Array) -> None:
        """To a place, and until it stands there."""
        self._led.go(place)
        with unswept():
            while not self._led.arrived:
                self._tick()
            for _ in range(round(SETTLE_S * self._rate)):
                self._tick()

    def sample(self) -> list[Sample]:
        """What each sensor reads now."""
        joints, readings = [], []
        with unswept():
            for _ in range(READINGS):
                self._tick()
                joints.append(list(self._led.position))
                readings.append(self._sensors.wrench.copy())
        q, read = np.array(joints)[:, : self._robot.nv], np.array(readings)
        return [
            Sample.of(self._robot.placement(q.mean(axis=0), mount.frame)[:3, :3], read[:, mount.row], q)
            for mount in self._mounts
        ]

    def result(self, mount: Mount, samples: list[Sample]) -> Taken:
        """The calibration of a sensor."""
        device = self._lockstep.session.config.devices[mount.device]
        assert isinstance(device, ForceTorque)
        gravity = self._robot.model.gravity.linear.copy()
        fit = calibrate(samples, gravity, (device.force, device.torque))
        return Taken(mount, self._serial(mount.device), tuple(samples), gravity, fit)

    def _serial(self, name: str) -> int:
        plant = self._lockstep.plant
        assert isinstance(plant, SimPlant)
        number = plant.nodes[name].objects.read(SERIAL)
        assert isinstance(number, int)
        return number

    def _tick(self) -> None:
        self._lockstep.tick()
        cycle = self._lockstep.session.cycle
        if cycle.mode in (Mode.STOPPING, Mode.HOLDING, Mode.STOPPED, Mode.FAILED):
            said = [str(event) for event in self._lockstep.outputs.events] or [cycle.mode.name]
            raise CalibrationError([f"the machine stopped: {'; '.join(said)}"])
