"""Making the devices ready: reset, boot-up, configuration, start; one step per tick.

Nothing here waits or knows the time: deadlines count ticks, and all devices are served side by side.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

from . import sdo
from .cia301 import (
    HEARTBEAT,
    NMT,
    SDO_REQUEST,
    SDO_RESPONSE,
    Address,
    AlState,
    NmtCommand,
    NmtState,
)
from .configuration import Script, configure
from .device import Device
from .errors import (
    ConfigurationTimeoutError,
    MissingDevicesError,
    SdoError,
    SilentDeviceError,
    StartError,
    TransferError,
    object_name,
)
from .frames import Frames
from .image import ProcessImage

REQUESTS_PER_TICK: Final = 4  # leaves the bus to SYNC and its answers, and fits a short transmit queue
_BOOT_UP: Final = bytes([NmtState.BOOT_UP])


class BringupState(Enum):
    """Where the bring-up is; the value is for people."""

    RESETTING = "resetting"
    BOOTING = "waiting for boot-up"
    CONFIGURING = "configuring"
    STARTING = "waiting for SAFEOP"
    READY = "ready"


@dataclass(frozen=True, slots=True)
class Deadlines:
    """How long things may take, in ticks.

    Attributes:
        boot: from NMT reset to the last boot-up message.
        response: from an SDO request to its response.
        configuration: of all devices.
        start: from NMT start to SAFEOP.
    """

    boot: int = 3000
    response: int = 100
    configuration: int = 20000
    start: int = 500

    @classmethod
    def at(cls, rate: float) -> Deadlines:
        """The same times, by default those at 1 kHz, in ticks at another rate [Hz]."""
        return cls(*(max(1, round(1e-3 * getattr(cls(), name) * rate)) for name in cls.__slots__))


class _Client:
    """The SDO client of one device, running its script.

    Attributes:
        device: the device.
        request: what to send, or what was sent; None when the script is done.
        waiting: ticks since it was sent, -1 = not sent yet.
        address: the object it is at.
    """

    def __init__(self, device: Device, script: Script) -> None:
        self.device = device
        self._script = script
        self.request: bytes | None = None
        self.waiting = -1
        self.address: Address = (0, 0)
        self.resume(None)

    def resume(self, response: bytes | None) -> None:
        """Gives the script its response (None = starts it) and takes its next request."""
        self.waiting = -1
        try:
            self.request = next(self._script) if response is None else self._script.send(response)
        except StopIteration:
            self.request = None
        except SdoError as error:
            raise TransferError(self.device.name, self.device.eds, error) from error
        else:
            self.address = sdo.address_of(self.request) or self.address


class Bringup:
    """Takes the devices of a network from any state to SAFEOP.

    Call once per tick, between `ProcessImage.latch` and `ProcessImage.compose`: SYNC has to run,
    with outputs not valid.

    Attributes:
        state: where it is.
    """

    def __init__(
        self,
        image: ProcessImage,
        deadlines: Deadlines | None = None,
        heartbeat_ms: int = 100,
        watchdog_ms: int = 20,
    ) -> None:
        self.state = BringupState.RESETTING
        self._image = image
        self._network = image.network
        self._deadlines = deadlines or Deadlines()
        self._periods = (heartbeat_ms, watchdog_ms)
        self._ticks = 0
        self._booted: set[int] = set()
        self._clients: dict[int, _Client] = {}

    @property
    def progress(self) -> str:
        """One line for people."""
        devices = self._network.devices
        if self.state is BringupState.BOOTING:
            missing = [d.name for d in devices if d.node not in self._booted]
            return f"{self.state.value}: {', '.join(missing)}"
        if self.state is BringupState.CONFIGURING:
            busy = [client for client in self._clients.values() if client.request]
            names = ", ".join(f"{client.device.name} {object_name(*client.address)}" for client in busy)
            return f"{self.state.value}: {len(devices) - len(busy)} of {len(devices)} done; {names}"
        return str(self.state.value)

    def step(self, frames_in: Frames, frames_out: Frames) -> BringupState:
        """One tick: takes boot-up messages and SDO responses, appends NMT commands and SDO requests.

        Raises:
            BringupError: a device is missing, silent, not what the configuration says, or refuses;
                the subclasses say which object, and how to mend it.
            EdsError: a setting that the device's EDS does not know or cannot hold.
        """
        self._ticks += 1
        match self.state:
            case BringupState.RESETTING:
                frames_out.append(NMT, bytes([NmtCommand.RESET_NODE, 0]))
                self._enter(BringupState.BOOTING)
            case BringupState.BOOTING:
                self._boot(frames_in)
            case BringupState.CONFIGURING:
                self._configure(frames_in, frames_out)
            case BringupState.STARTING:
                self._start()
            case BringupState.READY:
                pass
        return self.state

    def _enter(self, state: BringupState) -> None:
        self.state = state
        self._ticks = 0

    def _boot(self, frames: Frames) -> None:
        self._booted |= _boot_ups(frames)
        missing = [d for d in self._network.devices if d.node not in self._booted]
        if not missing:
            self._clients = {d.node: self._client(d) for d in self._network.devices}
            self._enter(BringupState.CONFIGURING)
        elif self._ticks > self._deadlines.boot:
            names, nodes = [d.name for d in missing], [d.node for d in missing]
            raise MissingDevicesError(names, nodes, self._deadlines.boot)

    def _client(self, device: Device) -> _Client:
        slot = self._network.slots[self._network.index(device.name)]
        return _Client(device, configure(device, slot, *self._periods))

    def _configure(self, frames_in: Frames, frames_out: Frames) -> None:
        for node in _boot_ups(frames_in) & self._clients.keys():  # it restarted: from the beginning
            self._clients[node] = self._client(self._clients[node].device)
        for can_id, data in frames_in:
            asked = self._clients.get(can_id - SDO_RESPONSE)
            if asked and asked.waiting >= 0 and len(data) == sdo.LENGTH:
                asked.resume(data)
        busy = [client for client in self._clients.values() if client.request]
        if not busy:
            frames_out.append(NMT, bytes([NmtCommand.START, 0]))
            self._image.reset()
            self._enter(BringupState.STARTING)
        elif self._ticks > self._deadlines.configuration:
            names = [client.device.name for client in busy]
            raise ConfigurationTimeoutError(names, self._deadlines.configuration)
        else:
            self._ask(busy, frames_out)

    def _ask(self, clients: list[_Client], frames: Frames) -> None:
        """Sends the requests that are due, and watches those that wait."""
        room = REQUESTS_PER_TICK
        for client in clients:
            device = client.device
            if client.waiting >= 0:
                client.waiting += 1
                if client.waiting > self._deadlines.response:
                    raise SilentDeviceError(
                        device.name, device.node, *client.address, self._deadlines.response
                    )
            elif room and client.request:
                frames.append(SDO_REQUEST + device.node, client.request)
                client.waiting = 0
                room -= 1

    def _start(self) -> None:
        image = self._image
        if image.working_counter == image.expected and (image.al_state == AlState.SAFEOP).all():
            self._enter(BringupState.READY)
        elif self._ticks > self._deadlines.start:
            late = [
                (device.name, AlState(state).name if state in set(AlState) else str(state))
                for device, state, fresh in zip(
                    self._network.devices, image.al_state.tolist(), image.fresh.tolist(), strict=True
                )
                if state != AlState.SAFEOP or not fresh
            ]
            raise StartError([n for n, _ in late], [s for _, s in late], self._deadlines.start)


def _boot_ups(frames: Frames) -> set[int]:
    """The nodes that sent a boot-up message."""
    return {can_id - HEARTBEAT for can_id, data in frames if can_id > HEARTBEAT and data == _BOOT_UP}
