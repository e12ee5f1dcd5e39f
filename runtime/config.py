"""Machine configurations: TOML with units, checked so that nothing half-right reaches a machine."""

from __future__ import annotations

import difflib
import re
import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from .errors import ConfigError, Finding
from .quantities import (
    Acceleration,
    Angle,
    AngleLimits6,
    Angles,
    Angles2,
    Angles3,
    Angles6,
    AngularAcceleration,
    AngularAccelerations,
    AngularAccelerations6,
    AngularDamping,
    AngularDampings,
    AngularDampings6,
    AngularSpeed,
    AngularSpeeds,
    AngularSpeeds6,
    AngularStiffness,
    AngularStiffnesses,
    AngularStiffnesses6,
    Damping,
    Duration,
    Force,
    Frequency,
    Inertia,
    Inertias,
    Inertias3,
    Inertias6,
    Instant,
    Length,
    Lengths,
    Lengths2,
    Lengths3,
    Mass,
    NoiseAcceleration,
    NoiseForce,
    NoiseTorque,
    Rate,
    RateSquared,
    Speed,
    Stiffness,
    Torque,
    Torques,
    Torques6,
)
from .units import Quantity, UnitError, Vector

MAX_BYTES = 1 << 20


class Strict(Struct, frozen=True, forbid_unknown_fields=True):
    """Base of all sections: an unknown key is an error."""


Node = Annotated[int, Meta(ge=1, le=127)]
Count = Annotated[int, Meta(ge=1, le=2**32 - 1)]
Seed = Annotated[int, Meta(ge=0)]
Substeps = Annotated[int, Meta(ge=1, le=64)]


class Loop(Strict, frozen=True):
    """Pace of the daemon and its reaction to ticks that come too late.

    ``best_effort`` runs a real machine even where the kernel grants no real time. With ``sync = "bus"`` it
    follows the TIME objects (CiA 301) that a device sends once a period. ``spin`` is how early it wakes to
    wait busily for the deadline; without it, the daemon decides. ``cpu`` binds it to a processor.
    """

    rate: Frequency
    on_overrun: Literal["record", "stop"] = "stop"
    duration: Duration | None = None
    best_effort: bool = False
    sync: Literal["free", "bus"] = "free"
    spin: Instant | None = None
    cpu: Annotated[int, Meta(ge=0, le=4095)] | None = None


class SimulatedBus(Strict, frozen=True, tag_field="kind", tag="simulated"):
    """The simulated plant in its own process, over a Unix socket."""


class SocketCanBus(Strict, frozen=True, tag_field="kind", tag="socketcan"):
    """A Linux CAN FD interface."""

    interface: str


class PythonCanBus(Strict, frozen=True, tag_field="kind", tag="python-can"):
    """Any interface of python-can."""

    interface: str
    channel: str


class Arming(Strict, frozen=True):
    """How the machine gets permission to move, and how gently it starts."""

    by: Literal["dead-man", "command"]
    fade: Duration


class Safety(Strict, frozen=True):
    """Distance behind the controller's limits at which the monitor stops the machine, and its stop time."""

    position_margin: Angle
    stop_time: Duration


class GiantSafety(Safety, frozen=True):
    """The same distance for the axes of the PPU."""

    ppu_margin: Length


class JointDrive(Strict, frozen=True, tag_field="type", tag="joint_drive"):
    """A CiA 402 drive in cyclic synchronous torque mode."""

    node: Node
    counts_per_turn: Count
    gear_ratio: tuple[Count, Count]
    link_counts_per_turn: Count
    rated_torque: Torque


class AxisDrive(Strict, frozen=True, tag_field="type", tag="axis_drive"):
    """A CiA 402 drive in cyclic synchronous velocity mode."""

    node: Node
    counts_per_metre: Count


class ForceTorque(Strict, frozen=True, tag_field="type", tag="force_torque"):
    """A six-axis force-torque sensor with its full scale."""

    node: Node
    force: Force
    torque: Torque


class Imu(Strict, frozen=True, tag_field="type", tag="imu"):
    """Accelerometer, with its full scale, and gyroscope."""

    node: Node
    acceleration: Acceleration


class SafetyPlc(Strict, frozen=True, tag_field="type", tag="safety_plc"):
    """The safety PLC with dead-man, emergency stop and scanner."""

    node: Node


Device = JointDrive | AxisDrive | ForceTorque | Imu | SafetyPlc


class Manipulator(Strict, frozen=True):
    """Limits of joints 1 to 6 and of their virtual sum joint q4 + q5."""

    lower: AngleLimits6
    upper: AngleLimits6
    velocity: AngularSpeeds6
    acceleration: AngularAccelerations6
    tilt: Angles2


class Box(Strict, frozen=True):
    """Cartesian range of handle and elbow."""

    lower: Lengths3
    upper: Lengths3


class Ppu(Strict, frozen=True):
    """Prepositioning unit: limits, P-gain and the time constant of its velocity loop."""

    lower: Lengths2
    upper: Lengths2
    velocity: Speed
    acceleration: Acceleration
    gain: Rate
    time_constant: Duration


class ForceControl(Strict, frozen=True):
    """Detection rule and gains of the hierarchical force control."""

    detection: Literal["previous", "redetect"]
    p_gain: RateSquared
    d_gain: Rate
    viability_horizon: Duration
    point_horizon: Duration


class CartesianTwin(Strict, frozen=True, tag_field="kind", tag="cartesian"):
    """A free mass as the digital twin."""

    mass: Mass
    inertia: Inertia
    damping: Damping
    rotational_damping: AngularDamping
    velocity: Speed
    rotational_velocity: AngularSpeed
    acceleration: Acceleration
    rotational_acceleration: AngularAcceleration


class Tracking(Strict, frozen=True):
    """Series elasticity of the joints and the gains of their motor-side controllers."""

    rotor_inertia: Inertias6
    stiffness: AngularStiffnesses6
    p_gain: AngularStiffnesses6
    d_gain: AngularDampings6


class Handle(Strict, frozen=True):
    """What hangs on the force-torque sensor."""

    mass: Mass
    centre: Lengths3


class Giant(Strict, frozen=True):
    """Everything the giant's controller needs."""

    manipulator: Manipulator
    box: Box
    ppu: Ppu
    force_control: ForceControl
    twin: CartesianTwin
    tracking: Tracking
    handle: Handle


class GiantPlant(Strict, frozen=True):
    """What the simulated giant has beyond its controller's model."""

    posture: Angles6
    ppu: Lengths2
    spring_damping: AngularDampings6
    brake_torque: Torques6
    handle_inertia: Inertias3
    force_noise: NoiseForce
    torque_noise: NoiseTorque
    acceleration_noise: NoiseAcceleration
    substeps: Substeps


class Press(Strict, frozen=True):
    """The dead-man switch changes at a time."""

    at: Instant
    pressed: bool


class Waypoint(Strict, frozen=True):
    """A pose of the hand: position; yaw and tilt of the handle's axis, roll about it."""

    at: Instant
    position: Lengths3
    angles: Angles3


class Hand(Strict, frozen=True):
    """The simulated operator's hand."""

    stiffness: Stiffness
    damping: Damping
    rotational_stiffness: AngularStiffness
    rotational_damping: AngularDamping
    force: Force
    torque: Torque
    dead_man: tuple[Press, ...]
    path: Annotated[tuple[Waypoint, ...], Meta(min_length=2)]


class GiantSimulation(Strict, frozen=True):
    """The simulated giant."""

    seed: Seed
    giant: GiantPlant
    hand: Hand


class RhiMotors(Strict, frozen=True):
    """Motors of a redundant interface and how they drive its joints; one entry a motor."""

    transmission: tuple[tuple[float, ...], ...]
    rotor_inertia: Inertias
    friction: AngularDampings
    torque: Torques
    lower: Angles
    upper: Angles
    velocity: AngularSpeeds
    acceleration: AngularAccelerations


class RhiTask(Strict, frozen=True):
    """What the hand holds, which of its directions count, and where the ellipsoids are measured."""

    frame: str
    directions: tuple[Literal["x", "y", "z"], ...]
    home: Angles
    spread: Annotated[float, Meta(gt=1.0)]
    follow: Duration | None = None


class RhiNullSpace(Strict, frozen=True):
    """Gains of the secondary torque, and postures that a scan of the self-motion finds."""

    resolution: Literal["projection", "hqp"]
    step: Torque
    damping: AngularDamping
    cap: Torque
    scan: Annotated[int, Meta(ge=0, le=100_000)]
    stiffness: AngularStiffness


class RhiSaturation(Strict, frozen=True):
    """Observer, thresholds and duration of transitions, headroom while the posture moves."""

    steepness: Annotated[float, Meta(gt=0.0)]
    leave: Annotated[float, Meta(ge=0.0, le=1.0)]
    come_back: Annotated[float, Meta(ge=0.0, le=1.0)]
    rho: Annotated[float, Meta(ge=0.0)]
    held: Annotated[float, Meta(gt=0.0, le=1.0)]
    moving: Torque
    release: Duration


class RhiWall(Strict, frozen=True):
    """A spring behind a plane."""

    point: Lengths
    normal: tuple[float, ...]
    stiffness: Stiffness


class RhiHold(Strict, frozen=True):
    """Joint-space controller that holds a posture and brings the machine to rest."""

    stiffness: AngularStiffnesses
    damping: AngularDampings


class Rhi(Strict, frozen=True):
    """Everything the controller of a redundant interface needs."""

    motors: RhiMotors
    task: RhiTask
    null_space: RhiNullSpace
    saturation: RhiSaturation
    wall: RhiWall
    hold: RhiHold


class RhiPlant(Strict, frozen=True):
    """What the simulated interface has beyond its controller's model."""

    posture: Angles
    friction: AngularDampings
    brake_torque: Torques
    force_noise: NoiseForce
    substeps: Substeps


class Place(Strict, frozen=True):
    """A place of the hand."""

    at: Instant
    position: Lengths3


class PointHand(Strict, frozen=True):
    """The simulated operator's hand on a handle that turns freely."""

    stiffness: Stiffness
    damping: Damping
    force: Force
    dead_man: tuple[Press, ...]
    path: Annotated[tuple[Place, ...], Meta(min_length=2)]


class RhiSimulation(Strict, frozen=True):
    """The simulated redundant interface."""

    seed: Seed
    rhi: RhiPlant
    hand: PointHand


class Config(Strict, frozen=True, kw_only=True, tag_field="system"):
    """What every machine has; each system adds its own."""

    model: str
    loop: Loop
    bus: SimulatedBus | SocketCanBus | PythonCanBus
    arming: Arming
    safety: Safety
    devices: dict[str, Device]
    simulation: GiantSimulation | RhiSimulation | None = None


class GiantConfig(Config, frozen=True, kw_only=True, tag="giant"):
    """HapticGiant."""

    safety: GiantSafety
    giant: Giant
    simulation: GiantSimulation | None = None


class RhiConfig(Config, frozen=True, kw_only=True, tag="rhi"):
    """A redundant haptic interface."""

    rhi: Rhi
    simulation: RhiSimulation | None = None


SYSTEM_CONFIGS: dict[str, type[Config]] = {"giant": GiantConfig, "rhi": RhiConfig}


@dataclass(frozen=True, slots=True)
class Loaded:
    """A configuration with the texts it was made of, as a recording keeps them.

    Attributes:
        name: as it was asked for.
        config: checked values in SI units.
        text: the TOML text; source: its file name.
        model_text: the URDF text; model_source: its file name.
    """

    name: str
    config: Config
    text: str
    source: str
    model_text: str
    model_source: str


def load(name: str) -> Loaded:
    """A configuration by path, or by the name of a built-in one.

    Raises:
        ConfigError: with file and line of everything that is wrong with it.
    """
    path = Path(name)
    if path.suffix == ".toml" or path.exists():
        text = _read(path, name)
        folder: Any = path.parent
        source = str(path)
    else:
        folder = resources.files("hapticd.configs")
        entry = folder / f"{name}.toml"
        if not entry.is_file():
            known = sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))
            raise ConfigError(
                name,
                [Finding(0, "", "no such file or built-in configuration", f"built in: {', '.join(known)}")],
            )
        text = entry.read_text(encoding="utf-8")
        source = f"{name}.toml"
    config = parse(text, source)
    return Loaded(name, config, text, source, *_read_model(config, text, source, folder))


def parse(text: str, source: str) -> Config:
    """A configuration from its text.

    Raises:
        ConfigError: for unknown keys, missing or wrong units, numbers out of range, NaN.
    """
    try:
        tree = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line = int(match[1]) if (match := re.search(r"line (\d+)", str(error))) else 0
        raise ConfigError(source, [Finding(line, "", f"not TOML: {error}", "mend the syntax")]) from error
    try:
        config: Config = msgspec.convert(tree, GiantConfig | RhiConfig, dec_hook=_read_quantity)
    except msgspec.ValidationError as error:
        raise ConfigError(source, [_locate(error, tree, text)]) from error
    return config


def _read(path: Path, name: str) -> str:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ConfigError(
                name, [Finding(0, "", f"larger than {MAX_BYTES} bytes", "this is no configuration")]
            )
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(
            name, [Finding(0, "", f"cannot be read: {error.strerror}", "check the path")]
        ) from error
    except UnicodeDecodeError as error:
        raise ConfigError(name, [Finding(0, "", "is not UTF-8 text", "this is no configuration")]) from error


def _read_model(config: Config, text: str, source: str, folder: Any) -> tuple[str, str]:
    line = key_lines(text).get("model", 0)
    if config.model.startswith("/") or ".." in config.model.split("/"):
        raise ConfigError(
            source,
            [Finding(line, "model", f'"{config.model}" leaves the folder', "put the URDF beside the file")],
        )
    entry = folder / config.model
    if not entry.is_file():
        raise ConfigError(
            source, [Finding(line, "model", f'no file "{config.model}" beside it', "check the name")]
        )
    return entry.read_text(encoding="utf-8"), config.model


def _read_quantity(kind: type, value: Any) -> Any:
    if issubclass(kind, Quantity | Vector):
        return kind.read(value)
    raise NotImplementedError(kind)


# ---------------------------------------------------------------------------------- where and what

_TABLE = re.compile(r"^\s*(\[\[?)\s*([^\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"^\s*([A-Za-z0-9_.\"'-]+)\s*=")


def key_lines(text: str) -> dict[str, int]:
    """Line of every key and table, by its path, e.g. ``simulation.hand.path[2].at``."""
    lines: dict[str, int] = {}
    counts: dict[str, int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), 1):
        if match := _TABLE.match(line):
            table = match[2].replace('"', "").replace(" ", "")
            if match[1] == "[[":
                index = counts.get(table, 0)
                counts[table] = index + 1
                lines.setdefault(table, number)
                table = f"{table}[{index}]"
            lines.setdefault(table, number)
        elif match := _KEY.match(line):
            key = match[1].replace('"', "")
            lines.setdefault(f"{table}.{key}" if table else key, number)
    return lines


def line_of(path: str, lines: dict[str, int]) -> int:
    """Line of a path, or of the nearest table around it."""
    while path:
        if path in lines:
            return lines[path]
        cut = max(path.rfind("."), path.rfind("["))
        path = path[:cut] if cut > 0 else ""
    return 1


_AT = re.compile(r" - at `(?:key in )?\$?(.*?)`$")


def _locate(error: msgspec.ValidationError, tree: dict[str, Any], text: str) -> Finding:
    message = str(error)
    path = match[1].lstrip(".") if (match := _AT.search(message)) else ""
    message = _AT.sub("", message)
    path = _name_dict_keys(path, tree)
    lines = key_lines(text)
    if match := re.search(r"unknown field `(.*?)`", message):
        key = f"{path}.{match[1]}" if path else match[1]
        known = _known_fields(path, SYSTEM_CONFIGS.get(tree.get("system", ""), Config))
        near = difflib.get_close_matches(match[1], known, 1)
        fix = f'did you mean "{near[0]}"?' if near else f"known here: {', '.join(known)}" if known else ""
        return Finding(line_of(key, lines), key, "unknown key", fix)
    if match := re.search(r"missing required field `(.*?)`", message):
        key = f"{path}.{match[1]}" if path else match[1]
        return Finding(
            line_of(path, lines) if path else 1,
            key,
            "is missing",
            "add it; the built-in configurations show how",
        )
    if isinstance(error.__cause__, UnitError):
        problem, _, fix = str(error.__cause__).partition("; ")
        return Finding(line_of(path, lines), path, problem, fix)
    fix = f"known: {', '.join(SYSTEM_CONFIGS)}" if path == "system" else ""
    return Finding(line_of(path, lines), path, message, fix)


def _name_dict_keys(path: str, tree: dict[str, Any]) -> str:
    """Msgspec writes ``[...]`` for a key of a table of tables; find which one fails."""
    if "[...]" not in path:
        return path
    head, _, tail = path.partition("[...]")
    node: Any = tree
    for part in filter(None, head.split(".")):
        node = node[part]
    for key, value in node.items():
        try:
            msgspec.convert(value, Device, dec_hook=_read_quantity)
        except msgspec.ValidationError:
            return f"{head}.{key}{tail}"
    return head


def _known_fields(path: str, root: type[Config]) -> list[str]:
    node: Any = root
    for part in filter(None, re.sub(r"\[[^\]]*\]", "", path).split(".")):
        fields = {f.encode_name: f.type for f in msgspec.structs.fields(node)} if _is_struct(node) else {}
        node = _struct_of(fields.get(part))
        if node is None:
            return []
    return [f.encode_name for f in msgspec.structs.fields(node)] if _is_struct(node) else []


def _is_struct(node: Any) -> bool:
    return isinstance(node, type) and issubclass(node, Struct)


def _struct_of(annotation: Any) -> Any:
    if _is_struct(annotation):
        return annotation
    candidates = [arg for arg in getattr(annotation, "__args__", ()) if _struct_of(arg)]
    return _struct_of(candidates[0]) if candidates else None
