"""Who is on the bus, and where their bytes are: slots, raw image and named fields.

The layout follows from the devices' EDS files alone; nothing else says it a second time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._wire import lib
from .cia301 import AL_STATE, COUNTER_ECHO, MAX_NODE, MAX_OUTPUT_FRAME, OUTPUT, SYNC, Address
from .device import Device, Field, Quantity, Word
from .dictionary import Mapped
from .errors import NetworkError, object_name
from .frames import MAX_DATA, padded_length

HEADER = int(lib.IMAGE_HEADER)
_HEADER_NAMES = ("counter", "counter", "flags", "reserved")
_ECHO_NAMES = {COUNTER_ECHO: "counter", AL_STATE: "al_state"}

Kind = type[Quantity] | type[Word]


@dataclass(frozen=True, slots=True)
class Slot:
    """Where a device finds its outputs: frame 0 is SYNC, frame k has identifier 0x100 + k."""

    frame: int
    offset: int
    size: int


@dataclass(frozen=True, slots=True)
class OutputFrame:
    """An output frame; `raw` is where its payload is in the raw image."""

    can_id: int
    length: int
    raw: int


@dataclass(frozen=True, slots=True)
class FieldRange:
    """Where a field of a group is: `start + width * i + component` for the i-th device of the group."""

    kind: Kind
    output: bool
    start: int
    devices: int
    width: int

    def of(self, array: NDArray[Any]) -> NDArray[Any]:
        """Its part of all values of its kind and direction, (devices,) or (devices, width); a view."""
        view = array[self.start : self.start + self.devices * self.width]
        return view.reshape(self.devices, self.width) if self.width > 1 else view


@dataclass(frozen=True, slots=True)
class Place:
    """A mapped object of a device.

    Attributes:
        device: index into the network's devices.
        mapped: the object.
        field: its field, or None where it stays raw.
        component: which of the objects of that field it is.
        raw: its first byte in the raw image.
    """

    device: int
    mapped: Mapped
    field: Field | None
    component: int
    raw: int


class Network:
    """A list of devices and the layout of what they exchange.

    Attributes:
        devices: in the order given, which is the order of every per-device array.
        groups: device indices of each group, in that order.
        slots: per device, or None where it has no outputs.
        output_frames: in the order they are sent; SYNC is last.
        tpdo_raw: per device, where its TPDO is in the raw image; the inputs come first there.
        tpdo_length: per device, bytes on the wire.
        inputs, outputs: all mapped objects.
        fields: by name, "group.field".
        raw_inputs, raw_size: bytes of the inputs, and of the whole raw image.
    """

    def __init__(self, devices: Sequence[Device]) -> None:
        """Lays the network out.

        Raises:
            NetworkError: names or nodes that clash, fields that do not fit the EDS, and the like.
            EdsError: see `dictionary.load`.
        """
        self.devices = tuple(devices)
        _check_devices(self.devices)
        self.groups: dict[str, tuple[int, ...]] = {}
        for i, device in enumerate(self.devices):
            self.groups[device.group] = (*self.groups.get(device.group, ()), i)
        self.tpdo_length = tuple(padded_length(_size(d.dictionary.tpdo)) for d in self.devices)
        self.tpdo_raw = tuple(sum(self.tpdo_length[:i]) for i in range(len(self.devices)))
        self.raw_inputs = sum(self.tpdo_length)
        self.slots = _assign_slots(self.devices)
        self.output_frames = _output_frames(self.slots, self.raw_inputs)
        self.raw_size = self.raw_inputs + sum(frame.length for frame in self.output_frames)
        self.inputs = self._place_inputs()
        self.outputs = self._place_outputs()
        self.fields = self._ranges()
        self._names = self._byte_names()

    def index(self, name: str) -> int:
        """The device of that name.

        Raises:
            NetworkError: there is none.
        """
        for i, device in enumerate(self.devices):
            if device.name == name:
                return i
        raise NetworkError("", f"no device is called {name!r}")

    def field_at(self, offset: int) -> str:
        """Names a byte of the raw image: "joint3.position", "0x080.counter"."""
        return self._names[offset]

    def range_of(self, place: Place) -> FieldRange:
        """Where the field that a mapped object belongs to is."""
        assert place.field is not None
        return self.fields[f"{self.devices[place.device].group}.{place.field.field}"]

    def target(self, place: Place) -> int:
        """Where the value of a mapped object is, among all of its kind and direction."""
        where = self.range_of(place)
        number = self.groups[self.devices[place.device].group].index(place.device)
        return where.start + where.width * number + place.component

    def blank(self, kind: Kind, *, output: bool) -> NDArray[Any]:
        """Zeros for all values of a kind and direction: float64 for quantities, uint32 for words."""
        fields = [field for field in self.fields.values() if (field.kind, field.output) == (kind, output)]
        size = sum(field.devices * field.width for field in fields)
        return np.zeros(max(1, size), np.float64 if kind is Quantity else np.uint32)

    def _place_inputs(self) -> tuple[Place, ...]:
        places: list[Place] = []
        for i, device in enumerate(self.devices):
            places += _places(i, device.dictionary.tpdo, device.inputs(), self.tpdo_raw[i])
        return tuple(places)

    def _place_outputs(self) -> tuple[Place, ...]:
        frame_raw = {frame.can_id: frame.raw for frame in self.output_frames}
        places: list[Place] = []
        for i, (device, slot) in enumerate(zip(self.devices, self.slots, strict=True)):
            if slot:
                start = frame_raw[_output_id(slot.frame)] + slot.offset
                places += _places(i, device.dictionary.rpdo, device.outputs(), start)
        return tuple(places)

    def _ranges(self) -> dict[str, FieldRange]:
        ranges: dict[str, FieldRange] = {}
        for output, places in ((False, self.inputs), (True, self.outputs)):
            free: dict[Kind, int] = {Quantity: 0, Word: 0}
            for group, members in self.groups.items():
                for (field, kind), width in self._group_shape(members, places).items():
                    name = f"{group}.{field}"
                    if name in ranges:
                        raise NetworkError("", f"field {name!r} stands for two different things")
                    ranges[name] = FieldRange(kind, output, free[kind], len(members), width)
                    free[kind] += len(members) * width
        return ranges

    def _group_shape(self, members: Sequence[int], places: Iterable[Place]) -> dict[tuple[str, Kind], int]:
        """Name, kind and number of components of a group's fields; the same for all its devices."""
        shapes: dict[int, dict[tuple[str, Kind], int]] = {i: {} for i in members}
        for place in places:
            if place.device in shapes and place.field:
                key = (place.field.field, type(place.field))
                shapes[place.device][key] = place.component + 1
        first = shapes[members[0]]
        for i in members:
            if list(shapes[i].items()) != list(first.items()):
                raise NetworkError(
                    self.devices[i].name,
                    f"its fields differ from those of {self.devices[members[0]].name!r} in the same group; "
                    "put it into a group of its own",
                )
        return first

    def _byte_names(self) -> list[str]:
        names = [""] * self.raw_size
        for device, raw, length in zip(self.devices, self.tpdo_raw, self.tpdo_length, strict=True):
            names[raw : raw + length] = [f"{device.name}.padding"] * length
        for frame in self.output_frames:
            parts = (*_HEADER_NAMES, *["padding"] * (frame.length - HEADER))
            names[frame.raw : frame.raw + frame.length] = [f"0x{frame.can_id:03X}.{p}" for p in parts]
        for place in (*self.inputs, *self.outputs):
            name = self._place_name(place)
            names[place.raw : place.raw + place.mapped.size] = [name] * place.mapped.size
        return names

    def _place_name(self, place: Place) -> str:
        device = self.devices[place.device]
        if place.field is None:
            return f"{device.name}.{_ECHO_NAMES.get(place.mapped.address, place.mapped.name)}"
        vector = self.fields[f"{device.group}.{place.field.field}"].width > 1
        return f"{device.name}.{place.field.field}" + (f"[{place.component}]" if vector else "")


def _size(mapped: Iterable[Mapped]) -> int:
    return sum(item.size for item in mapped)


def _output_id(frame: int) -> int:
    return OUTPUT + frame if frame else SYNC


def _check_devices(devices: Sequence[Device]) -> None:
    names: set[str] = set()
    nodes: dict[int, str] = {}
    if not devices:
        raise NetworkError("", "a network needs at least one device")
    for device in devices:
        if not 1 <= device.node <= MAX_NODE:
            raise NetworkError(device.name, f"node {device.node} is not within 1 to {MAX_NODE}")
        if device.name in names:
            raise NetworkError(device.name, "another device has the same name")
        if device.node in nodes:
            raise NetworkError(device.name, f"node {device.node} is taken by {nodes[device.node]!r}")
        names.add(device.name)
        nodes[device.node] = device.name
        inputs, outputs = device.inputs(), device.outputs()
        _check_fields(device, inputs, device.dictionary.tpdo, "its TPDO (1A00h)")
        _check_fields(device, outputs, device.dictionary.rpdo, "its output slot (1600h)")
        for mapped in device.dictionary.rpdo:
            if mapped.address not in outputs:
                name = object_name(*mapped.address)
                raise NetworkError(device.name, f"output {name} ({mapped.name}) has no field")


def _check_fields(
    device: Device, fields: Mapping[Address, Field], mapped: Iterable[Mapped], where: str
) -> None:
    addresses = {item.address for item in mapped}
    for address, field in fields.items():
        if address not in addresses:
            name = object_name(*address)
            raise NetworkError(
                device.name, f"field {field.field!r}: {device.eds} does not map {name} in {where}"
            )
        if isinstance(field, Quantity):
            usable = math.isfinite(field.scale) and math.isfinite(field.shift) and field.scale != 0.0
            if not usable:
                raise NetworkError(
                    device.name,
                    f"field {field.field!r}: scale {field.scale} and shift {field.shift} "
                    "must be finite, and the scale not zero",
                )


def _assign_slots(devices: Sequence[Device]) -> tuple[Slot | None, ...]:
    """First fit: each slot goes whole into the first frame that has room for it."""
    ends = [HEADER]
    slots: list[Slot | None] = []
    for device in devices:
        size = _size(device.dictionary.rpdo)
        if size == 0:
            slots.append(None)
            continue
        if size > MAX_DATA - HEADER:
            raise NetworkError(
                device.name, f"{size} bytes of outputs; a frame has room for {MAX_DATA - HEADER}"
            )
        frame = next((k for k, end in enumerate(ends) if end + size <= MAX_DATA), len(ends))
        if frame == len(ends):
            ends.append(HEADER)
        slots.append(Slot(frame, ends[frame], size))
        ends[frame] += size
    if len(ends) > MAX_OUTPUT_FRAME + 1:
        raise NetworkError("", f"the outputs need {len(ends)} frames; there are {MAX_OUTPUT_FRAME + 1}")
    return tuple(slots)


def _output_frames(slots: Iterable[Slot | None], raw: int) -> tuple[OutputFrame, ...]:
    """The frames in sending order: 0x101, 0x102, ..., and SYNC last."""
    ends = {0: HEADER}
    for slot in slots:
        if slot:
            ends[slot.frame] = slot.offset + slot.size
    frames: list[OutputFrame] = []
    for frame in (*range(1, len(ends)), 0):
        length = padded_length(ends[frame])
        frames.append(OutputFrame(_output_id(frame), length, raw))
        raw += length
    return tuple(frames)


def _places(
    device: int, mapped: Iterable[Mapped], fields: Mapping[Address, Field], start: int
) -> list[Place]:
    """Where the objects of one PDO are; those of one field are numbered in mapping order."""
    places: list[Place] = []
    components: dict[str, int] = {}
    for item in mapped:
        field = fields.get(item.address)
        component = components.get(field.field, 0) if field else 0
        if field:
            components[field.field] = component + 1
        places.append(Place(device, item, field, component, start + item.offset))
    return places
