"""The object dictionary of a simulated device, and the SDO server over it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, cast

from canopen import LocalNode, SdoAbortedError
from canopen.sdo.constants import (
    ABORT_INVALID_COMMAND_SPECIFIER,
    ABORT_VALUE_TOO_HIGH,
    ABORT_VALUE_TOO_LOW,
    EXPEDITED,
    NO_MORE_DATA,
    REQUEST_BLOCK_DOWNLOAD,
    REQUEST_BLOCK_UPLOAD,
    REQUEST_DOWNLOAD,
    REQUEST_SEGMENT_DOWNLOAD,
    REQUEST_SEGMENT_UPLOAD,
    REQUEST_UPLOAD,
    RESPONSE_ABORTED,
    SIZE_SPECIFIED,
)

from ..devices.cia301 import Address
from ..devices.device import Device
from ..devices.dictionary import Value
from ..devices.sdo import LENGTH, MAX_TRANSFER

_SPECIFIER: Final = 0xE0
_SEGMENT: Final = 7
_DEVICE_STATE: Final = 0x08000022
_WRONG_LENGTH: Final = 0x06070010
_OUT_OF_MEMORY: Final = 0x05040005

Emit = Callable[[int, bytes], None]
Live = Callable[[Address], Value | None]


class Objects(LocalNode):
    """The canopen library's local node without its network and its threads.

    Objects that a PDO maps, and whatever else the device measures, are read as they are at that moment. What
    the output slot holds is not to be written by SDO: it would not last until the next output frame.

    Attributes:
        refuse: abort codes for objects that SDO shall not reach.
    """

    def __init__(
        self, device: Device, emit: Emit, written: Callable[[], None], live: Live = lambda _: None
    ) -> None:
        """Take over the objects of a device.

        Args:
            device: what it is.
            emit: sends a frame.
            written: called after SDO wrote an object.
            live: the raw value of an object that changes by itself; None for all others.
        """
        super().__init__(device.node, device.dictionary.objects)
        self._write_callbacks.clear()  # theirs would start a heartbeat thread
        self._device = device
        self._emit = emit
        self._written = written
        self._live = live
        self._outputs = {mapped.address for mapped in device.dictionary.rpdo}
        self._server = cast(Any, self.sdo)
        self._server.network = self
        self.refuse: dict[Address, int] = {}
        self.restore()

    def restore(self) -> None:
        """Back to the values after power-up."""
        self.data_store.clear()
        self._server._index = self._server._subindex = 0
        self._continues = -1
        self._announced: int | None = None
        self._sent = RESPONSE_ABORTED
        for address, value in self._device.facts().items():
            self.write(address, value)
        if self._device.serial is not None:
            self.write((0x1018, 4), self._device.serial)

    def read(self, address: Address) -> Value:
        """The value of an object."""
        return cast(Value, self._device.dictionary.decode(address, self.get_data(*address)))

    def write(self, address: Address, value: Value) -> None:
        """Sets the value of an object, read-only or not."""
        index, subindex = address
        self.data_store.setdefault(index, {})[subindex] = self._device.dictionary.encode(address, value)

    def request(self, data: bytes) -> None:
        """Serves one SDO request; the response goes to `emit`."""
        if len(data) != LENGTH:
            return
        command = data[0] & _SPECIFIER
        if command in (REQUEST_SEGMENT_UPLOAD, REQUEST_SEGMENT_DOWNLOAD):
            self._segment(command, data)
        else:
            self._begin(command, data)

    def get_data(self, index: int, subindex: int, check_readable: bool = False) -> bytes:
        """The bytes of an object; called by the server."""
        if check_readable:
            if (index, subindex) in self.refuse:
                raise SdoAbortedError(self.refuse[index, subindex])
            now = self._live((index, subindex))
            if now is not None:
                return self._device.dictionary.encode((index, subindex), now)
        return bytes(super().get_data(index, subindex, check_readable))

    def set_data(self, index: int, subindex: int, data: bytes, check_writable: bool = False) -> None:
        """Stores the bytes of an object; called by the server."""
        if (index, subindex) in self.refuse:
            raise SdoAbortedError(self.refuse[index, subindex])
        if check_writable and (index, subindex) in self._outputs:
            raise SdoAbortedError(_DEVICE_STATE)
        self._check_range((index, subindex), data)
        super().set_data(index, subindex, data, check_writable)
        self._written()

    def _begin(self, command: int, data: bytes) -> None:
        """A request that begins a transfer, or aborts one; a transfer under way is over."""
        self._continues = -1
        if command in (REQUEST_BLOCK_UPLOAD, REQUEST_BLOCK_DOWNLOAD):
            # taking another protocol instead is not for the server to choose: the client may forbid it
            self._server._index, self._server._subindex = int.from_bytes(data[1:3], "little"), data[3]
            self._server.abort(ABORT_INVALID_COMMAND_SPECIFIER)
            return
        self._sent = RESPONSE_ABORTED
        self._server.on_request(0, data, 0.0)
        if self._sent & _SPECIFIER == RESPONSE_ABORTED:
            return
        if command == REQUEST_UPLOAD and not self._sent & EXPEDITED:
            self._continues = REQUEST_SEGMENT_UPLOAD
        elif command == REQUEST_DOWNLOAD and not data[0] & EXPEDITED:
            self._continues = REQUEST_SEGMENT_DOWNLOAD
            self._announced = int.from_bytes(data[4:], "little") if data[0] & SIZE_SPECIFIED else None

    def _segment(self, command: int, data: bytes) -> None:
        """A request that goes on with a transfer."""
        if command != self._continues:
            self._continues = -1
            self._server.abort(ABORT_INVALID_COMMAND_SPECIFIER)
            return
        last = bool(data[0] & NO_MORE_DATA)
        if command == REQUEST_SEGMENT_DOWNLOAD:
            size = len(self._server._buffer) + _SEGMENT - (data[0] >> 1 & 7)
            wrong = last and self._announced is not None and size != self._announced
            if wrong or size > MAX_TRANSFER:
                self._continues = -1
                self._server.abort(_WRONG_LENGTH if wrong else _OUT_OF_MEMORY)
                return
        self._sent = RESPONSE_ABORTED
        self._server.on_request(0, data, 0.0)
        if command == REQUEST_SEGMENT_UPLOAD:
            last = bool(self._sent & NO_MORE_DATA)
        if last or self._sent & _SPECIFIER == RESPONSE_ABORTED:
            self._continues = -1

    def send_message(self, can_id: int, data: bytes) -> None:
        """Where the server sends its responses."""
        self._sent = data[0]
        self._emit(can_id, bytes(data))

    def _check_range(self, address: Address, data: bytes) -> None:
        index, subindex = address
        if self.object_dictionary.get_variable(index, subindex) is None:
            return  # the library refuses it with the right abort code
        variable = self._device.dictionary.variable(address)
        value = self._device.dictionary.decode(address, data)
        if isinstance(value, int):
            if variable.min is not None and value < variable.min:
                raise SdoAbortedError(ABORT_VALUE_TOO_LOW)
            if variable.max is not None and value > variable.max:
                raise SdoAbortedError(ABORT_VALUE_TOO_HIGH)
