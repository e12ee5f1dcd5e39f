"""Builds a machine from its configuration: the same way live, in lockstep and in replay."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Generic, Protocol, TypeVar

from ..devices import drive, force_torque, imu, safety_plc
from ..devices.device import Device
from ..devices.errors import DeviceError
from ..devices.frames import Frames
from ..devices.image import ProcessImage
from ..devices.network import Network
from ..models import ModelError, Robot
from ..sim.person import Deed
from . import sections as s
from .bus import check_bus
from .config import Loaded
from .cycle import Memory
from .device_check import check_encoders, check_hand_speed, check_simulation
from .errors import ConfigError, Finding
from .giant.check import check_giant
from .giant.config import GiantConfig
from .giant.figures import GiantFigures
from .giant.limits import GiantLimits
from .giant.machine import Giant
from .giant.plant import giant_plant
from .machine import Machine, MachineFigures, MachineLimits
from .rhi.check import check_rhi
from .rhi.config import RhiConfig
from .rhi.figures import RhiFigures
from .rhi.limits import RhiLimits
from .rhi.machine import RedundantInterface
from .rhi.plant import rhi_plant
from .sections import Config
from .stages import Mark, no_mark
from .toml_lines import key_lines, line_of


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

    def obey(self, deed: Deed) -> None:
        """A person acts instead of the script."""


C = TypeVar("C", bound=Config)


@dataclass(frozen=True, slots=True)
class System(Generic[C]):
    """What a kind of machine brings along.

    Attributes:
        machine: builds its controller.
        limits: what a session may touch.
        figures: what people see of it besides.
        plant: builds its simulation.
        check: findings (key, problem, fix) that only the model can tell.
    """

    machine: Callable[[C, Robot, ProcessImage, Mark], Machine]
    limits: Callable[[C], MachineLimits]
    figures: Callable[[], MachineFigures]
    plant: Callable[[C, Robot, Network], Plant]
    check: Callable[[C, Robot], list[tuple[str, str, str]]]


SYSTEMS: dict[type[Config], System[Any]] = {
    GiantConfig: System(Giant, GiantLimits, GiantFigures, giant_plant, check_giant),
    RhiConfig: System(RedundantInterface, RhiLimits, RhiFigures, rhi_plant, check_rhi),
}


@dataclass(frozen=True, slots=True)
class Session:
    """A machine ready to run.

    Attributes:
        loaded: its configuration.
        network: its devices.
        robot: its model.
        memory: of the cycle.
        system: its kind.
    """

    loaded: Loaded
    network: Network
    robot: Robot
    memory: Memory
    system: System[Any]

    @property
    def config(self) -> Config:
        """The checked configuration."""
        return self.loaded.config

    def plant(self) -> Plant:
        """The simulated machine.

        Raises:
            ConfigError: the configuration has no [simulation].
        """
        if self.config.simulation is None:
            raise ConfigError(
                self.loaded.source,
                [Finding(1, "simulation", "is missing", "a simulated bus needs this section")],
            )
        return self.system.plant(self.config, self.robot, self.network)


def build(loaded: Loaded, mark: Mark = no_mark) -> Session:
    """Everything that a configuration describes, checked against its model.

    Raises:
        ConfigError: with file and line of everything that does not fit together.
        ModelError: the model must not drive a machine.
    """
    config = loaded.config
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    system = SYSTEMS[type(config)]
    checks = (_check_loop, _check_hand, check_encoders, check_simulation, check_hand_speed)
    common = [found for check in checks for found in check(config)] + check_bus(config.bus)
    _require(loaded, common + system.check(config, robot))
    _require(loaded, _check_touches(config, system.limits(config)))
    try:
        network = Network([_device(name, device) for name, device in config.devices.items()])
        image = ProcessImage(network)
        machine = system.machine(config, robot, image, mark)
    except DeviceError as error:
        lines = key_lines(loaded.text)
        raise ConfigError(
            loaded.source, [Finding(line_of("devices", lines), "devices", str(error), "")]
        ) from error
    except ModelError as error:
        raise ConfigError(loaded.source, [Finding(0, "model", str(error), "")]) from error
    return Session(loaded, network, robot, Memory(config, image, machine, mark), system)


def fingerprint(session: Session) -> dict[str, str]:
    """Hashes of what a recording depends on: configuration, model, and the layout of the process image."""
    network = session.network
    layout = "\n".join(network.field_at(i) for i in range(network.raw_size))
    return {
        "config": _hash(session.loaded.text),
        "model": _hash(session.loaded.model_text),
        "layout": _hash(layout),
    }


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _require(loaded: Loaded, found: list[tuple[str, str, str]]) -> None:
    if found:
        lines = key_lines(loaded.text)
        raise ConfigError(
            loaded.source, [Finding(line_of(key, lines), key, problem, fix) for key, problem, fix in found]
        )


RATES = (200.0, 8000.0)
"""Slower, the walls of a haptic interface feel like rubber; faster, no bus and no solver follows [Hz]."""
LONGEST_STOP_S = 1.0
LARGEST_MARGIN = 0.2
"""Of a hard limit behind the controller's [rad or m]: more would be no limit."""


def _check_loop(config: Config) -> list[tuple[str, str, str]]:
    """What the parts of a configuration that every machine has must fulfil together."""
    found = []
    loop, safety = config.loop, config.safety
    if not RATES[0] <= loop.rate <= RATES[1]:
        found.append(("loop.rate", f"{loop.rate:g} Hz", f"give {RATES[0]:g} to {RATES[1]:g} Hz"))
    if loop.spin is not None and loop.spin > 0.5 / loop.rate:
        found.append(("loop.spin", f"{loop.spin:g} s is more than half a period", 'write e.g. "60 us"'))
    if safety.stop_time > LONGEST_STOP_S:
        found.append(("safety.stop_time", f"{safety.stop_time:g} s", f"give at most {LONGEST_STOP_S:g} s"))
    for name in (field for field in safety.__struct_fields__ if field.endswith("_margin")):
        margin = getattr(safety, name)
        if not 0.0 < margin <= LARGEST_MARGIN:
            fix = f"give more than 0 and at most {LARGEST_MARGIN:g}"
            found.append((f"safety.{name}", f"{margin:g} is no margin", fix))
    simulated = isinstance(config.bus, s.SimulatedBus)
    if not simulated and config.loop.on_overrun != "stop":
        found.append(("loop.on_overrun", "a real bus must stop on overruns", 'write "stop"'))
    if not simulated and config.arming.by != "command":
        found.append(("arming.by", "a real machine must not arm by itself", 'write "command"'))
    if config.loop.sync == "bus" and isinstance(config.bus, s.PythonCanBus):
        found.append(("loop.sync", "python-can gives no arrival times", 'write "free", or use socketcan'))
    if config.arming.fade < 3.0:
        found.append(("arming.fade", f"{config.arming.fade:g} s is too sudden", 'write at least "3 s"'))
    return found


def _check_hand(config: Config) -> list[tuple[str, str, str]]:
    if config.simulation is None:
        return []
    hand = config.simulation.hand
    found = []
    for name, entries in (("path", hand.path), ("dead_man", hand.dead_man)):
        times = [float(entry.at) for entry in entries]
        if any(after <= before for before, after in pairwise(times)):
            problem = "its times do not rise"
            found.append((f"simulation.hand.{name}", problem, "order the entries by their time"))
    return found


def _check_touches(config: Config, limits: MachineLimits) -> list[tuple[str, str, str]]:
    """A limit that is to be touched must exist."""
    known = [spec.name for spec in limits.specs]
    touches = config.simulation.touches if config.simulation else {}
    return [
        ("simulation.touches", f"the machine has no limit '{name}'", f"known: {', '.join(known)}")
        for name in touches
        if name not in known
    ]


def _device(name: str, device: s.Device) -> Device:
    match device:
        case s.JointDrive():
            return drive.JointDrive(
                name=name,
                node=device.node,
                counts_per_turn=device.counts_per_turn,
                gear_ratio=device.gear_ratio,
                link_counts_per_turn=device.link_counts_per_turn,
                rated_torque=float(device.rated_torque),
            )
        case s.AxisDrive():
            return drive.AxisDrive(name=name, node=device.node, counts_per_metre=device.counts_per_metre)
        case s.ForceTorque():
            return force_torque.ForceTorque(
                name=name, node=device.node, force=float(device.force), torque=float(device.torque)
            )
        case s.Imu():
            return imu.Imu(name=name, node=device.node, acceleration=float(device.acceleration))
        case s.SafetyPlc():
            return safety_plc.SafetyPlc(name=name, node=device.node)
