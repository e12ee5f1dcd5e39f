"""Machine configurations: TOML with units, checked so that nothing half-right reaches a machine."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, get_args

import msgspec
from msgspec import Struct

from ..models.xml_tree import MAX_BYTES as MAX_MODEL_BYTES
from .errors import ConfigError, Finding
from .giant.config import GiantConfig
from .rhi.config import RhiConfig
from .sections import Config, Device
from .toml_lines import key_lines, line_of
from .toml_reader import MAX_BYTES, read
from .units import Quantity, UnitError, Vector

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
    if path.suffix == ".toml" or _exists(path):
        text = _read(path, name, MAX_BYTES)
        folder: Any = path.parent
        source = str(path)
    else:
        folder = resources.files("hapticd.configs")
        entry = folder / f"{name}.toml"
        if not _exists(entry):
            known = sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))
            raise ConfigError(
                name,
                [Finding(0, "", "no such file or built-in configuration", f"built in: {', '.join(known)}")],
            )
        text = _read(entry, name, MAX_BYTES)
        source = f"{name}.toml"
    config = parse(text, source)
    return Loaded(name, config, text, source, *_read_model(config, text, source, folder))


def parse(text: str, source: str) -> Config:
    """A configuration from its text.

    Raises:
        ConfigError: for what is no TOML, unknown keys, missing or wrong units, numbers out of range, NaN.
    """
    tree = read(text, source)
    try:
        config: Config = msgspec.convert(tree, GiantConfig | RhiConfig, dec_hook=_read_quantity)
    except msgspec.ValidationError as error:
        raise ConfigError(source, [_locate(error, tree, text)]) from error
    return config


def _exists(entry: Any) -> bool:
    """Whether something of that name is there; no name is too long or too odd to ask."""
    try:
        return bool(entry.is_file() or entry.is_dir() or (isinstance(entry, Path) and entry.exists()))
    except (OSError, ValueError):
        return False


def _read(entry: Any, name: str, most: int) -> str:
    """Text of a file, or of a resource, of a known size."""
    what = "this is no configuration" if most == MAX_BYTES else "this is no model"
    if _exists(entry) and not entry.is_file():  # a pipe would be waited for
        raise ConfigError(name, [Finding(0, "", "is no regular file", what)])
    try:
        with entry.open("rb") as file:
            content: bytes = file.read(most + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise ConfigError(name, [Finding(0, "", f"cannot be read: {reason}", "check the path")]) from error
    if len(content) > most:
        raise ConfigError(name, [Finding(0, "", f"larger than {most} bytes", what)])
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise ConfigError(name, [Finding(line, "", "is not UTF-8 text", what)]) from error


def _read_model(config: Config, text: str, source: str, folder: Any) -> tuple[str, str]:
    line = key_lines(text).get("model", 0)
    if config.model.startswith("/") or ".." in config.model.split("/"):
        raise ConfigError(
            source,
            [Finding(line, "model", f'"{config.model}" leaves the folder', "put the URDF beside the file")],
        )
    entry = folder / config.model
    if not _exists(entry):
        raise ConfigError(
            source, [Finding(line, "model", f'no file "{config.model}" beside it', "check the name")]
        )
    return _read(entry, config.model, MAX_MODEL_BYTES), config.model


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
        known = _known_fields(path, SYSTEM_CONFIGS.get(str(tree.get("system")), Config))
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
    if path == "system":
        fix = f"known: {', '.join(SYSTEM_CONFIGS)}"
    else:
        fix = _reason(path, SYSTEM_CONFIGS.get(str(tree.get("system")), Config))
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
    node = _struct_at(path, root)
    return [f.encode_name for f in msgspec.structs.fields(node)] if node else []


def _struct_at(path: str, root: type[Config]) -> Any:
    """The section at a path, or None."""
    node: Any = root
    for part in filter(None, re.sub(r"\[[^\]]*\]", "", path).split(".")):
        fields = {f.encode_name: f.type for f in msgspec.structs.fields(node)} if _is_struct(node) else {}
        node = _struct_of(fields.get(part))
    return node if _is_struct(node) else None


def _reason(path: str, root: type[Config]) -> str:
    """Why the number at a path is bounded as it is."""
    table, _, name = re.sub(r"\[[^\]]*\]", "", path).rpartition(".")
    node = _struct_at(table, root)
    kinds = {f.encode_name: f.type for f in msgspec.structs.fields(node)} if node else {}
    return next((meta.description for meta in _bounds(kinds.get(name)) if meta.description), "")


def _bounds(annotation: Any) -> list[msgspec.Meta]:
    """All that an annotation, and what stands in it, says of numbers."""
    own = [meta for meta in getattr(annotation, "__metadata__", ()) if isinstance(meta, msgspec.Meta)]
    parts = [getattr(annotation, "__origin__", None)] if own else get_args(annotation)
    return own + [meta for part in parts for meta in _bounds(part)]


def _is_struct(node: Any) -> bool:
    return isinstance(node, type) and issubclass(node, Struct)


def _struct_of(annotation: Any) -> Any:
    if _is_struct(annotation):
        return annotation
    candidates = [arg for arg in getattr(annotation, "__args__", ()) if _struct_of(arg)]
    return _struct_of(candidates[0]) if candidates else None
