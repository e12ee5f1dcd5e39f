"""Machine configurations: TOML with units, checked so that nothing half-right reaches a machine."""

from __future__ import annotations

import difflib
import re
import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct

from .errors import ConfigError, Finding
from .giant.config import GiantConfig
from .rhi.config import RhiConfig
from .sections import Config, Device
from .toml_lines import key_lines, line_of
from .units import Quantity, UnitError, Vector

MAX_BYTES = 1 << 20
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
