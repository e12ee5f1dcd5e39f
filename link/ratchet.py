"""Keys of one direction of a session: a new one each epoch, the old ones forgotten."""

from __future__ import annotations

from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF, HKDFExpand

from .sealing import Sealing, sealing

KEY, SALT, CHAIN = 32, 4, 32
"""Lengths of a key of AES-256-GCM, of the constant part of its nonce, of what the next key is made of."""


def roots(secrets: bytes, session: bytes, names: bytes) -> tuple[bytes, bytes]:
    """What the keys of each direction begin with, (32,) bytes each: the operator's, the avatar's.

    Args:
        secrets: random bytes of both stations, exchanged under TLS.
        session: the session's number.
        names: the stations', so that the keys belong to them alone.
    """
    made = HKDF(SHA256(), 2 * CHAIN, salt=session, info=b"hapticd link 1 roots " + names).derive(secrets)
    return made[:CHAIN], made[CHAIN:]


class Ratchet:
    """The keys of the epoch, of the one before, and of the next one.

    A key gives the next one; none gives the one before, so whoever takes a station over later cannot open
    what was recorded earlier.
    """

    def __init__(self, root: bytes, epoch: int = 0) -> None:
        self._epoch = epoch
        self._before: Sealing | None = None
        self.now, chain = _step(root)
        """Of the epoch."""
        self._next, self._chain = _step(chain)

    def at(self, epoch: int) -> Sealing | None:
        """The keys of an epoch, None where they are forgotten or too far away."""
        ahead = epoch - self._epoch
        if ahead == 0:
            return self.now
        return self._next if ahead == 1 else self._before if ahead == -1 else None

    def reached(self, epoch: int) -> None:
        """Go on to the next epoch where this is it: an authentic packet of it has come, or is to be sent."""
        if epoch == self._epoch + 1:
            self._epoch = epoch
            self._before, self.now = self.now, self._next
            self._next, self._chain = _step(self._chain)


def _step(chain: bytes) -> tuple[Sealing, bytes]:
    made = HKDFExpand(SHA256(), KEY + SALT + CHAIN, b"hapticd link 1 epoch").derive(chain)
    return sealing(made[:KEY], made[KEY : KEY + SALT]), made[KEY + SALT :]
