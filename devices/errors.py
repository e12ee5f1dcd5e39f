"""What can go wrong with devices and the wire; every error carries its data and says how to mend it."""

from __future__ import annotations

from collections.abc import Sequence

from canopen.sdo.exceptions import SdoAbortedError


class DeviceError(Exception):
    """Base of all errors of this package."""


class FrameError(DeviceError):
    """Packed frames that cannot be unpacked, or more frames than a buffer holds."""


class EdsError(DeviceError):
    """An EDS file that cannot be used.

    Attributes:
        path: the file.
        reason: what is wrong with it.
    """

    def __init__(self, path: str, reason: str) -> None:
        super().__init__(f"{path}: {reason}")
        self.path = path
        self.reason = reason


class NetworkError(DeviceError):
    """A list of devices that makes no network.

    Attributes:
        device: name of the device, or "" where it concerns several.
        reason: what is wrong and what to write instead.
    """

    def __init__(self, device: str, reason: str) -> None:
        super().__init__(f"device {device!r}: {reason}" if device else reason)
        self.device = device
        self.reason = reason


class AdapterError(DeviceError):
    """A bus that cannot be opened.

    Attributes:
        bus: its name, as in the configuration.
        reason: what failed.
        remedy: what to type or change.
    """

    def __init__(self, bus: str, reason: str, remedy: str) -> None:
        super().__init__(f"{bus}: {reason}. {remedy}")
        self.bus = bus
        self.reason = reason
        self.remedy = remedy


class NoSocketCanError(AdapterError):
    """The kernel has no SocketCAN at all."""


def object_name(index: int, subindex: int) -> str:
    """An object as CiA 301 writes it: 1018h:01."""
    return f"{index:04X}h:{subindex:02X}"


class SdoError(DeviceError):
    """An SDO transfer that failed.

    Attributes:
        node, index, subindex: the object.
    """

    def __init__(self, node: int, index: int, subindex: int, what: str) -> None:
        super().__init__(f"node {node}, object {object_name(index, subindex)}: {what}")
        self.node = node
        self.index = index
        self.subindex = subindex


class SdoAbortError(SdoError):
    """The device aborted the transfer.

    Attributes:
        code: CiA 301 abort code.
    """

    def __init__(self, node: int, index: int, subindex: int, code: int) -> None:
        text = SdoAbortedError.CODES.get(code, "a code that CiA 301 does not list")
        super().__init__(node, index, subindex, f"aborted with 0x{code:08X} ({text})")
        self.code = code


class SdoProtocolError(SdoError):
    """The device answered something that is no answer to the request."""


class BringupError(DeviceError):
    """The devices could not be made ready.

    Attributes:
        devices: names of the devices concerned.
    """

    def __init__(self, devices: Sequence[str], what: str) -> None:
        super().__init__(what)
        self.devices = tuple(devices)


class MissingDevicesError(BringupError):
    """Devices that sent no boot-up message after NMT reset.

    Attributes:
        nodes: their node ids.
    """

    def __init__(self, devices: Sequence[str], nodes: Sequence[int], ticks: int) -> None:
        listed = ", ".join(f"{name} (node {node})" for name, node in zip(devices, nodes, strict=True))
        super().__init__(
            devices,
            f"no boot-up message within {ticks} ticks from {listed}. "
            "Check power, cabling and termination, the bit rates, that it speaks CAN FD, and the node id set "
            "on the device",
        )
        self.nodes = tuple(nodes)


class SilentDeviceError(BringupError):
    """A device that booted but does not answer an SDO request.

    Attributes:
        node, index, subindex: the object that was asked for.
    """

    def __init__(self, device: str, node: int, index: int, subindex: int, ticks: int) -> None:
        super().__init__(
            [device],
            f"{device} (node {node}) gave no answer for object {object_name(index, subindex)} "
            f"within {ticks} ticks. Check its supply and the load on the bus",
        )
        self.node = node
        self.index = index
        self.subindex = subindex


class TransferError(BringupError):
    """An SDO transfer of the start-up sequence that failed; the cause says how."""

    def __init__(self, device: str, eds: str, cause: SdoError) -> None:
        super().__init__(
            [device], f"{device}: {cause}. Does {eds} belong to the device and to its firmware version?"
        )


class MismatchError(BringupError):
    """A device that is not what the configuration says.

    Attributes:
        node, index, subindex: the object that was compared.
        expected, got: its values.
    """

    def __init__(
        self, device: str, node: int, index: int, subindex: int, expected: object, got: object, remedy: str
    ) -> None:
        super().__init__(
            [device],
            f"{device} (node {node}), object {object_name(index, subindex)}: "
            f"expected {_shown(expected)}, got {_shown(got)}. {remedy}",
        )
        self.node = node
        self.index = index
        self.subindex = subindex
        self.expected = expected
        self.got = got


class ConfigurationTimeoutError(BringupError):
    """The configuration of some devices did not end: they restart again and again."""

    def __init__(self, devices: Sequence[str], ticks: int) -> None:
        super().__init__(
            devices,
            f"{', '.join(devices)} not configured within {ticks} ticks. "
            "If a device restarts again and again, check its supply",
        )


class StartError(BringupError):
    """Devices that did not reach SAFEOP after NMT start."""

    def __init__(self, devices: Sequence[str], states: Sequence[str], ticks: int) -> None:
        listed = ", ".join(f"{name} ({state})" for name, state in zip(devices, states, strict=True))
        super().__init__(
            devices,
            f"not in SAFEOP within {ticks} ticks after NMT start: {listed}. "
            "Look for an emergency message, and whether its TPDO 1 answers SYNC",
        )


class DriveError(DeviceError):
    """A drive that is not in the CiA 402 state it should be in.

    Attributes:
        device, node: the drive.
        state: name of the state it reports.
        statusword: 6041h.
    """

    def __init__(self, device: str, node: int, state: str, statusword: int, what: str) -> None:
        super().__init__(f"{device} (node {node}) {what}; it reports {state} (statusword 0x{statusword:04X})")
        self.device = device
        self.node = node
        self.state = state
        self.statusword = statusword


class TransitionError(DriveError):
    """A transition that was not done in time, or that led elsewhere.

    Attributes:
        transition: its number in CiA 402.
    """

    def __init__(
        self, device: str, node: int, state: str, statusword: int, transition: int, what: str
    ) -> None:
        super().__init__(device, node, state, statusword, f"did not make transition {transition}: {what}")
        self.transition = transition


class UnheardError(DriveError):
    """A drive that does not answer, so that nobody knows where it is; `state` is what it last reported."""

    def __init__(self, device: str, node: int, state: str, statusword: int, ticks: int) -> None:
        what = f"has not answered for {ticks} ticks"
        super().__init__(device, node, f"{state}, long ago", statusword, what)
        self.ticks = ticks


class LeftStateError(DriveError):
    """A drive that left the state it was told to hold."""

    def __init__(self, device: str, node: int, state: str, statusword: int, target: str) -> None:
        super().__init__(device, node, state, statusword, f"left {target} by itself")


class DriveFaultError(DriveError):
    """A drive in fault.

    Attributes:
        error_code: 603Fh.
    """

    def __init__(self, device: str, node: int, state: str, statusword: int, error_code: int) -> None:
        super().__init__(
            device,
            node,
            state,
            statusword,
            f"is in fault, error code 0x{error_code:04X}: clear the cause, then reset",
        )
        self.error_code = error_code


class DriveModeError(DriveError):
    """A drive in another mode of operation than its own, enabled or about to be.

    Attributes:
        mode: 6061h.
    """

    def __init__(self, device: str, node: int, state: str, statusword: int, mode: int, own: int) -> None:
        super().__init__(device, node, state, statusword, f"runs in mode {mode} (6061h) instead of {own}")
        self.mode = mode


def _shown(value: object) -> str:
    return f"{value} (0x{value:X})" if isinstance(value, int) and value >= 0 else repr(value)
