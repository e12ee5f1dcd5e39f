"""What a station knows of the link: the newest word of the other side, and how old it is."""

from __future__ import annotations

from typing import NamedTuple, Protocol


class Received(NamedTuple):
    """A packet of the other station.

    Attributes:
        payload: as it was sent.
        age: since it was sent, as far as known [s].
    """

    payload: bytes
    age: float


class Port(Protocol):
    """One end of a link."""

    def send(self, payload: bytes) -> None:
        """Send the newest state of this side; its length is fixed, and both sides agree on it."""

    def receive(self) -> Received | None:
        """The newest authentic packet that had not come at the last call, or None."""
