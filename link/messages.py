"""What two stations say to each other under TLS before the first packet, and how it is framed."""

from __future__ import annotations

import selectors
import socket
import ssl
from collections.abc import Callable, Generator
from functools import partial
from time import monotonic
from typing import Annotated, Any, Final, Literal, TypeAlias, TypeVar

import msgspec

from .errors import LinkError
from .terms import Terms

PROTOCOL: Final = 1
SECRET: Final = 32
"""Random bytes that each station adds to the keys: whose generator repeats itself repeats no key."""
MOST: Final = 16384
"""Longest message [bytes]."""
PATIENCE: Final = 2.0
"""A handshake takes no longer, or is given up [s]."""

T = TypeVar("T")
Port: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=65535)]
Steps: TypeAlias = Generator[int, None, T]
"""Yields what it waits for, EVENT_READ or EVENT_WRITE of its socket, and returns in the end."""


class Offer(msgspec.Struct, frozen=True):
    """What a station brings: the avatar's first word.

    Attributes:
        protocol: version of all that follows.
        secret: random bytes.
        sends, receives, identity: as in `Terms`.
    """

    protocol: int
    secret: bytes
    sends: int
    receives: int
    identity: dict[str, str]


class Request(msgspec.Struct, frozen=True):
    """What the other station asks for: to move the avatar, to know who does, to end that.

    Attributes:
        port: of the asking station's datagram socket; 0: it has none.
    """

    want: Literal["move", "status", "end", "admit"]
    offer: Offer
    port: Port


class Granted(msgspec.Struct, frozen=True, tag=True):
    """A session begins; its number, and the port of the avatar's datagram socket."""

    session: Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
    port: Port


class Refused(msgspec.Struct, frozen=True, tag=True):
    """Nothing of what was asked for is done; a word for the cause, and why."""

    cause: str
    why: str


class Status(msgspec.Struct, frozen=True, tag=True):
    """What goes on at the avatar.

    Attributes:
        operator: whose session it is, "" if nobody's.
        silent: since that operator's last packet that may move something [s].
        refused: how many were refused since the avatar's end was opened, by cause.
        counts: the session's packets (`hapticd.link.channel.Counts`).
    """

    operator: str
    silent: float
    refused: dict[str, int]
    counts: dict[str, int]


Answer: TypeAlias = Granted | Refused | Status


def offer(terms: Terms, secret: bytes) -> Offer:
    """What a station with these terms brings."""
    return Offer(PROTOCOL, secret, terms.sends, terms.receives, dict(terms.identity))


def patient(action: Callable[[], T]) -> Steps[T]:
    """Try until TLS needs nothing more of the network."""
    while True:
        try:
            return action()
        except ssl.SSLWantReadError:
            yield selectors.EVENT_READ
        except ssl.SSLWantWriteError:
            yield selectors.EVENT_WRITE


def put(tls: ssl.SSLSocket, message: msgspec.Struct) -> Steps[None]:
    """Send a message: its length, u16, then JSON."""
    content = msgspec.json.encode(message)
    assert len(content) <= MOST
    left = memoryview(len(content).to_bytes(2, "big") + content)
    while left:
        left = left[(yield from patient(partial(tls.send, left))) :]


def take(tls: ssl.SSLSocket, kind: Any) -> Steps[Any]:
    """Receive a message.

    Raises:
        LinkError: it is too long, cut off, or not what was expected.
    """
    size = int.from_bytes((yield from _exactly(tls, 2)), "big")
    if size > MOST:
        raise LinkError(f"a message of {size} bytes; at most {MOST} are taken")
    content = yield from _exactly(tls, size)
    try:
        return msgspec.json.decode(content, type=kind)
    except (msgspec.DecodeError, RecursionError) as error:
        raise LinkError(f"a message that cannot be read: {error}") from error


def _exactly(tls: ssl.SSLSocket, size: int) -> Steps[bytes]:
    found = b""
    while len(found) < size:
        more = yield from patient(partial(tls.recv, size - len(found)))
        if not more:
            raise LinkError("the other station ended the connection")
        found += more
    return found


def finish(steps: Steps[T], sock: socket.socket, until: float) -> T:
    """Go through all steps, and wait for the network between them.

    Raises:
        LinkError: it takes longer than until that moment of ``monotonic()``.
    """
    with selectors.DefaultSelector() as selector:
        selector.register(sock, selectors.EVENT_READ)
        try:
            while True:
                selector.modify(sock, next(steps))
                if not selector.select(max(until - monotonic(), 0.0)):
                    raise LinkError("the other station took too long to answer")
        except StopIteration as done:
            result: T = done.value
            return result
