"""Digital twins in files of their own: put into a machine's configuration instead of the twin that it has."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from importlib import resources
from typing import Any

from ...configs.words import nearest
from ...models.xml_tree import MAX_BYTES as MAX_MODEL_BYTES
from ..errors import ConfigError, Finding
from .beside import Beside, UnfitFileError
from .files import decoded
from .known import CONFIGS
from .toml_reader import MAX_WHOLE, read

TABLES = ("twin", "hand", "touches")
"""What a twin's file may hold."""
_HEADER = re.compile(r"^\s*\[\[?\s*([^\]]+?)\s*\]\]?\s*(?:#.*)?$")
Blocks = list[tuple[str, str]]
"""Tables of a text, in its order: name, and the text from its header on; the first one has no name."""


def blocks(text: str) -> Blocks:
    """The tables of a TOML text."""
    found: list[tuple[str, list[str]]] = [("", [])]
    for line in text.splitlines(keepends=True):
        if match := _HEADER.match(line):
            found.append((match[1].replace(" ", "").replace('"', ""), []))
        found[-1][1].append(line)
    return [(name, "".join(lines)) for name, lines in found]


def tree_of(text: str, source: str) -> dict[str, Any]:
    """A twin's file as a tree.

    Raises:
        ConfigError: no TOML, no [twin], or other tables than a twin's file has.
    """
    tree = read(text, source)
    for key in tree:
        if key not in TABLES:
            near = nearest(key, TABLES)
            fix = f'did you mean "{near}"?' if near else f"a twin's file has {', '.join(TABLES)}"
            raise ConfigError(source, [Finding(1, key, "is no part of a twin", fix)])
    for key, value in tree.items():
        if not isinstance(value, dict):
            raise ConfigError(source, [Finding(1, key, "is not a table", f"write [{key}]")])
    if "twin" not in tree:
        raise ConfigError(source, [Finding(1, "twin", "is missing", "describe the twin in a table [twin]")])
    return tree


def exchanged(text: str, twin: str, system: str, touches: bool) -> str:
    """A machine's text with another twin, and with the limits that its hand is to touch.

    Args:
        text: of the machine's configuration.
        twin: text of the twin's file.
        system: the machine's kind, whose table has the twin.
        touches: whether the machine's own hand stays, and what it is to touch.
    """
    kept = _without(text, f"{system}.twin", *(() if touches else ("simulation.touches",)))
    return "".join([*_lines(kept), "\n", *_renamed(twin, system)])


def joined(text: str, twin: str, system: str, name: str) -> str:
    """A machine's text with one more twin, for which its own may be exchanged.

    Args:
        text: of the machine's configuration.
        twin: text of the twin's file, of which only the twin itself is taken.
        system: the machine's kind.
        name: of the twin.
    """
    tables = "".join(block for table, block in blocks(twin) if table.split(".")[0] == "twin")
    return "".join([*_lines(text), "\n", *_renamed(tables, system, f"{system}.twins.{name}")])


def led(text: str, path: str) -> str:
    """A machine's text with other tables for the path of its simulated hand."""
    kept = _without(text, "simulation.hand.path", "simulation.hand.away")
    return f"{kept.rstrip()}\n\n{path}"


def models(text: str, source: str, system: str) -> list[Beside]:
    """The models of a configuration's twins, where they name one and the text does not hold it yet.

    They lie beside it or are built in.

    Args:
        text: of a configuration.
        source: its file, for errors.
        system: its kind of machine.
    """
    tree: Any = read(text, source, MAX_WHOLE)
    table = tree.get(system) if isinstance(tree.get(system), dict) else {}
    others: Any = table.get("twins") if isinstance(table.get("twins"), dict) else {}
    places: dict[tuple[str, ...], Any] = {(system, "twin"): table.get("twin")}
    places |= {(system, "twins", name): twin for name, twin in others.items()}
    return [
        _model(place, twin["urdf"])
        for place, twin in places.items()
        if isinstance(twin, dict) and isinstance(twin.get("urdf"), str) and "kept" not in twin
    ]


def _model(place: tuple[str, ...], name: str) -> Beside:
    what = "model"

    def keep(content: bytes) -> str:
        model = decoded(content, name, f"this is no {what}")
        if "'''" in model:
            raise UnfitFileError("contains '''", "write it with other quotes")
        return f"urdf = '''\n{model.rstrip()}\n'''\n"

    return Beside(place, "urdf", name, MAX_MODEL_BYTES, what, keep, folder=resources.files(CONFIGS))


def _without(text: str, *tables: str) -> str:
    return "".join(block for name, block in blocks(text) if not _below(name, tables))


def _below(name: str, tables: Sequence[str]) -> bool:
    return any(name == table or name.startswith(f"{table}.") for table in tables)


def _lines(text: str) -> list[str]:
    return [*text.rstrip().splitlines(keepends=True), "\n"]


def _renamed(twin: str, system: str, own: str = "") -> Iterator[str]:
    for name, block in blocks(twin):
        place = {"twin": own or f"{system}.twin", "touches": "simulation.touches"}.get(name.split(".")[0])
        if place:
            header, rest = block.split("\n", 1) if "\n" in block else (block, "")
            yield header.replace(name.split(".")[0], place, 1) + "\n" + rest
