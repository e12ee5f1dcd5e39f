"""A device type as its EDS file describes it: identity, objects, and what its PDOs map."""

from __future__ import annotations

import configparser
import pickle
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from io import StringIO
from pathlib import Path
from typing import Final, cast

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
    datatypes.UNSIGNED8: (lib.CODEC_U8, "B", 1),
    datatypes.INTEGER8: (lib.CODEC_I8, "b", 1),
    datatypes.UNSIGNED16: (lib.CODEC_U16, "H", 2),
    datatypes.INTEGER16: (lib.CODEC_I16, "h", 2),
    datatypes.UNSIGNED32: (lib.CODEC_U32, "I", 4),
    datatypes.INTEGER32: (lib.CODEC_I32, "i", 4),
    datatypes.REAL32: (lib.CODEC_F32, "f", 4),
}

Value = int | float | str

MAX_BYTES: Final = 1_000_000
"""Largest EDS file, so that a recording can keep it."""


class KeptEds(str):
    """Name of an EDS file whose text is at hand, as a recording keeps it: the file itself is not read.

    Attributes:
        text: of the file.
    """

    text: str

    def __new__(cls, name: str, text: str) -> KeptEds:
        """A name with its text."""
        self = super().__new__(cls, name)
        self.text = text
        return self


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


def load(eds: str, node: int) -> Dictionary:
    """Reads an EDS file: a path, or the name of a built-in one such as "joint_drive.eds".

    Raises:
        EdsError: the file cannot be read, or lacks what the wire needs.
    """
    return _parse(_path(eds), text_of(eds), node)


def text_of(eds: str) -> str:
    """Text of an EDS file, named as for ``load``.

    Raises:
        EdsError: the file cannot be read, or is larger than 1 MB.
    """
    return eds.text if isinstance(eds, KeptEds) else _read(_path(eds))


def built_in(eds: str) -> bool:
    """Whether a name is that of a file that comes with this program."""
    return Path(eds).name == eds


@cache
def _path(eds: str) -> str:
    return str(resources.files(configs) / eds) if built_in(eds) else str(eds)


@cache
def _read(path: str) -> str:
    try:
        with open(path, "rb") as file:
            content = file.read(MAX_BYTES + 1)
        text = content.decode()
    except (OSError, ValueError) as error:
        raise EdsError(path, f"cannot be read as a CANopen EDS: {error}") from error
    if len(content) > MAX_BYTES:
        raise EdsError(path, f"is larger than {MAX_BYTES} bytes")
    return text


@cache
def _imported(path: str, text: str) -> bytes:
    """The objects of an EDS file as for a node 0, pickled: reading them anew for each node takes longer."""
    for number, line in enumerate(text.splitlines(), 1):
        if not line.replace("\t", " ").isprintable():  # names of objects are shown on terminals
            raise EdsError(path, f"line {number} holds a control character")
    source = StringIO(text, newline=None)
    source.name = path  # its ending says what it is
    try:
        return pickle.dumps(import_od(source, 0))
    except (ValueError, KeyError, AttributeError, TypeError, configparser.Error) as error:
        reason = str(error) or type(error).__name__
        raise EdsError(path, f"cannot be read as a CANopen EDS: {reason}") from error


def _objects(path: str, text: str, node: int) -> ObjectDictionary:
    """The objects of an EDS file, with what CiA 306 lets it write relative to the node's id."""
    objects: ObjectDictionary = pickle.loads(_imported(path, text))
    objects.node_id = node
    for entry in objects.indices.values():
        for variable in entry.subindices.values() if isinstance(entry, ODRecord | ODArray) else (entry,):
            for value in ("default", "value"):
                is_relative = "$NODEID" in getattr(variable, f"{value}_raw", "")
                if is_relative and isinstance(offset := getattr(variable, value), int):
                    setattr(variable, value, offset + node)
    return objects


@cache
def _parse(path: str, text: str, node: int) -> Dictionary:
    objects = _objects(path, text, node)
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


def _number(objects: ObjectDictionary, path: str, address: Address) -> int:
    """The default value of an object of a mapping record, 0 where it has none."""
    value = _variable(objects, path, address).default or 0
    if not isinstance(value, int):
        raise EdsError(path, f"object {object_name(*address)} needs a whole number as its DefaultValue")
    return value


def _mapping(objects: ObjectDictionary, path: str, index: int) -> tuple[Mapped, ...]:
    """What a mapping record says, checked against the mapped objects."""
    mapped: list[Mapped] = []
    offset = 0
    for subindex in range(1, _number(objects, path, (index, 0)) + 1):
        entry = _number(objects, path, (index, subindex))
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
