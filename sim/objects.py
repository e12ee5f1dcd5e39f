"""The object dictionary of a simulated device, and the SDO server over it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from canopen import LocalNode, SdoAbortedError
from canopen.sdo.constants import (
    ABORT_INVALID_COMMAND_SPECIFIER,
    ABORT_VALUE_TOO_HIGH,
    ABORT_VALUE_TOO_LOW,
    REQUEST_BLOCK_DOWNLOAD,
    REQUEST_SEGMENT_DOWNLOAD,
    REQUEST_SEGMENT_UPLOAD,
)

from ..devices.cia301 import Address
from ..devices.device import Device
from ..devices.dictionary import Value

_SPECIFIER = 0xE0
_LENGTH = 8

Emit = Callable[[int, bytes], None]


class Objects(LocalNode):
    """The canopen library's local node without its network and its threads.

    Attributes:
        refuse: abort codes for objects that SDO shall not reach.
    """

    def __init__(self, device: Device, emit: Emit, written: Callable[[], None]) -> None:
        super().__init__(device.node, device.dictionary.objects)
        self._write_callbacks.clear()  # theirs would start a heartbeat thread
        self._device = device
        self._emit = emit
        self._written = written
        self._server = cast(Any, self.sdo)
        self._server.network = self
        self.refuse: dict[Address, int] = {}
        self.restore()

    def restore(self) -> None:
        """Back to the values after power-up."""
        self.data_store.clear()
        self._server._index = self._server._subindex = 0
        self._server._buffer = None
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
        if len(data) != _LENGTH:
            return
        command = data[0] & _SPECIFIER
        continues = command in (REQUEST_SEGMENT_UPLOAD, REQUEST_SEGMENT_DOWNLOAD)
        if command == REQUEST_BLOCK_DOWNLOAD or (continues and self._server._buffer is None):
            self._server.abort(ABORT_INVALID_COMMAND_SPECIFIER)
        else:
            self._server.on_request(0, data, 0.0)

    def get_data(self, index: int, subindex: int, check_readable: bool = False) -> bytes:
        """The bytes of an object; called by the server."""
        if check_readable and (index, subindex) in self.refuse:
            raise SdoAbortedError(self.refuse[index, subindex])
        return bytes(super().get_data(index, subindex, check_readable))

    def set_data(self, index: int, subindex: int, data: bytes, check_writable: bool = False) -> None:
        """Stores the bytes of an object; called by the server."""
        if (index, subindex) in self.refuse:
            raise SdoAbortedError(self.refuse[index, subindex])
        self._check_range((index, subindex), data)
        super().set_data(index, subindex, data, check_writable)
        self._written()

    def send_message(self, can_id: int, data: bytes) -> None:
        """Where the server sends its responses."""
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
