"""Machine configurations: TOML with units, checked so that nothing half-right reaches a machine."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from msgspec import Struct

from ...configs import plugins
from ...configs.units import Quantity, UnitError, Vector, shown
from ...configs.words import meant, nearest
from ...devices.calibration import Calibration
from ...devices.device import Device
from ...devices.force_torque import ForceTorque
from ...models import Robot
from ...models.xml_tree import MAX_BYTES as MAX_MODEL_BYTES
from ..core.sections import Config
from ..errors import ConfigError, Finding
from ..invocation import program
from .beside import Beside, with_files
from .files import decoded, exists, leaves, read_text
from .known import AND, BETWEEN, CONFIGS, TWINS, built_in, machine_folders, twins
from .schema import advice, bounds_advice, known_fields, name_type, steps, value_type
from .system import ScriptError, find_system, system_names
from .toml_lines import key_lines, line_of
from .toml_reader import MAX_BYTES, MAX_WHOLE, read
from .twin_file import exchanged, joined, led, models, tree_of

LONGEST_NAME = 24
"""Characters of a twin's name."""
NO_CONFIGURATION, NO_MODEL = "this is not a configuration", "this is not a model"


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
    """A configuration by path, or by the name of a built-in one; "MACHINE with TWIN" has another twin.

    Of "MACHINE with TWIN,TWIN" it has the first, and may exchange it for the others.

    Raises:
        ConfigError: with file and line of everything that is wrong with it.
    """
    machine, between, twin = name.partition(BETWEEN)
    if not between or exists(Path(name)):
        return _load(name)
    first, *others = [twin] if exists(Path(twin)) else twin.split(AND)
    found = with_twin(_load(machine), first, *_twin_text(Path(first), first))
    if others:
        found = _named(found, first)
    for other in others:
        found = with_another(found, other, *_twin_text(Path(other), other))
    return found


def _load(name: str) -> Loaded:
    path = Path(name)
    if path.suffix == ".toml" or exists(path):
        text = read_text(path, name, MAX_BYTES, NO_CONFIGURATION)
        folder: Any = path.parent
        source = str(path)
    else:
        folder = _folder(name)
        entry = folder / f"{name}.toml"
        text = read_text(entry, name, MAX_BYTES, NO_CONFIGURATION)
        source = f"{name}.toml"
    config = parse(text, source)
    whole = _whole(text, source, config, folder)
    config = config if whole is text else parse(whole, source)
    return Loaded(name, config, whole, source, *_read_model(config, text, source, folder))


def with_twin(machine: Loaded, twin: str, text: str, folder: Any) -> Loaded:
    """A machine with another twin, and a hand that leads it.

    Args:
        machine: which renders twins.
        twin: path or name of the twin, for people.
        text: of its file.
        folder: where the models are that it names.

    Raises:
        ConfigError: what is wrong with it, or the machine renders none.
    """
    tag = _tag(machine.config)
    tree, system = tree_of(text, twin), find_system(tag)
    if system.led is None:
        problem = f"a machine of the kind {tag} renders no twin"
        raise ConfigError(machine.source, [Finding(0, "", problem, "")])
    source = f"{Path(machine.source).stem}_{Path(twin).stem}.toml"
    own_hand = tree["twin"].get("kind") == "cartesian" and not tree.keys() & {"hand", "touches"}
    robot = Robot.from_urdf(machine.model_text, machine.model_source)
    try:
        whole = exchanged(machine.text, text, tag, own_hand)
        whole = _with_models(whole, source, parse(whole, source), folder)
        config = parse(whole, source)
        _require_fit(config, whole, source, robot)
    except ConfigError as error:
        raise _in_its_file(error, f"{tag}.twin", twin, text) from error
    if config.simulation is not None and not own_hand:
        try:
            whole = led(whole, system.led(config, robot, tree.get("hand", {})))
        except ScriptError as error:
            line = line_of(error.key, key_lines(text))
            raise ConfigError(twin, [Finding(line, error.key, error.problem, error.fix)]) from error
        config = parse(whole, source)
    name = f"{machine.name}{BETWEEN}{twin}"
    return Loaded(name, config, whole, source, machine.model_text, machine.model_source)


def _named(loaded: Loaded, twin: str) -> Loaded:
    """The same with the name of its twin's file, where the twin has none."""
    table = f"[{_tag(loaded.config)}.twin]"
    if re.search(rf"^{re.escape(table)}\n(?:[^\[\n].*\n|\n)*?name\s*=", loaded.text, re.MULTILINE):
        return loaded
    text = loaded.text.replace(f"\n{table}", f'\n{table}\nname = "{_twin_name(twin)}"', 1)
    return replace(loaded, text=text, config=parse(text, loaded.source))


def _twin_name(twin: str) -> str:
    """What a twin is called among several: its file's name, as far as it can be typed."""
    return re.sub("[^a-z0-9_]", "_", Path(twin).stem.lower())[:LONGEST_NAME]


def with_another(machine: Loaded, twin: str, text: str, folder: Any) -> Loaded:
    """A machine that may exchange its twin for one more.

    Args:
        machine: which renders twins.
        twin: path or name of the twin, for people.
        text: of its file; nobody leads its joints, and nobody asks what they touch.
        folder: where the models are that it names.

    Raises:
        ConfigError: what is wrong with it.
    """
    tree_of(text, twin)
    tag, name = _tag(machine.config), _twin_name(twin)
    source = f"{Path(machine.source).stem}_{Path(twin).stem}.toml"
    if name in machine.config.twin_names:
        problem = f"two twins would be called '{name}'"
        raise ConfigError(twin, [Finding(0, "", problem, "name each once; rename one of the files")])
    try:
        whole = joined(machine.text, text, tag, name)
        whole = _with_models(whole, source, parse(whole, source), folder)
        config = parse(whole, source)
        _require_fit(config, whole, source, Robot.from_urdf(machine.model_text, machine.model_source))
    except ConfigError as error:
        raise _in_its_file(error, f"{tag}.twins.{name}", twin, text) from error
    full = f"{machine.name}{AND}{twin}"
    return Loaded(full, config, whole, source, machine.model_text, machine.model_source)


def _require_fit(config: Config, text: str, source: str, robot: Robot) -> None:
    """What only the model can tell of a machine.

    Raises:
        ConfigError: what is wrong with it.
    """
    if wrong := find_system(_tag(config)).check(config, robot):
        lines = key_lines(text)
        raise ConfigError(source, [Finding(line_of(key, lines), key, *rest) for key, *rest in wrong])


def _twin_text(path: Path, twin: str) -> tuple[str, Any]:
    """Text of a twin's file, or of a built-in one, and the folder that it is in."""
    if path.suffix == ".toml" or (twin and exists(path)):
        return read_text(path, twin, MAX_BYTES, NO_CONFIGURATION), path.parent
    folder = resources.files(CONFIGS) / TWINS
    if not exists(folder / f"{twin}.toml"):
        raise ConfigError(twin, [Finding(0, "", "no such file or built-in twin", _nearest(twin, twins()))])
    return read_text(folder / f"{twin}.toml", twin, MAX_BYTES, NO_CONFIGURATION), folder


def _in_its_file(error: ConfigError, place: str, twin: str, text: str) -> ConfigError:
    """What is wrong with a twin at a place, with the lines of its own file; anything else as it is."""
    if not all(re.match(rf"{re.escape(place)}(\.|$)", finding.key) for finding in error.findings):
        return error
    keys = [f"twin{finding.key.removeprefix(place)}" for finding in error.findings]
    rows, lines = zip(keys, error.findings, strict=True), key_lines(text)
    return ConfigError(twin, [Finding(line_of(key, lines), key, f.problem, f.fix) for key, f in rows])


def _tag(config: Config) -> str:
    return str(type(config).__struct_config__.tag)


def _with_models(text: str, source: str, config: Config, folder: Any) -> str:
    """The text with the models of its twins."""
    return with_files(text, source, models(text, source, _tag(config)), folder)


def _whole(text: str, source: str, config: Config, folder: Any) -> str:
    """The text with all that it needs of files beside it, but the robot's model."""
    text = _with_models(text, source, config, folder)
    own = find_system(_tag(config)).beside
    return with_files(text, source, [*_calibrations(config), *(own(config) if own else ())], folder)


def _calibrations(config: Config) -> Iterator[Beside]:
    """Files of the calibrations of its force-torque sensors."""
    for name, device in config.devices.items():
        if isinstance(device, ForceTorque) and device.calibration is not None and device.kept is None:
            yield _calibration(name, device.calibration)


def _calibration(device: str, file: str) -> Beside:
    what = "calibration"

    def keep(content: bytes) -> str:
        found = decoded(content, file, f"this is no {what}")
        calibration(found, file)  # what is wrong in it is said with its own lines
        return found

    absent = "check the name, or write it: hapticd calibrate ft"
    return Beside(("devices", device), "calibration", file, MAX_BYTES, what, keep, absent)


def calibration(text: str, source: str) -> Calibration:
    """What the text of a calibration file says.

    Raises:
        ConfigError: with file and line of what is wrong with it.
    """
    return _convert(read(text, source), Calibration, "", text, source)


def read_model(name: str) -> str:
    """The text of a model by its path.

    Raises:
        ConfigError: it cannot be read, or is too large.
    """
    return read_text(Path(name), name, MAX_MODEL_BYTES, NO_MODEL)


def parse(text: str, source: str) -> Config:
    """A configuration from its text.

    Raises:
        ConfigError: for what is no TOML, unknown keys, missing or wrong units, numbers out of range, NaN.
    """
    if text.lstrip().startswith("<"):
        alone = f"; alone it is checked by: {program()} check {shlex.quote(source)}"
        fix = f"give the TOML file that names it{alone if source.endswith('.urdf') else ''}"
        raise ConfigError(source, [Finding(1, "", "is XML, as models are", fix)])
    return of_tree(read(text, source, MAX_WHOLE), text, source)


def of_tree(tree: dict[str, Any], text: str, source: str) -> Config:
    """A configuration from the tree of its text.

    Raises:
        ConfigError: see ``parse``.
    """
    config = _convert(tree, _kind(tree, text, source), "", text, source)
    devices = {name: _device(name, table, text, source) for name, table in config.devices.items()}
    return msgspec.structs.replace(config, devices=devices)


S = TypeVar("S", bound=Struct)


def _convert(tree: dict[str, Any], kind: type[S], at: str, text: str, source: str) -> S:
    """The tree of a table, which stands ``at`` a key of the text, as its section."""
    try:
        return msgspec.convert(tree, kind, dec_hook=_read_quantity)
    except msgspec.ValidationError as error:
        raise ConfigError(source, [_locate(error, tree, kind, at, key_lines(text))]) from error


def _device(name: str, table: Any, text: str, source: str) -> Device:
    """A device, whose kind may be anybody's."""
    key, known = f"devices.{name}", plugins.names(plugins.DEVICES)
    given = table.get("type") if isinstance(table, dict) else None
    if not isinstance(table, dict):
        finding = key, "is not a table", f"write [devices.{name}]"
    elif given not in known:
        what = "is missing" if given is None else f"no kind of device '{shown(given)}' is installed"
        finding = f"{key}.type", what, meant(str(given), known)
    elif "name" in table:
        finding = f"{key}.name", "unknown key", "a device has the name of its table"
    else:
        try:
            kind: type[Device] = plugins.plugin(plugins.DEVICES, str(given))
        except plugins.PluginError as error:
            finding = f"{key}.type", error.problem, error.fix
        else:
            return _convert({**table, "name": name}, kind, key, text, source)
    raise ConfigError(source, [Finding(line_of(finding[0], key_lines(text)), *finding)])


def _kind(tree: dict[str, Any], text: str, source: str) -> type[Config]:
    """The sections of the kind of machine that a configuration is for."""
    lines, name, known = key_lines(text), tree.get("system"), system_names()
    if "system" not in tree:
        raise ConfigError(source, [Finding(1, "system", "is missing", f"known: {', '.join(known)}")])
    if not isinstance(name, str) or name not in known:
        problem = f"no kind of machine '{name}' is installed"
        raise ConfigError(
            source, [Finding(line_of("system", lines), "system", problem, f"known: {', '.join(known)}")]
        )
    try:
        return find_system(name).config
    except plugins.PluginError as error:
        line = line_of("system", lines)
        raise ConfigError(source, [Finding(line, "system", error.problem, error.fix)]) from error


def _folder(name: str) -> Any:
    """Where a configuration of that name comes with a machine."""
    for folder in machine_folders():
        files = resources.files(folder)
        if exists(files / f"{name}.toml"):
            return files
    problem = "no such file or built-in configuration"
    raise ConfigError(name, [Finding(0, "", problem, _nearest(name, built_in()))])


def _nearest(name: str, known: list[str]) -> str:
    near = nearest(name.lower(), known)
    guess = f'did you mean "{near}"? ' if near else ""
    return f"{guess}built in: {', '.join(known)}"


def _read_model(config: Config, text: str, source: str, folder: Any) -> tuple[str, str]:
    line = key_lines(text).get("model", 0)
    if leaves(config.model):
        raise ConfigError(
            source,
            [Finding(line, "model", f'"{config.model}" leaves the folder', "put the URDF beside the file")],
        )
    entry = folder / config.model
    if not exists(entry):
        raise ConfigError(
            source, [Finding(line, "model", f'no file "{config.model}" beside it', "check the name")]
        )
    if not entry.is_file():
        what = "a folder" if entry.is_dir() else "no regular file"
        fix = "name the URDF file, beside the configuration"
        raise ConfigError(source, [Finding(line, "model", f'"{config.model}" is {what}', fix)])
    return read_text(entry, config.model, MAX_MODEL_BYTES, NO_MODEL), config.model


def _read_quantity(kind: type, value: Any) -> Any:
    if issubclass(kind, Quantity | Vector):
        return kind.read(value)
    raise NotImplementedError(kind)


_AT = re.compile(r" - at (`key` in )?`\$?(.*?)`$")


def _locate(
    error: msgspec.ValidationError, tree: dict[str, Any], kind: type[Struct], at: str, lines: dict[str, int]
) -> Finding:
    message = str(error)
    path = match[2].lstrip(".") if (match := _AT.search(message)) else ""
    message = _AT.sub("", message)
    path = _name_dict_keys(path, tree, kind)
    if match and match[1]:
        return _wrong_name(path, tree, kind, at, lines)
    key = ".".join(filter(None, (at, path)))
    if match := re.search(r"unknown field `(.*?)`", message):
        own = ".".join(filter(None, (key, match[1])))
        known = [name for name in known_fields(path, kind, tree) if not (at and not path and name == "name")]
        return Finding(line_of(own, lines), own, "unknown key", meant(match[1], known))
    if match := re.search(r"missing required field `(.*?)`", message):
        own = ".".join(filter(None, (key, match[1])))
        fix = "add it; the built-in configurations show how"
        return Finding(line_of(key, lines) if key else 1, own, "is missing", fix)
    if isinstance(error.__cause__, UnitError):
        problem, _, fix = str(error.__cause__).partition("; ")
        return Finding(line_of(key, lines), key, problem, fix)
    return Finding(line_of(key, lines), key, message, advice(path, kind, tree))


def _wrong_name(
    path: str, tree: dict[str, Any], kind: type[Struct], at: str, lines: dict[str, int]
) -> Finding:
    """A table of anything, at a path, in which something has a name that it cannot have."""
    node: Any = tree
    for step in steps(path):
        node = node[step]
    names = name_type(path, kind, tree)
    wrong = next(name for name in node if not _fits(name, names))
    own = ".".join(filter(None, (at, path, wrong)))
    return Finding(line_of(own, lines), own, f"'{shown(wrong)}' cannot be a name here", bounds_advice(names))


def _fits(value: Any, kind: Any) -> bool:
    try:
        msgspec.convert(value, kind, dec_hook=_read_quantity)
    except msgspec.ValidationError:
        return False
    return True


def _name_dict_keys(path: str, tree: dict[str, Any], root: type[Struct]) -> str:
    """Msgspec writes ``[...]`` for a key of a table of anything, and of one in it; find which one fails."""
    if "[...]" not in path:
        return path
    head, _, tail = path.partition("[...]")
    node: Any = tree
    for step in steps(head):
        node = node[step]
    kind = value_type(head, root, tree)
    for key, value in node.items():
        if not _fits(value, kind):
            return _name_dict_keys(f"{head}.{key}{tail}", tree, root)
    return head
