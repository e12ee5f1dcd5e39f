"""A device type as its EDS file describes it: identity, objects, and what its PDOs map."""

from __future__ import annotations

import configparser
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import cast

from canopen import ObjectDictionary, ObjectDictionaryError, import_od
from canopen.objectdictionary import ODArray, ODRecord, ODVariable, datatypes

from .. import configs
from ._wire import lib
from .cia301 import (
    AL_STATE,
    COUNTER_ECHO,
    DEVICE_NAME,
    PRODUCT,
    REVISION,
    RPDO_MAPPING,
    TPDO_MAPPING,
    VENDOR,
    Address,
)
from .errors import EdsError, object_name
from .frames import MAX_DATA

# CiA 301 data types that a PDO may map here: type of the C core, struct code, bytes
WIRE_TYPES: dict[int, tuple[int, str, int]] = {
    datatypes.UNSIGNED8: (lib.IMAGE_U8, "B", 1),
    datatypes.INTEGER8: (lib.IMAGE_I8, "b", 1),
    datatypes.UNSIGNED16: (lib.IMAGE_U16, "H", 2),
    datatypes.INTEGER16: (lib.IMAGE_I16, "h", 2),
    datatypes.UNSIGNED32: (lib.IMAGE_U32, "I", 4),
    datatypes.INTEGER32: (lib.IMAGE_I32, "i", 4),
    datatypes.REAL32: (lib.IMAGE_F32, "f", 4),
}

Value = int | float | str


@dataclass(frozen=True, slots=True)
class Mapped:
    """An object in a PDO.

    Attributes:
        address: index and sub-index.
        name: as in the EDS.
        data_type: CiA 301 data type, a key of `WIRE_TYPES`.
        offset: first byte in the PDO (of a slot: in the slot).
    """

    address: Address
    name: str
    data_type: int
    offset: int

    @property
    def size(self) -> int:
        """Bytes."""
        return WIRE_TYPES[self.data_type][2]

    @property
    def code(self) -> str:
        """For `struct`."""
        return WIRE_TYPES[self.data_type][1]

    @property
    def entry(self) -> int:
        """As in 1A00h: index, sub-index, bits."""
        return self.address[0] << 16 | self.address[1] << 8 | 8 * self.size


@dataclass(frozen=True, slots=True)
class Dictionary:
    """One EDS file, read for one node.

    Attributes:
        path: the file.
        node: node id, which some default values contain.
        objects: the object dictionary.
        tpdo: what TPDO 1 maps, in order; begins with the counter echo and the AL state.
        rpdo: what the output slot holds, in order.
    """

    path: str
    node: int
    objects: ObjectDictionary = field(repr=False, compare=False)
    tpdo: tuple[Mapped, ...]
    rpdo: tuple[Mapped, ...]

    @property
    def identity(self) -> dict[Address, Value]:
        """Device name, vendor, product and revision."""
        return {address: self.default(address) for address in (DEVICE_NAME, VENDOR, PRODUCT, REVISION)}

    def variable(self, address: Address) -> ODVariable:
        """The description of an object.

        Raises:
            EdsError: the EDS has no such object.
        """
        return _variable(self.objects, self.path, address)

    def default(self, address: Address) -> Value:
        """The default value of an object.

        Raises:
            EdsError: no such object, or it has no default value.
        """
        value = self.variable(address).default
        if value is None:
            raise EdsError(self.path, f"object {object_name(*address)} needs a DefaultValue")
        return cast(Value, value)

    def encode(self, address: Address, value: Value) -> bytes:
        """The bytes of a value, as SDO carries it.

        Raises:
            EdsError: no such object, or it cannot hold the value.
        """
        try:
            return bytes(self.variable(address).encode_raw(value))
        except (ValueError, TypeError, ObjectDictionaryError) as error:
            raise EdsError(self.path, f"object {object_name(*address)} cannot be {value!r}") from error

    def decode(self, address: Address, data: bytes) -> Value | bytes:
        """The value of bytes that SDO carried; the bytes themselves where they are no value of its type.

        Raises:
            EdsError: no such object.
        """
        try:
            return cast(Value, self.variable(address).decode_raw(data))
        except ObjectDictionaryError:
            return data


@cache
def load(eds: str, node: int) -> Dictionary:
    """Reads an EDS file: a path, or the name of a built-in one such as "joint_drive.eds".

    Raises:
        EdsError: the file cannot be read, or lacks what the wire needs.
    """
    path = eds if Path(eds).name != eds else str(resources.files(configs) / eds)
    try:
        objects = import_od(path, node)
    except (OSError, ValueError, KeyError, AttributeError, configparser.Error) as error:
        reason = str(error) or type(error).__name__
        raise EdsError(path, f"cannot be read as a CANopen EDS: {reason}") from error
    tpdo = _mapping(objects, path, TPDO_MAPPING)
    if [(m.address, m.size) for m in tpdo[:2]] != [(COUNTER_ECHO, 2), (AL_STATE, 1)]:
        raise EdsError(
            path,
            f"1A00h must begin with {object_name(*COUNTER_ECHO)} (counter echo, 16 bits) "
            f"and {object_name(*AL_STATE)} (AL state, 8 bits)",
        )
    rpdo = _mapping(objects, path, RPDO_MAPPING) if RPDO_MAPPING in objects else ()
    return Dictionary(path, node, objects, tpdo, rpdo)


def _variable(objects: ObjectDictionary, path: str, address: Address) -> ODVariable:
    index, subindex = address
    entry = objects.indices.get(index)
    if isinstance(entry, ODRecord | ODArray):
        entry = entry.subindices.get(subindex)
    elif subindex:
        entry = None
    if not isinstance(entry, ODVariable):
        raise EdsError(path, f"object {object_name(index, subindex)} is missing")
    return entry


def _mapping(objects: ObjectDictionary, path: str, index: int) -> tuple[Mapped, ...]:
    """What a mapping record says, checked against the mapped objects."""
    mapped: list[Mapped] = []
    offset = 0
    count = _variable(objects, path, (index, 0)).default or 0
    for subindex in range(1, count + 1):
        entry = _variable(objects, path, (index, subindex)).default or 0
        address = (entry >> 16, entry >> 8 & 0xFF)
        target = _variable(objects, path, address)
        if target.data_type not in WIRE_TYPES:
            raise EdsError(
                path, f"{object_name(*address)} has a data type (0x{target.data_type:X}) no PDO maps here"
            )
        item = Mapped(address, target.name, target.data_type, offset)
        if item.entry != entry:
            raise EdsError(
                path,
                f"{object_name(index, subindex)} maps {entry & 0xFF} bits of {object_name(*address)}, "
                f"which has {8 * item.size}",
            )
        mapped.append(item)
        offset += item.size
    if offset > MAX_DATA:
        raise EdsError(path, f"{index:04X}h maps {offset} bytes; a CAN FD frame holds {MAX_DATA}")
    return tuple(mapped)
