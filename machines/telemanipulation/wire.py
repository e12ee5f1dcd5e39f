"""The link of a simulated station that runs in real time: its gateways' end of it."""

from __future__ import annotations

import sys
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from ...control.lease import FRESH_S
from ...link.port import Received
from ...runtime.errors import HapticdError
from .sections import Chain, Link

if TYPE_CHECKING:
    from ...link.end import End

LOOK = 100
"""Packets between two looks at what happened on the link."""


class WireError(HapticdError):
    """The link of a simulated station cannot be opened.

    Attributes:
        code: stable name; see docs/errors.md.
    """

    code = "wire"
    exit_status = 2


class Wire:
    """A ``hapticd.link.port.Port`` that says what happens on the link."""

    def __init__(self, end: End) -> None:
        self._end, self._left = end, LOOK

    def send(self, payload: bytes) -> None:
        """See ``Port``."""
        self._end.send(payload)
        self._left -= 1
        if self._left == 0:
            self._left = LOOK
            for event in self._end.events():
                print(f"link: {event.text}", file=sys.stderr, flush=True)

    def receive(self) -> Received | None:
        """See ``Port``."""
        return self._end.receive()


def open_wire(leads: bool, link: Link, sizes: tuple[int, int], identity: dict[str, str]) -> Wire:
    """Open this station's end.

    Args:
        leads: whether it is the operator's, which calls.
        link: where, and with which keys.
        sizes: bytes of a packet that goes out, and of one that comes in.
        identity: what must be the same at both ends, by name.

    Raises:
        WireError: there are no keys, they cannot be used, or the address cannot.
    """
    if link.address is None or link.keys is None:
        raise WireError("a link with an address needs keys: a folder that `hapticd link keygen` wrote")
    try:
        from ...link.caller import Caller
        from ...link.credentials import load
        from ...link.errors import LinkError
        from ...link.host import Host
        from ...link.terms import Terms
    except ImportError as error:
        raise WireError('the link needs the package cryptography: pip install "hapticd[link]"') from error
    sends, receives = sizes
    sums = {name: sha256(text.encode()).hexdigest() for name, text in identity.items()}
    terms = Terms(sends=sends, receives=receives, oldest=link.delay + FRESH_S, identity=sums)
    try:
        keys = load(Path(link.keys))
        if leads:
            return Wire(Caller(keys, terms, link.address, link.port, link.avatar))
        return Wire(Host(keys, terms, link.address, link.port))
    except LinkError as error:
        raise WireError(str(error)) from error


def arms_alike(left: Chain, right: Chain) -> str:
    """What both stations must believe of the avatar's arms."""
    names = Chain.__struct_fields__
    return repr([[getattr(chain, name) for name in names] for chain in (left, right)])
