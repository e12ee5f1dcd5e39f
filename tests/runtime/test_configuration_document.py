"""docs/configuration.md and the sections that the program reads say the same."""

from __future__ import annotations

import re
import typing
from pathlib import Path
from typing import Any, get_args, get_origin

import msgspec
import pytest
from hapticd.configs import plugins
from hapticd.configs.units import DIMENSIONS, Quantity
from hapticd.runtime.configuration.system import find_system, system_names

DOCUMENT = (Path(__file__).parents[2] / "docs" / "configuration.md").read_text()
Sections = dict[str, dict[str, str]]


def structs(annotation: Any) -> list[type[msgspec.Struct]]:
    """The tables that a key may hold."""
    if isinstance(annotation, type) and issubclass(annotation, msgspec.Struct):
        return [annotation]
    return [struct for inner in get_args(annotation) for struct in structs(inner)]


def default(field: Any) -> str:
    if field.required:
        return ""
    value = field.default if field.default is not msgspec.NODEFAULT else None
    if isinstance(value, Quantity):
        return f'"{value:g} {next(iter(DIMENSIONS[value.dimension]))}"'
    if isinstance(value, float):
        return f"{value:g}"
    if value is None or isinstance(value, bool | int):
        return {None: "none"}.get(value, str(value).lower())
    return f'"{value}"'


def read(struct: type[msgspec.Struct], name: str, found: Sections) -> None:
    """Adds the keys of a table, and of the tables below it."""
    keys = found.setdefault(name, {})
    hints = typing.get_type_hints(struct, include_extras=True)
    for field in msgspec.structs.fields(struct):
        keys[field.encode_name] = default(field)
        below = structs(hints[field.name])
        path = (
            field.encode_name
            if name == "top of the file"
            else f"{name[1:].partition(']')[0]}.{field.encode_name}"
        )
        path += ".NAME" if get_origin(hints[field.name]) is dict else ""
        for kind in below:
            config = kind.__struct_config__
            variant = f' {config.tag_field} = "{config.tag}"' if len(below) > 1 else ""
            read(kind, f"[{path}]", below_found := {})
            if config.tag_field and not variant:
                below_found[f"[{path}]"][config.tag_field] = ""
            for section, rows in below_found.items():
                found.setdefault(section + (variant if section == f"[{path}]" else ""), {}).update(rows)


def of_the_program() -> Sections:
    found: Sections = {}
    for name in system_names():
        read(find_system(name).config, "top of the file", found)
    found["top of the file"]["system"] = ""
    for name in plugins.names(plugins.DEVICES):
        read(plugins.plugin(plugins.DEVICES, name), section := f'[devices.NAME] type = "{name}"', found)
        for key in ("name", "node", "serial"):  # what all have is said once, and the table is the name
            found[section].pop(key)
    found["[devices.NAME]"] = {"type": "", "node": "", "serial": "none"}
    for section in [name for name in found if ".twins.NAME" in name]:  # what is said of one is said of all
        assert found.pop(section) == found[section.replace(".twins.NAME", ".twin")]
    return found | {"[giant.twins.NAME]": {}, "[arm.twins.NAME]": {}}


def of_the_document() -> Sections:
    found: Sections = {}
    for part in re.split(r"^### ", DOCUMENT, flags=re.MULTILINE)[1:]:
        heading, _, body = part.partition("\n")
        rows = re.findall(r"^\| (`.*?`) \| .* \| ?(.*?) ?\|$", body, re.MULTILINE)
        found[heading] = {key: value for keys, value in rows for key in re.findall(r"`(\w+)`", keys)}
    return found


@pytest.mark.parametrize("section", sorted(of_the_program() | of_the_document()))
def test_every_key_and_its_default_is_documented_and_nothing_else(section: str) -> None:
    assert of_the_document().get(section) == of_the_program().get(section)


def test_every_unit_is_documented() -> None:
    sentence = re.search(r"Units: (.*?)\. ", DOCUMENT)
    assert sentence
    units = {unit for units in DIMENSIONS.values() for unit in units}
    assert set(re.split(r"[,;] ", sentence[1])) == units
