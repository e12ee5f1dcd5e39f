"""A simulated device: a peer on the wire, bytes in and bytes out, whose only clock is plant time."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import attrgetter
from typing import Any, Final

from ..devices.cia301 import (
    AL_STATE,
    COUNTER_ECHO,
    EMCY,
    EMCY_RPDO_TIMEOUT,
    ERROR_REGISTER,
    HEARTBEAT,
    HEARTBEAT_TIME,
    OUTPUT_WATCHDOG,
    SLOT_FRAME,
    SLOT_OFFSET,
    TPDO,
    Address,
    AlState,
    NmtCommand,
    NmtState,
)
from ..devices.device import Device, Quantity
from ..devices.dictionary import Value
from ..devices.frames import padded_length
from .objects import Objects

Tamper = Callable[[int, bytes], Iterable[tuple[int, bytes]]]

# bound once: looking a member up in its enum takes longer than using it
_OPERATIONAL: Final = NmtState.OPERATIONAL
_SAFEOP: Final = AlState.SAFEOP
_OP: Final = AlState.OP
_MILLISECOND: Final = 1_000_000  # ns
_ERROR_GENERIC: Final = 0x01
_ERROR_COMMUNICATION: Final = 0x10
_EMCY: Final = struct.Struct("<HB5s")
_LIMITS: Final[dict[str, tuple[float, float]]] = {
    "B": (0, 0xFF),
    "b": (-0x80, 0x7F),
    "H": (0, 0xFFFF),
    "h": (-0x8000, 0x7FFF),
    "I": (0, 0xFFFFFFFF),
    "i": (-0x80000000, 0x7FFFFFFF),
    "f": (-3.4028234663852886e38, 3.4028234663852886e38),
}


class SimNode:
    """What all simulated devices have: NMT, heartbeat, SDO server, SYNC, AL state, output watchdog.

    The attributes named like the input fields of the device are what it reports, those named like its
    output fields are what it was told, in SI units. They begin as 0 where a subclass does not say otherwise.

    Attributes:
        device: what it simulates.
        objects: its object dictionary.
        nmt_state, al_state: where it is.
        silent: nothing it sends gets out; it still hears.
        tamper: what becomes of a frame it sends (see `faults`), or None.
    """

    def __init__(self, device: Device, outbox: deque[tuple[int, bytes]]) -> None:
        self.device = device
        self.silent = False
        self.tamper: Tamper | None = None
        self._outbox = outbox
        self._begin()
        self.objects = Objects(device, self.emit, self._configure, self._now)
        dictionary = device.dictionary
        self._tpdo = struct.Struct("<" + "".join(m.code for m in dictionary.tpdo))
        self._tpdo_length = padded_length(self._tpdo.size)
        self._rpdo = struct.Struct("<" + "".join(m.code for m in dictionary.rpdo))
        self._rows = _input_rows(device)
        self._values = _getter(device)
        self._limits = [_LIMITS[m.code] for m in dictionary.tpdo[2:]]
        self._outputs = _output_rows(device)
        self._inputs = {mapped.address: i for i, mapped in enumerate(dictionary.tpdo[2:])}
        self.reset()

    def reset(self) -> None:
        """Power-up, or NMT reset: initial values, boot-up message, PREOP."""
        self.objects.restore()
        self.nmt_state = NmtState.PRE_OPERATIONAL
        self.al_state = AlState.PREOP
        self._heartbeat_age = 0
        self._output_age = 0
        self._counter: int | None = None
        self._watchdog_tripped = False
        self._error_register = 0
        self._configure()
        self.emit(HEARTBEAT + self.device.node, bytes([NmtState.BOOT_UP]))

    def emit(self, can_id: int, data: bytes) -> None:
        """Sends a frame, unless a fault is injected."""
        if self.silent:
            return
        if self.tamper is None:
            self._outbox.append((can_id, data))
        else:
            self._outbox.extend(self.tamper(can_id, data))

    def emergency(self, code: int, error_register: int) -> None:
        """Sends an EMCY message; code 0 = the error is gone."""
        self._error_register = error_register
        self.emit(EMCY + self.device.node, _EMCY.pack(code, error_register, b""))

    def command(self, command: int) -> None:
        """Obeys an NMT command."""
        match command:
            case NmtCommand.START:
                self.nmt_state = NmtState.OPERATIONAL
                self.al_state = AlState.SAFEOP
                self._counter = None
            case NmtCommand.STOP:
                self._leave_operational(NmtState.STOPPED)
            case NmtCommand.ENTER_PRE_OPERATIONAL:
                self._leave_operational(NmtState.PRE_OPERATIONAL)
            case NmtCommand.RESET_NODE | NmtCommand.RESET_COMMUNICATION:
                self.outputs_invalid()
                self.reset()

    def sync(self, counter: int, valid: bool, frames: Mapping[int, bytes]) -> None:
        """Latches the outputs and answers with the inputs.

        Args:
            counter: of this SYNC.
            valid: whether the master marks the outputs valid.
            frames: payloads of the output frames that carry this counter, by number.
        """
        if self.nmt_state is not _OPERATIONAL:
            return
        if not valid:
            if self._watchdog_tripped:  # the master knows: it asked for SAFEOP
                self._watchdog_tripped = False
                self.watchdog_acknowledged()
            if self.al_state is _OP:
                self.al_state = _SAFEOP
                self.outputs_invalid()
        elif not self._watchdog_tripped:
            self._latch(counter, frames)
        self._counter = counter
        self.emit(TPDO + self.device.node, self._answer(counter))

    def advance(self, dt: int) -> None:
        """Lets plant time pass.

        Args:
            dt: nanoseconds.
        """
        if self._heartbeat_time:
            self._heartbeat_age += dt
            if self._heartbeat_age >= self._heartbeat_time:
                self._heartbeat_age %= self._heartbeat_time
                self.emit(HEARTBEAT + self.device.node, bytes([self.nmt_state]))
        if self._outputs and self.al_state is _OP:
            self._output_age += dt
            if self._output_age >= self._watchdog_time:
                self._watchdog_tripped = True
                self.al_state = _SAFEOP
                self.watchdog_tripped()

    def outputs_latched(self) -> None:
        """Called after new outputs were set; for subclasses."""

    def outputs_invalid(self) -> None:
        """Called when the device leaves OP because the master said so; for subclasses."""

    def watchdog_tripped(self) -> None:
        """Called when the device leaves OP because the master is silent; for subclasses."""
        self.emergency(EMCY_RPDO_TIMEOUT, _ERROR_GENERIC | _ERROR_COMMUNICATION)

    def watchdog_acknowledged(self) -> None:
        """Called when the master has acknowledged that; for subclasses."""
        self.emergency(0, 0)

    def _begin(self) -> None:
        """Every field that the kind of device describes, and its subclass does not define."""
        for fields in (self.device.inputs().values(), self.device.outputs().values()):
            names = [field.field for field in fields]
            for field in fields:
                if not hasattr(type(self), field.field) and field.field not in vars(self):
                    zero, count = (0.0 if isinstance(field, Quantity) else 0), names.count(field.field)
                    setattr(self, field.field, zero if count == 1 else (zero,) * count)

    def _leave_operational(self, state: NmtState) -> None:
        self.nmt_state = state
        self.al_state = AlState.PREOP
        self.outputs_invalid()

    def _configure(self) -> None:
        """Takes over what SDO may have written."""
        read: Any = self.objects.read
        self._heartbeat_time = read(HEARTBEAT_TIME) * _MILLISECOND
        if self._rpdo.size:
            self._slot_frame, self._slot_offset = read(SLOT_FRAME), read(SLOT_OFFSET)
            self._watchdog_time = read(OUTPUT_WATCHDOG) * _MILLISECOND

    def _latch(self, counter: int, frames: Mapping[int, bytes]) -> None:
        if not self._outputs:
            self.al_state = _OP
            return
        payload = frames.get(self._slot_frame, b"")
        if counter == self._counter or len(payload) < self._slot_offset + self._rpdo.size:
            return  # nothing new: the watchdog goes on
        self.al_state = _OP
        self._output_age = 0
        raw = self._rpdo.unpack_from(payload, self._slot_offset)
        for (name, scale, shift), value in zip(self._outputs, raw, strict=True):
            setattr(self, name, value if scale is None else value * scale + shift)
        self.outputs_latched()

    def _answer(self, counter: int) -> bytes:
        numbers = self._numbers()
        try:
            payload = self._tpdo.pack(counter, self.al_state, *numbers)
        except (struct.error, OverflowError):
            payload = self._tpdo.pack(counter, self.al_state, *self._bounded(numbers))
        return payload.ljust(self._tpdo_length, b"\0")

    def _numbers(self) -> list[Any]:
        """What it reports now, as the TPDO carries it."""
        return [
            value if gain is None else round((value - shift) * gain) if whole else (value - shift) * gain
            for value, (gain, shift, whole) in zip(self._values(self), self._rows, strict=True)
        ]

    def _bounded(self, numbers: list[Any]) -> list[Any]:
        return [min(max(x, low), high) for x, (low, high) in zip(numbers, self._limits, strict=True)]

    def _now(self, address: Address) -> Value | None:
        """The raw value of an object that changes by itself; None for all others."""
        if address in self._inputs:
            value: Value = self._bounded(self._numbers())[self._inputs[address]]
            return value
        if address == COUNTER_ECHO:
            return self._counter or 0
        if address == AL_STATE:
            return int(self.al_state)
        if address == ERROR_REGISTER:
            return self._error_register
        return None


def _input_rows(device: Device) -> list[tuple[float | None, float, bool]]:
    """How fields become the numbers of the TPDO: 1 / scale (None = word), shift, and whether whole."""
    fields = device.inputs()
    rows: list[tuple[float | None, float, bool]] = []
    for mapped in device.dictionary.tpdo[2:]:
        field = fields.get(mapped.address)
        if isinstance(field, Quantity):
            rows.append((1.0 / field.scale, field.shift, mapped.code != "f"))
        else:
            rows.append((None, 0.0, True))
    return rows


def _getter(device: Device) -> Callable[[SimNode], Sequence[Any]]:
    """What reads the fields of a node, vectors spread out, in mapping order; 0 for unnamed objects."""
    fields = device.inputs()
    names = [fields[m.address].field if m.address in fields else "" for m in device.dictionary.tpdo[2:]]
    if len(names) > 1 and len(set(names)) == len(names) and all(names):
        return attrgetter(*names)
    places = [(name, names[:i].count(name), names.count(name) > 1) for i, name in enumerate(names)]

    def values(node: SimNode) -> list[Any]:
        found = []
        for name, component, vector in places:
            value: Any = getattr(node, name) if name else 0
            found.append(value[component] if vector and name else value)
        return found

    return values


def _output_rows(device: Device) -> list[tuple[str, float | None, float]]:
    """How the numbers of the slot become fields, in mapping order: name, scale (None = word), shift."""
    fields = device.outputs()
    rows: list[tuple[str, float | None, float]] = []
    for mapped in device.dictionary.rpdo:
        field = fields[mapped.address]
        if isinstance(field, Quantity):
            rows.append((field.field, field.scale, field.shift))
        else:
            rows.append((field.field, None, 0.0))
    return rows
