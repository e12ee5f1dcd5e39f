"""Any interface of python-can as a bus: slower than the batch calls, but it runs nearly everything."""

from __future__ import annotations

import contextlib
import inspect
import re
import secrets
import shlex
import sys
from collections.abc import Mapping
from importlib import import_module, metadata
from typing import Any, Final

import can
from can.interfaces import BACKENDS

from ..configs.words import nearest
from .errors import AdapterError, FrameError
from .frames import Frames

RESERVED: Final = (
    "interface",
    "channel",
    "bitrate",
    "data_bitrate",
    "fd",
    "protocol",
    "timing",
    "receive_own_messages",
)
"""Settings of python-can that have keys of their own, or that the wire decides."""

_ERROR_FRAME: Final = 0x20000000
_EXTENDED: Final = 0x80000000
_REMOTE: Final = 0x40000000
_IDENTIFIER: Final = 0x1FFFFFFF
_CLOCK: Final = 80_000_000  # Hz; of nearly every CAN FD controller
_SAMPLE_POINTS: Final = (80.0, 75.0)  # % of a bit, and of a data bit
_OWN_EXTRAS: Final = {"udp_multicast": "multicast", "slcan": "serial", "robotell": "serial"}
_EXAMPLE_CHANNELS: Final = {
    "udp_multicast": "239.74.163.2",
    "pcan": "PCAN_USBBUS1",
    "kvaser": "0",
    "vector": "0",
    "ixxat": "0",
}
_PACKAGE: Final = re.compile(r"^[A-Za-z0-9._-]+")
_DOCUMENTED: Final = re.compile(r":param (?:[^:\n]* )?(\w+):")


class PythonCanAdapter:
    """A `can.Bus` in CAN FD mode.

    What this end sent itself and hears again, as udp_multicast and `receive_own_messages` have it, is
    dropped: it comes marked as sent, or with the name that this end put on it.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self._name = f"hapticd-{secrets.token_hex(8)}"
        self._shut = False
        self.closed = False
        self.unsent = 0
        self.malformed = 0

    def receive(self, frames: Frames) -> int:
        """Replaces the contents of `frames` by what has arrived; returns how many."""
        frames.clear()
        failures = 0
        attempts = 0 if self.closed else frames.pointer.capacity  # a flood must not hold us here
        for _ in range(attempts):
            try:
                message = self._bus.recv(timeout=0)
            except Exception:  # drivers raise what they like; one bad datagram is no reason to end
                failures += 1
                continue
            if message is None:
                break
            if message.is_rx and message.channel != self._name:
                self._take(message, frames)
        self.malformed += failures
        self.closed = self.closed or failures == attempts
        return len(frames)

    def send(self, frames: Frames) -> None:
        """Sends all of `frames`, one after the other; what the interface does not take is counted."""
        for can_id, data in frames:
            message = can.Message(
                arbitration_id=can_id,
                is_extended_id=False,
                is_fd=True,
                bitrate_switch=True,
                data=data,
                channel=self._name,
            )
            try:
                self._bus.send(message, timeout=0)
            except Exception:  # a full queue, bus off, unplugged: every driver has errors of its own
                self.unsent += 1

    def fileno(self) -> int:
        """The interface's file descriptor, or -1 where it has none."""
        try:
            return self._bus.fileno()
        except (NotImplementedError, can.CanError, OSError):
            return -1

    def close(self) -> None:
        """Shuts the interface down."""
        self.closed = True
        if not self._shut:
            self._shut = True
            with contextlib.suppress(Exception):  # an adapter that was pulled out cannot be shut down
                self._bus.shutdown()

    def _take(self, message: can.Message, frames: Frames) -> None:
        can_id = message.arbitration_id & _IDENTIFIER
        if message.is_error_frame:
            can_id |= _ERROR_FRAME
        elif message.is_extended_id:
            can_id |= _EXTENDED
        if message.is_remote_frame:
            can_id |= _REMOTE
        try:
            frames.append(can_id, bytes(message.data))
        except FrameError:
            self.malformed += 1


def python_can(
    interface: str,
    channel: str | int,
    bitrate: int | None = None,
    data_bitrate: int | None = None,
    settings: Mapping[str, Any] | None = None,
) -> PythonCanAdapter:
    """Opens an interface of python-can in CAN FD mode; its own configuration files are not read.

    Args:
        interface: its name there: "virtual", "pcan", "kvaser", "udp_multicast", ...
        channel: as that interface names its channels.
        bitrate: of arbitration [bit/s]; as the interface has it where None.
        data_bitrate: of data [bit/s], the same.
        settings: whatever else that interface takes.

    Raises:
        AdapterError: it cannot be opened, takes no such setting, or is not in CAN FD mode.
    """
    backend, arguments = prepare(interface, bitrate, data_bitrate, settings or {})
    bus = backend.__new__(backend)  # at hand to be shut down where its constructor fails
    try:
        backend.__init__(bus, channel, **arguments)
    except Exception as error:  # drivers raise what they like, NameError where their library is missing
        for shut_down in (backend.shutdown, can.BusABC.shutdown):  # half made: the first may not get far
            with contextlib.suppress(Exception):
                shut_down(bus)
        reason = f"python-can cannot open it: {error or type(error).__name__}"
        raise AdapterError(f"{interface}:{channel}", reason, _remedy(interface)) from error
    return PythonCanAdapter(bus)


def knows(interface: str) -> bool:
    """Whether python-can has an interface of that name besides SocketCAN, which needs no python-can."""
    return interface in BACKENDS and interface != "socketcan"


def example_channel(interface: str) -> str:
    """A channel as this interface names them, "" where only its documentation says."""
    return _EXAMPLE_CHANNELS.get(interface, "")


def prepare(
    interface: str, bitrate: int | None, data_bitrate: int | None, settings: Mapping[str, Any]
) -> tuple[type[can.BusABC], dict[str, Any]]:
    """The class behind an interface and the arguments that open it, but for the channel; opens nothing.

    Raises:
        AdapterError: there is no such interface or setting, or it carries no CAN FD.
    """
    backend = _backend(interface)
    known = _known_settings(backend)
    return backend, {
        **_can_fd(interface, known),
        **_rates(interface, known, bitrate, data_bitrate),
        **_checked(interface, known, settings),
    }


def missing_packages(interface: str) -> list[str]:
    """Packages that an interface needs besides python-can, as far as that knows, and that are not here."""
    extra = _OWN_EXTRAS.get(interface, interface.replace("_", "-"))
    needs = [need for need in metadata.requires("python-can") or [] if f'extra == "{extra}"' in need]
    return [name for name in (_PACKAGE.findall(need)[0] for need in needs) if not _installed(name)]


def install_command(interface: str) -> str:
    """What installs the packages that an interface needs."""
    extra = _OWN_EXTRAS.get(interface, interface.replace("_", "-"))
    return f"{sys.executable} -m pip install {shlex.quote(f'python-can[{extra}]')}"


def _installed(package: str) -> bool:
    try:
        metadata.version(package)
    except metadata.PackageNotFoundError:
        return False
    return True


def _backend(interface: str) -> type[can.BusABC]:
    if interface not in BACKENDS:
        near = nearest(interface, BACKENDS)
        guess = f'Did you mean "{near}"? ' if near else ""
        raise AdapterError(
            interface,
            "python-can has no such interface",
            f"{guess}It has: {', '.join(sorted(BACKENDS))}",
        )
    module, name = BACKENDS[interface]
    try:
        backend: type[can.BusABC] = getattr(import_module(module), name)
    except Exception as error:  # what a missing driver does to its module
        raise AdapterError(interface, f"python-can cannot load it: {error}", _remedy(interface)) from error
    return backend


def _known_settings(backend: type[can.BusABC]) -> set[str]:
    """What an interface of python-can takes: the parameters that it names or documents."""
    named = {
        parameter.name
        for parameter in inspect.signature(backend.__init__).parameters.values()
        if parameter.kind is not parameter.VAR_KEYWORD
    }
    text = f"{backend.__doc__}{backend.__init__.__doc__}"
    return (named | set(_DOCUMENTED.findall(text))) - {"self", "kwargs"}


def _remedy(interface: str) -> str:
    missing = missing_packages(interface)
    if missing:
        return f"It needs {', '.join(missing)}: type {install_command(interface)}"
    if interface == "udp_multicast":
        return f"Its channel is an address of a multicast group, e.g. {example_channel(interface)}"
    return (
        "Install the driver of its maker, where it has one; python-can's documentation of that interface "
        "lists its channel names and settings"
    )


def _rates(name: str, known: set[str], bitrate: int | None, data_bitrate: int | None) -> dict[str, Any]:
    """The bit rates as the interface takes them."""
    given = {"bitrate": bitrate, "data_bitrate": data_bitrate}
    rates = {key: rate for key, rate in given.items() if rate is not None}
    if rates.keys() <= known and ("data_bitrate" in known or "timing" not in known):
        return rates
    if "timing" not in known:
        lacking = " and ".join(sorted(rates.keys() - known))
        raise AdapterError(name, f"this interface takes no {lacking}", "Leave it out of [bus]")
    if not rates:
        return {}
    if bitrate is None or data_bitrate is None:
        raise AdapterError(name, "one bit rate is missing", "Give bitrate and data_bitrate, or neither")
    with contextlib.suppress(ValueError):
        timing = can.BitTimingFd.from_sample_point(
            _CLOCK, bitrate, _SAMPLE_POINTS[0], data_bitrate, _SAMPLE_POINTS[1]
        )
        if (timing.nom_bitrate, timing.data_bitrate) == (bitrate, data_bitrate):  # it may have rounded
            return {"timing": timing}
    remedy = "Usual are 1 Mbit/s with 2, 4, 5 or 8 Mbit/s"
    raise AdapterError(name, f"no bit timing gives {bitrate} and {data_bitrate} bit/s", remedy)


def _can_fd(name: str, known: set[str]) -> dict[str, Any]:
    if "fd" in known:
        return {"fd": True}
    if "protocol" in known:
        return {"protocol": can.CanProtocol.CAN_FD}
    raise AdapterError(name, "this interface of python-can carries no CAN FD", "Take one that does")


def _checked(name: str, known: set[str], settings: Mapping[str, Any]) -> Mapping[str, Any]:
    own = known - {*RESERVED, "can_filters"}
    for key in settings:
        if key not in own:
            near = nearest(key, own)
            guess = f'Did you mean "{near}"? ' if near else ""
            raise AdapterError(
                name, f"this interface has no setting {key!r}", f"{guess}It has: {', '.join(sorted(own))}"
            )
    return settings
