"""Simulated machines that are not what their controllers believe, and sensors that err."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil
from random import Random
from typing import Any

import msgspec

from ..configs.quantities import (
    ErrorAcceleration,
    ErrorAngle,
    ErrorAngularSpeed,
    ErrorForce,
    ErrorTorque,
)
from ..devices.torque_drive import TorqueDrive
from ..machines.arm.config import ArmConfig
from ..machines.giant.config import GiantConfig
from ..machines.rendering.sections import Plant
from ..machines.telemanipulation.arm import SIDES
from ..machines.telemanipulation.sections import StationSimulation
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.device_check import SENSORS
from ..runtime.core.sections import Config
from ..sim.sensors import (
    AccelerationError,
    AngleError,
    ForceError,
    LoadError,
    RateError,
    Sensors,
    SpeedError,
    TorqueError,
)
from .recorded_joints import FRICTION

MASSES, ROTORS, SPRINGS = 0.2, 0.3, 0.4
"""How far from what the controller believes masses, rotors' inertias and springs are, at most."""
LATE = 1
"""Ticks that drives obey later than it believes."""
FINER = 4 / 3
"""Substeps, times those that are configured: lighter links on stiffer springs swing faster."""
GEAR, LOAD, BEARING = 0.02, 0.05, 0.003
"""Dry friction of a good gear and a good bearing: shares of the effort, of the load, of the effort."""
TYPICAL = Sensors(
    motor_encoder=AngleError(noise=ErrorAngle(1e-5), bias=ErrorAngle(2e-4)),
    motor_speed=SpeedError(noise=ErrorAngularSpeed(2e-3)),
    link_encoder=AngleError(noise=ErrorAngle(1e-5), bias=ErrorAngle(2e-4)),
    load_torque=LoadError(noise=ErrorTorque(0.1), bias=ErrorTorque(0.5), drift=ErrorTorque(0.3), gain=0.02),
    force=ForceError(
        bias=ErrorForce(0.2), drift=ErrorForce(0.2), gain=0.01, coupling=0.005, step=ErrorForce(0.02)
    ),
    torque=TorqueError(
        bias=ErrorTorque(0.02), drift=ErrorTorque(0.02), gain=0.01, coupling=0.005, step=ErrorTorque(1e-3)
    ),
    acceleration=AccelerationError(
        bias=ErrorAcceleration(0.05), drift=ErrorAcceleration(0.02), gain=0.005, coupling=0.005
    ),
    angular_rate=RateError(
        noise=ErrorAngularSpeed(2e-3), bias=ErrorAngularSpeed(5e-3), gain=0.005, coupling=0.005
    ),
)
"""Errors of sensors as such machines have them, after they were calibrated."""


@dataclass(frozen=True, slots=True)
class Doubt:
    """What of a simulated machine may differ from what its controller believes.

    Attributes:
        model: masses, rotors and springs, each joint's own, and a tick of delay; the seed draws them.
        errors: the sensors err as is typical, and the joints rub, where the machine has such a plant.
    """

    model: bool = False
    errors: bool = False

    def fits(self, config: Config) -> bool:
        """Whether the simulation of a machine can be told so."""
        return not self.model or hasattr(config.simulation, "plant")

    def vary(self, config: Config, seed: int) -> Config:
        """The configuration of a machine that differs."""
        simulation: Any = config.simulation
        if self.errors:
            here = {key: getattr(TYPICAL, key) for key, kind in SENSORS.items() if _has(config, kind)}
            simulation = msgspec.structs.replace(simulation, sensors=Sensors(**here))
        if hasattr(simulation, "plant"):
            changes = {**(_model(config, seed) if self.model else {}), **(_friction() if self.errors else {})}
            plant = msgspec.structs.replace(simulation.plant, **changes)
            simulation = msgspec.structs.replace(simulation, plant=plant)
        if self.model:
            section = "arms" if _is_station(config) else str(type(config).__struct_config__.tag)
            own = getattr(simulation, section)
            finer = msgspec.structs.replace(own, substeps=ceil(FINER * own.substeps))
            simulation = msgspec.structs.replace(simulation, **{section: finer})
        return msgspec.structs.replace(config, simulation=simulation)


def own(loaded: Loaded, seed: int) -> Loaded:
    """The same machine, whose joints rub and whose sensors err as is typical; the seed draws the errors."""
    simulation: Any = msgspec.structs.replace(loaded.config.simulation, seed=seed)  # type: ignore[type-var]
    config = msgspec.structs.replace(loaded.config, simulation=simulation)
    return replace(loaded, config=Doubt(errors=True).vary(config, seed))


def believed(loaded: Loaded) -> Loaded:
    """The giant whose simulation is what its controller believes, but for white noise of sensors.

    No dry friction is fed forward, as there is none.
    """
    whole = loaded.config
    assert isinstance(whole, GiantConfig) and whole.simulation
    simulation = msgspec.structs.replace(whole.simulation, plant=Plant(), sensors=None)
    tracking = msgspec.structs.replace(whole.giant.tracking, **dict.fromkeys(FRICTION))
    giant = msgspec.structs.replace(whole.giant, tracking=tracking)
    return replace(loaded, config=msgspec.structs.replace(whole, simulation=simulation, giant=giant))


def _is_station(config: Config) -> bool:
    """Whether it has two arms, with rigid joints."""
    return isinstance(config.simulation, StationSimulation)


def _has(config: Config, kind: type) -> bool:
    return any(isinstance(device, kind) for device in config.devices.values())


def _model(config: Config, seed: int) -> dict[str, Any]:
    """Factors of each joint, of a station the same for both arms, and the delay."""
    random = Random(f"plant {seed}")
    joints = sum(isinstance(device, TorqueDrive) for device in config.devices.values())
    wrong = {"masses": MASSES, "rotor_inertia": ROTORS, "stiffness": SPRINGS}
    if _is_station(config):
        joints //= len(SIDES)
        del wrong["stiffness"]
    elif isinstance(config, ArmConfig) and all(j.stiffness is None for j in config.arm.joints.values()):
        del wrong["stiffness"]
    factors = {
        key: tuple(random.uniform(1.0 - most, 1.0 + most) for _ in range(joints))
        for key, most in wrong.items()
    }
    return {**factors, "delay": LATE}


def _friction() -> dict[str, Any]:
    return {"gear_friction": GEAR, "load_friction": LOAD, "bearing_friction": BEARING}
