"""A simulated device: a peer on the wire, bytes in and bytes out, whose only clock is plant time.

What it does in every cycle is in C (`csrc/peer.h`); NMT, SDO and power-up, which come now and then, are here.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from inspect import getattr_static
from typing import Any, ClassVar, Final

from ..devices.cia301 import (
    AL_STATE,
    COUNTER_ECHO,
    ERROR_REGISTER,
    HEARTBEAT,
    HEARTBEAT_TIME,
    OUTPUT_WATCHDOG,
    SLOT_FRAME,
    SLOT_OFFSET,
    Address,
    AlState,
    NmtCommand,
    NmtState,
)
from ..devices.device import Device
from ..devices.dictionary import Value
from ..devices.errors import NetworkError
from ..devices.frames import MAX_DATA
from ._plant import ffi, lib
from .attributes import FieldValue, Stored
from .objects import Objects
from .peers import Peers

Tamper = Callable[[int, bytes], Iterable[tuple[int, bytes]]]

_MILLISECOND: Final = 1_000_000  # ns


class SimNode:
    """What all simulated devices have: NMT, heartbeat, SDO server, SYNC, AL state, output watchdog.

    The attributes named like the input fields of the device are what it reports, those named like its
    output fields are what it was told, in SI units. They begin as 0 where a subclass does not say otherwise.

    Attributes:
        device: what it simulates.
        index: which device of the network.
        objects: its object dictionary.
        fields: the same as arrays, (components,) each; views.
        nmt_state, al_state: where it is.
        tripped: its output watchdog acted, and the master has not acknowledged that.
        silent: nothing it sends gets out; it still hears.
    """

    kind: ClassVar[int] = lib.PEER_PLAIN
    says: ClassVar[tuple[str, ...]] = ()
    """Fields that its kind fills itself, in the order of the C core."""

    nmt_state = Stored(NmtState)
    al_state = Stored(AlState)
    tripped = Stored(bool)
    silent = Stored(bool)

    def __init__(self, device: Device, peers: Peers, index: int) -> None:
        """Powers up a device of a network.

        Raises:
            NetworkError: it lacks a field that its kind needs, or has one that is no plain attribute.
        """
        self.device, self.index = device, index
        self._peers = peers
        self._core = peers.core.peers[index]
        self._core.kind = self.kind
        self._core.says[0 : len(self.says)] = [peers.place(index, name) for name in self.says]
        self._tamper: Tamper | None = None
        self.fields = peers.fields(index)
        self._adopt()
        self.objects = Objects(device, self.emit, self._configure, self._now)
        self._inputs = {mapped.address: mapped for mapped in device.dictionary.tpdo[2:]}
        self.reset()

    def reset(self) -> None:
        """Power-up, or NMT reset: initial values, boot-up message, PREOP."""
        core = self._core
        self.objects.restore()
        self.nmt_state = NmtState.PRE_OPERATIONAL
        self.al_state = AlState.PREOP
        core.heartbeat_age = core.output_age = core.tripped = core.error_register = 0
        core.counter = -1
        self._configure()
        self.emit(HEARTBEAT + self.device.node, bytes([NmtState.BOOT_UP]))

    @property
    def tamper(self) -> Tamper | None:
        """What becomes of a frame it sends when that goes out (see `faults`), or None."""
        return self._tamper

    @tamper.setter
    def tamper(self, tamper: Tamper | None) -> None:
        self._tamper = tamper
        self._core.tampered = tamper is not None

    def emit(self, can_id: int, data: bytes) -> None:
        """Sends a frame, unless a fault is injected."""
        lib.peers_emit(self._peers.core, self.index, can_id, data, len(data))

    def emergency(self, code: int, error_register: int) -> None:
        """Sends an EMCY message; code 0 = the error is gone."""
        lib.peers_emergency(self._peers.core, self.index, code, error_register)

    def command(self, command: int) -> None:
        """Obeys an NMT command."""
        match command:
            case NmtCommand.START:
                self.nmt_state = NmtState.OPERATIONAL
                self.al_state = AlState.SAFEOP
                self._core.counter = -1
            case NmtCommand.STOP:
                self._leave_operational(NmtState.STOPPED)
            case NmtCommand.ENTER_PRE_OPERATIONAL:
                self._leave_operational(NmtState.PRE_OPERATIONAL)
            case NmtCommand.RESET_NODE | NmtCommand.RESET_COMMUNICATION:
                lib.peers_invalid(self._peers.core, self.index)
                self.reset()

    def _leave_operational(self, state: NmtState) -> None:
        self.nmt_state = state
        self.al_state = AlState.PREOP
        lib.peers_invalid(self._peers.core, self.index)

    def _adopt(self) -> None:
        """Its fields are attributes, and begin as its class says."""
        kind = type(self)
        for name, values in self.fields.items():
            found = getattr_static(kind, name, 0)
            if isinstance(found, property | Stored):
                if name in self.says:
                    continue
                problem = f"{kind.__name__}.{name} is not a plain value; let the plant set the field"
                raise NetworkError(self.device.name, problem)
            if not isinstance(found, FieldValue):
                found = FieldValue(name, found)
                setattr(kind, name, found)
            values[:] = found.initial

    def _place(self, name: str) -> int:
        """Where a field that its kind needs is, among all that devices report, or that they are told."""
        place = self._peers.place(self.index, name)
        if place < 0:
            raise NetworkError(self.device.name, f"{type(self).__name__} needs its field {name!r}")
        return place

    def _configure(self) -> None:
        """Takes over what SDO may have written."""
        read: Any = self.objects.read
        core = self._core
        core.heartbeat_time = read(HEARTBEAT_TIME) * _MILLISECOND
        if core.outputs:
            core.slot_frame, core.slot_offset = read(SLOT_FRAME), read(SLOT_OFFSET)
            core.watchdog_time = read(OUTPUT_WATCHDOG) * _MILLISECOND

    def _now(self, address: Address) -> Value | None:
        """The raw value of an object that changes by itself; None for all others."""
        core = self._core
        if address in self._inputs:
            payload, mapped = ffi.new("uint8_t[]", MAX_DATA), self._inputs[address]
            lib.peers_report(self._peers.core, self.index, payload)
            value: Value
            (value,) = struct.unpack_from(f"<{mapped.code}", ffi.buffer(payload), mapped.offset)
            return value
        if address == COUNTER_ECHO:
            return max(0, int(core.counter))
        if address == AL_STATE:
            return int(core.al_state)
        if address == ERROR_REGISTER:
            return int(core.error_register)
        return None
