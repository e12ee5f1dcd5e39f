"""What seals and opens packets: AES-256-GCM, whose nonce is the key's salt and the packet's counter."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from ._inbox import ffi, lib

LIBCRYPTO: Final = b"libcrypto.so.3"
"""Of OpenSSL; Python's own `ssl` mostly has it loaded."""
COUNTER: Final = slice(lib.LINK_HEADER - 8, lib.LINK_HEADER)

SIGNATURE: Final = "link_sealer *"
"""Of what seals and what opens."""


class Sealing(NamedTuple):
    """A key, and what uses it.

    Attributes:
        at: a ``link_sealing``; valid as long as this lives.
        keeps: what must live as long.
    """

    at: Any
    keeps: tuple[object, ...] = ()


def sealing(key: bytes, salt: bytes) -> Sealing:
    """A key, (32,) bytes and a salt of (4,); in C where the host has OpenSSL's libcrypto, else slower."""
    return in_c(key, salt) or in_python(key, salt)


def in_c(key: bytes, salt: bytes) -> Sealing | None:
    """By libcrypto, so that a packet passes without Python in between; None without it."""
    made = ffi.new("link_sealing *")
    if not (lib.link_load(LIBCRYPTO) and lib.link_key(made, key, salt)):
        return None
    return Sealing(ffi.gc(made, lib.link_forget))


def in_python(key: bytes, salt: bytes) -> Sealing:
    """By the package `cryptography`, which brings an OpenSSL of its own."""
    cipher = AESGCM(key)

    def seal(_: Any, header: Any, content: Any, size: int, sealed: Any) -> int:
        clear = _bytes(header, lib.LINK_HEADER)
        made = cipher.encrypt(salt + clear[COUNTER], _bytes(content, size), clear)
        ffi.memmove(sealed, made, len(made))
        return 1

    def open_sealed(_: Any, header: Any, sealed: Any, size: int, content: Any) -> int:
        clear = _bytes(header, lib.LINK_HEADER)
        try:
            made = cipher.decrypt(salt + clear[COUNTER], _bytes(sealed, size + lib.LINK_TAG), clear)
        except InvalidTag:
            return 0
        ffi.memmove(content, made, len(made))
        return 1

    seals, opens = ffi.callback(SIGNATURE, seal), ffi.callback(SIGNATURE, open_sealed)
    return Sealing(ffi.new("link_sealing *", {"seal": seals, "open": opens}), (seals, opens))


def _bytes(at: Any, size: int) -> bytes:
    return bytes(ffi.buffer(at, size))
