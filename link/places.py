"""Addresses of stations, and sockets on them. Numbers only: nobody is asked where a station is."""

from __future__ import annotations

import errno
import socket
from ipaddress import ip_address
from typing import Any, TypeAlias

from .errors import LinkError

IP_MTU_DISCOVER, IPV6_MTU_DISCOVER, PMTUDISC_DO = 10, 23, 2
"""Of <linux/in.h> and <linux/in6.h>; older Pythons do not name them."""

Place: TypeAlias = tuple[Any, ...]
"""As Python's sockets have it: address, port, and for IPv6 flow and interface."""


def place(address: str, port: int) -> tuple[socket.AddressFamily, Place]:
    """Where a station is.

    Args:
        address: e.g. "192.168.1.7", "fd00::7", or "fe80::7%eth0".
        port: of TCP.

    Raises:
        LinkError: it is not an address in numbers.
    """
    try:
        ip_address(address)
        numeric = socket.AI_NUMERICHOST | socket.AI_NUMERICSERV
        (found, *_) = socket.getaddrinfo(address, port, type=socket.SOCK_STREAM, flags=numeric)
    except (ValueError, OSError) as error:
        raise LinkError(
            f"'{address}' is no address of a station; write it in numbers, e.g. 192.168.1.7 or fd00::7"
        ) from error
    return found[0], found[4]


def with_port(where: Place, port: int) -> Place:
    """The same host, another port."""
    return (where[0], port, *where[2:])


def listening_socket(address: str, port: int) -> socket.socket:
    """A socket of TCP that waits there, without blocking.

    Raises:
        LinkError: the address is not this host's, or the port is taken, for TCP or for UDP.
    """
    family, where = place(address, port)
    sock = socket.socket(family, socket.SOCK_STREAM)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.bind(where)
        sock.listen(16)
        sock.setblocking(False)
        with socket.socket(family, socket.SOCK_DGRAM) as probe:  # said now, not when an operator comes
            probe.bind(sock.getsockname())
    except OSError as error:
        sock.close()
        why = {
            errno.EADDRINUSE: "the port is taken",
            errno.EADDRNOTAVAIL: "it is not an address of this host",
        }
        said = why.get(error.errno or 0, error.strerror)
        raise LinkError(f"cannot wait for others at {address}, port {port}: {said}") from error
    return sock


def datagram_socket(here: Place, there: Place | None = None) -> socket.socket:
    """A socket for packets between two places; the kernel drops what comes from others.

    Packets are not sent in fragments. Where ``there`` is None, whoever asked for the socket connects it.

    Raises:
        OSError: the port is taken.
    """
    six = len(here) > 2
    sock = socket.socket(socket.AF_INET6 if six else socket.AF_INET, socket.SOCK_DGRAM)
    try:
        sock.setblocking(False)
        if six:
            sock.setsockopt(socket.IPPROTO_IPV6, IPV6_MTU_DISCOVER, PMTUDISC_DO)
        else:
            sock.setsockopt(socket.IPPROTO_IP, IP_MTU_DISCOVER, PMTUDISC_DO)
        sock.bind(here)
        if there is not None:
            sock.connect(there)
    except OSError:
        sock.close()
        raise
    return sock
