"""Buses that are sockets: Unix SEQPACKET and SocketCAN, through the same batch calls of the C core."""

from __future__ import annotations

import errno
import fcntl
import os
import socket
import struct
import termios
from array import array
from pathlib import Path
from typing import Final

from ._wire import ffi, lib
from .errors import AdapterError, NoSocketCanError
from .frames import Frames

CANFD_MTU: Final = 72
BITRATE: Final = 1_000_000
DATA_BITRATE: Final = 5_000_000
"""What proposed commands set where nothing else is asked for [bit/s]."""
_INTERFACES: Final = Path("/sys/class/net")
_FLAG_UP: Final = 0x1
_BUFFER_BYTES: Final = 1 << 20

# From linux/can.h and linux/can/raw.h, for systems whose Python was built without them
_AF_CAN: Final = 29
_CAN_RAW: Final = 1
_SOL_CAN_RAW: Final = 101
_CAN_RAW_FILTER: Final = 1
_CAN_RAW_ERR_FILTER: Final = 2
_CAN_RAW_FD_FRAMES: Final = 5
_CAN_EFF_FLAG: Final = 0x80000000
_CAN_RTR_FLAG: Final = 0x40000000
_CAN_ERR_MASK: Final = 0x1FFFFFFF
_SO_TIMESTAMPNS: Final = 35  # linux/socket.h


class SocketAdapter:
    """A connected socket: SocketCAN carries a frame in each packet, a Unix socket a whole batch."""

    def __init__(self, sock: socket.socket) -> None:
        sock.setblocking(False)
        self._socket = sock
        self._fd = sock.fileno()
        self._link = ffi.new("wire_link *", {"batched": sock.family == socket.AF_UNIX})

    @property
    def closed(self) -> bool:
        """Whether the peer is gone, or `close` was called; what it sent before was received."""
        return bool(self._link.closed)

    @property
    def unsent(self) -> int:
        """Frames that were dropped because the kernel's queue was full."""
        return int(self._link.unsent)

    @property
    def malformed(self) -> int:
        """Datagrams dropped because they were no frames."""
        return int(self._link.malformed)

    @property
    def error(self) -> str:
        """The last failure of the socket, "" where there was none."""
        return os.strerror(self._link.error) if self._link.error else ""

    def stamp_arrivals(self) -> None:
        """Ask the kernel for arrival times; without, `time_ns` stays 0."""
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)

    @property
    def time_ns(self) -> int:
        """When the last TIME object of the last `receive` arrived, CLOCK_MONOTONIC [ns]; 0 for none."""
        return int(self._link.time_ns)

    @property
    def unread(self) -> bool:
        """Whether the peer has not yet taken all that was sent to it; for Unix sockets."""
        waiting = array("i", [0])
        fcntl.ioctl(self._fd, termios.TIOCOUTQ, waiting)
        return waiting[0] > 0

    def receive(self, frames: Frames) -> int:
        """Replaces the contents of `frames` by what has arrived; returns how many."""
        return max(0, int(lib.wire_receive(self._fd, frames.pointer, self._link)))

    def send(self, frames: Frames) -> None:
        """Sends all of `frames`."""
        lib.wire_send(self._fd, frames.pointer, self._link)

    def fileno(self) -> int:
        """The socket; -1 once `close` was called."""
        return self._socket.fileno()

    def close(self) -> None:
        """Closes the socket."""
        self._link.closed = 1
        self._socket.close()


def unix_pair() -> tuple[SocketAdapter, SocketAdapter]:
    """Two connected ends, to be shared with a child process."""
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    return SocketAdapter(here), SocketAdapter(there)


def socketcan(interface: str, bitrate: int = BITRATE, data_bitrate: int = DATA_BITRATE) -> SocketAdapter:
    """Opens a CAN FD interface of the kernel: "can0", "vcan0".

    Data frames with 11-bit identifiers pass, and the controller's error frames.

    Args:
        interface: its name.
        bitrate: of arbitration, in the commands that errors propose [bit/s].
        data_bitrate: of data, in the same commands [bit/s].

    Raises:
        NoSocketCanError: the kernel has no SocketCAN.
        AdapterError: the interface is missing, down or not CAN FD.
    """
    try:
        sock = socket.socket(_AF_CAN, socket.SOCK_RAW, _CAN_RAW)
    except OSError as error:
        remedy = (
            "Type: sudo modprobe can-raw. Where the kernel has no such module, use the simulated plant "
            '([bus] kind = "simulated"), or an interface of python-can, e.g. kind = "python-can", '
            'interface = "udp_multicast", channel = "239.74.163.2"'
        )
        raise NoSocketCanError(
            interface, f"this kernel has no SocketCAN ({_reason(error)})", remedy
        ) from error
    try:
        _check_interface(interface, bitrate, data_bitrate)
        standard = struct.pack("=II", 0, _CAN_EFF_FLAG | _CAN_RTR_FLAG)
        sock.setsockopt(_SOL_CAN_RAW, _CAN_RAW_FD_FRAMES, 1)
        sock.setsockopt(_SOL_CAN_RAW, _CAN_RAW_FILTER, standard)
        sock.setsockopt(_SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, _CAN_ERR_MASK)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
        sock.bind((interface,))
    except OSError as error:
        sock.close()
        raise AdapterError(interface, _reason(error), "Try: ip -details link show " + interface) from error
    except AdapterError:
        sock.close()
        raise
    return SocketAdapter(sock)


def up_command(interface: str, bitrate: int = BITRATE, data_bitrate: int = DATA_BITRATE) -> str:
    """The command that brings a CAN FD interface of the kernel up with its bit rates [bit/s]."""
    return f"sudo ip link set {interface} up type can bitrate {bitrate} dbitrate {data_bitrate} fd on"


def _check_interface(interface: str, bitrate: int = BITRATE, data_bitrate: int = DATA_BITRATE) -> None:
    """Refuses what would open and then never carry a frame."""
    folder = _INTERFACES / interface
    up = up_command(interface, bitrate, data_bitrate)
    try:
        flags = int((folder / "flags").read_text(), 16)
        mtu = int((folder / "mtu").read_text())
    except FileNotFoundError as error:
        remedy = (
            "Plug the adapter in and look at `ip link`; for a virtual one type: "
            f"sudo ip link add dev {interface} type vcan && sudo ip link set {interface} mtu 72 up"
        )
        raise AdapterError(interface, "there is no such interface", remedy) from error
    if mtu != CANFD_MTU:
        remedy = f"Type: sudo ip link set {interface} down && {up}   (vcan: ... mtu 72)"
        raise AdapterError(interface, f"is not in CAN FD mode (mtu {mtu}, not {CANFD_MTU})", remedy)
    if not flags & _FLAG_UP:
        raise AdapterError(interface, "is down", f"Type: {up}   (vcan: sudo ip link set {interface} up)")


def _reason(error: OSError) -> str:
    return error.strerror or errno.errorcode.get(error.errno or 0, str(error))
