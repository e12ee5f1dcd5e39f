"""What the master knows of a device: its EDS, its node, and how its objects become fields in SI units.

A kind of device is a struct, whose fields are the keys of its table in a configuration, with four small
mappings; see `imu.py` for the shortest. An entry point of the group `hapticd.devices` names it by its tag.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from ..configs.strict import Strict
from .cia301 import Address
from .dictionary import Dictionary, Value, load
from .errors import NetworkError


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number: SI = raw * scale + shift.

    Several objects of a device with the same field name make a vector, in the order of the mapping.
    """

    field: str
    scale: float = 1.0
    shift: float = 0.0


@dataclass(frozen=True, slots=True)
class Word:
    """A bit field or a code, taken as it is."""

    field: str


Field = Quantity | Word
Finding = tuple[str, str, str]
"""Key of a device's table, what is wrong with its value, and what to write instead."""

Node = Annotated[int, Meta(ge=1, le=127, description="CANopen has 127 nodes")]
Serial = Annotated[int, Meta(ge=0, le=2**32 - 1, description="1018h:04 has 32 bits")]
Sign = Literal[-1, 1]
"""-1 where a device counts the other way."""


class Device(Strict, frozen=True, kw_only=True, tag_field="type"):
    """One device on the bus, as the configuration names it.

    Attributes:
        name: unique, used in messages; in a configuration the name of its table.
        node: node id, 1 to 127.
        group: devices of a group have the same fields, which lie side by side in the image.
        eds: path, or name of a built-in file.
        serial: serial number to insist on (1018h:04), or None.
    """

    name: str
    node: Node
    group: str
    eds: str
    serial: Serial | None = None

    @property
    def dictionary(self) -> Dictionary:
        """Its EDS.

        Raises:
            EdsError: see `dictionary.load`.
        """
        return load(self.eds, self.node)

    def inputs(self) -> Mapping[Address, Field]:
        """The fields of the objects in its TPDO; objects that are not named stay in the raw image."""
        return {}

    def outputs(self) -> Mapping[Address, Field]:
        """The fields of the objects in its output slot; all of them."""
        return {}

    def settings(self) -> Mapping[Address, Value]:
        """Objects that are written at start-up and read back."""
        return {}

    def facts(self) -> Mapping[Address, Value]:
        """Objects that must already have this value, such as the scaling that the fields rely on."""
        return {}

    def check(self) -> list[Finding]:
        """What else the values of its table must fulfil."""
        return []

    def require(self, condition: bool, reason: str) -> None:
        """What must be so for it to be a device at all.

        Raises:
            NetworkError: it is not so.
        """
        if not condition:
            raise NetworkError(self.name, reason)
