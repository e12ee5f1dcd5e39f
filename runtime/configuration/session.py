"""Builds a machine from its configuration: the same way live, in lockstep and in replay."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from ...devices.errors import DeviceError
from ...devices.image import ProcessImage
from ...devices.network import Network
from ...models import ModelError, Robot
from ..core import sections as s
from ..core.cycle import Cycle
from ..core.machine import Machine, MachineLimits, Preparing, UnfitError
from ..core.sections import Config
from ..core.stages import Mark, no_mark
from ..errors import ConfigError, Finding
from .bus import check_bus
from .config import Loaded
from .device_check import check_devices, check_hand_speed, check_sensors, check_simulation
from .system import Plant, System, find_system
from .toml_lines import key_lines, line_of

Controller = Callable[[Any, Robot, ProcessImage, Mark], Machine]


@dataclass(frozen=True, slots=True)
class Session:
    """A machine ready to run.

    Attributes:
        loaded: its configuration.
        network: its devices.
        robot: its model.
        cycle: what it does at each tick, and all that it carries from one to the next.
        system: its kind.
    """

    loaded: Loaded
    network: Network
    robot: Robot
    cycle: Cycle
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
        return _plant(self.loaded, self.system, self.robot, self.network)


def build_plant(loaded: Loaded) -> Plant:
    """The simulated machine of a configuration, without what controls it.

    Raises:
        ConfigError, ModelError: see ``build``; or the configuration has no [simulation].
    """
    system, robot = require_sound(loaded)
    try:
        network = Network(list(loaded.config.devices.values()))
    except DeviceError as error:
        raise _unfit(loaded, "devices", str(error)) from error
    return _plant(loaded, system, robot, network)


def _plant(loaded: Loaded, system: System[Any], robot: Robot, network: Network) -> Plant:
    config = loaded.config
    if config.simulation is None:
        raise ConfigError(
            loaded.source, [Finding(1, "simulation", "is missing", "a simulated bus needs this section")]
        )
    plant: Plant = system.plant(config, robot, network)
    if config.simulation.sensors is not None:
        plant.spoil(config.simulation.sensors, config.simulation.seed)
    if config.simulation.supervisor:
        plant.supervise([(float(press.at), press.pressed) for press in config.simulation.supervisor])
    return plant


def build(
    loaded: Loaded, mark: Mark = no_mark, controller: Controller | None = None, runs: bool = True
) -> Session:
    """Everything that a configuration describes, checked against its model.

    Args:
        loaded: the configuration.
        mark: is told when a stage of a tick ends.
        controller: builds another controller than the machine's own.
        runs: whether the session will; one that only says what a log holds need not be prepared.

    Raises:
        ConfigError: with file and line of everything that does not fit together.
        ModelError: the model must not drive a machine.
    """
    config = loaded.config
    system, robot = require_sound(loaded)
    try:
        network = Network(list(config.devices.values()))
        image = ProcessImage(network)
        machine = (controller or system.machine)(config, robot, image, mark)
        if runs and isinstance(machine, Preparing):
            machine.prepare()
    except DeviceError as error:
        raise _unfit(loaded, "devices", str(error)) from error
    except UnfitError as error:
        raise _unfit(loaded, error.key, error.problem, error.fix) from error
    except ModelError as error:
        raise _unfit(loaded, "model", str(error)) from error
    return Session(loaded, network, robot, Cycle(config, image, machine, mark), system)


def _unfit(loaded: Loaded, key: str, problem: str, fix: str = "") -> ConfigError:
    return ConfigError(loaded.source, [Finding(line_of(key, key_lines(loaded.text)), key, problem, fix)])


def require_sound(loaded: Loaded) -> tuple[System[Any], Robot]:
    """Kind and model of a machine whose configuration fits together; the machine itself is not built.

    Raises:
        ConfigError, ModelError: see ``build``.
    """
    config = loaded.config
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    system: System[Any] = find_system(str(type(config).__struct_config__.tag))
    checks = (_check_loop, _check_hand, check_devices, check_simulation, check_hand_speed, check_sensors)
    common = [found for check in checks for found in check(config)] + check_bus(config.bus)
    _require(loaded, common + system.check(config, robot))
    _require(loaded, _check_touches(config, system.limits(config)))
    return system, robot


def remarks(loaded: Loaded) -> list[str]:
    """What people should know of a configuration, though nothing is wrong with it."""
    system: System[Any] = find_system(str(type(loaded.config).__struct_config__.tag))
    if not system.remarks:
        return []
    return system.remarks(loaded.config, Robot.from_urdf(loaded.model_text, loaded.model_source))


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
"""Distance of a hard limit behind the controller's [rad or m]: further out it would not limit anything."""


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
        if margin is not None and not 0.0 < margin <= LARGEST_MARGIN:
            fix = f"give more than 0 and at most {LARGEST_MARGIN:g}"
            found.append((f"safety.{name}", f"{margin:g} is not a margin", fix))
    simulated = isinstance(config.bus, s.SimulatedBus)
    if not simulated and config.loop.on_overrun != "stop":
        found.append(("loop.on_overrun", "a real bus must stop on overruns", 'write "stop"'))
    if not simulated and config.arming.by == "dead-man":
        fix = 'write "command", or "supervisor"'
        found.append(("arming.by", "a real machine must not arm by itself", fix))
    if config.simulation and config.simulation.supervisor and config.arming.by != "supervisor":
        problem = "nobody asks the safety operator's dead-man switch"
        found.append(("simulation.supervisor", problem, 'remove it, or write by = "supervisor" in [arming]'))
    if config.loop.sync == "bus" and isinstance(config.bus, s.PythonCanBus):
        found.append(("loop.sync", "python-can gives no arrival times", 'write "free", or use socketcan'))
    if config.arming.fade < 3.0:
        found.append(("arming.fade", f"{config.arming.fade:g} s is too sudden", 'write at least "3 s"'))
    return found


def _check_hand(config: Config) -> list[tuple[str, str, str]]:
    if config.simulation is None:
        return []
    hand, supervisor = config.simulation.hand, config.simulation.supervisor or ()
    found = []
    for name, entries in (
        ("hand.path", hand.path),
        ("hand.dead_man", hand.dead_man),
        ("supervisor", supervisor),
    ):
        times = [float(entry.at) for entry in entries]
        if any(after <= before for before, after in pairwise(times)):
            problem = "its times do not rise"
            found.append((f"simulation.{name}", problem, "order the entries by their time"))
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
