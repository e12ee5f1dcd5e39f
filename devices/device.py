"""What the master knows of a device: its EDS, its node, and how its objects become fields in SI units.

A device type is a frozen dataclass with four small tables; see `imu.py` for the shortest.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

from .cia301 import Address
from .dictionary import Dictionary, Value, load


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


@dataclass(frozen=True, kw_only=True)
class Device(ABC):
    """One device on the bus, as the configuration names it.

    Attributes:
        name: unique, used in messages.
        node: node id, 1 to 127.
        group: devices of a group have the same fields, which lie side by side in the image.
        eds: path, or name of a built-in file.
        serial: serial number to insist on (1018h:04), or None.
    """

    name: str
    node: int
    group: str
    eds: str
    serial: int | None = None

    @property
    def dictionary(self) -> Dictionary:
        """Its EDS.

        Raises:
            EdsError: see `dictionary.load`.
        """
        return load(self.eds, self.node)

    @abstractmethod
    def inputs(self) -> Mapping[Address, Field]:
        """The fields of the objects in its TPDO; objects that are not named stay in the raw image."""

    def outputs(self) -> Mapping[Address, Field]:
        """The fields of the objects in its output slot; all of them."""
        return {}

    def settings(self) -> Mapping[Address, Value]:
        """Objects that are written at start-up and read back."""
        return {}

    def facts(self) -> Mapping[Address, Value]:
        """Objects that must already have this value, such as the scaling that the fields rely on."""
        return {}
