"""Packets sealed by libcrypto in C, and by the package `cryptography`, which judges the former."""

from __future__ import annotations

import random

import pytest
from cryptography.hazmat.primitives.ciphers.aead import AESGCM
from hapticd.link._inbox import ffi, lib
from hapticd.link.sealing import LIBCRYPTO, Sealing, in_c, in_python, sealing

KEY, SALT = bytes(range(32)), b"salt"


def sealed(keys: Sealing, header: bytes, content: bytes) -> bytes:
    """What is sent after the header."""
    out = ffi.new("uint8_t[]", len(content) + lib.LINK_TAG)
    assert keys.at.seal(keys.at.key, header, content, len(content), out) == 1
    return bytes(ffi.buffer(out))


def opened(keys: Sealing, header: bytes, packet: bytes) -> bytes | None:
    """What was sealed, None where it is not authentic."""
    size = len(packet) - lib.LINK_TAG
    content = ffi.new("uint8_t[]", b"?" * size)
    done = keys.at.open(keys.at.key, header, packet, size, content)
    found = bytes(ffi.buffer(content))[:size]
    assert done or not any(found) or found == b"?" * size  # nothing that is not authentic is left to be read
    return found if done else None


@pytest.fixture(params=[in_c, in_python])
def keys(request: pytest.FixtureRequest) -> Sealing:
    made: Sealing | None = request.param(KEY, SALT)
    if made is None:
        pytest.skip(f"this host has no {LIBCRYPTO.decode()}")
    return made


@pytest.mark.parametrize("seed", range(3))
def test_what_is_sealed_is_aes_gcm_with_salt_and_counter_for_a_nonce(keys: Sealing, seed: int) -> None:
    chance, judge = random.Random(seed), AESGCM(KEY)
    for size in (20, 21, 35, 36, 260, 1196, *(chance.randrange(20, 1197) for _ in range(20))):
        header, content = chance.randbytes(lib.LINK_HEADER), chance.randbytes(size)
        packet = judge.encrypt(SALT + header[12:], content, header)
        assert sealed(keys, header, content) == packet
        assert opened(keys, header, packet) == content


def test_a_bit_of_header_content_or_tag_that_is_turned_over_shows(keys: Sealing) -> None:
    header, content = bytes(lib.LINK_HEADER), bytes(40)
    packet = sealed(keys, header, content)
    for bit in range(8 * len(header + packet)):
        whole = bytearray(header + packet)
        whole[bit // 8] ^= 1 << bit % 8
        assert opened(keys, bytes(whole[: len(header)]), bytes(whole[len(header) :])) is None
    assert opened(keys, header, packet) == content  # and what was wrong leaves no trace


def test_another_key_or_salt_opens_nothing(keys: Sealing) -> None:
    packet = sealed(keys, bytes(20), bytes(40))
    for other in (sealing(KEY[::-1], SALT), sealing(KEY, SALT[::-1])):
        assert opened(other, bytes(20), packet) is None


def test_without_libcrypto_the_package_seals(monkeypatch: pytest.MonkeyPatch) -> None:
    class Without:
        LINK_HEADER, LINK_TAG = lib.LINK_HEADER, lib.LINK_TAG

        def link_load(self, library: bytes) -> int:
            return 0

    monkeypatch.setattr("hapticd.link.sealing.lib", Without())
    assert in_c(KEY, SALT) is None
    alone = sealing(KEY, SALT)
    assert opened(alone, bytes(20), sealed(alone, bytes(20), b"word")) == b"word"


def test_a_library_that_is_not_there_is_not_loaded_and_keys_can_be_given_back_twice() -> None:
    key = ffi.new("link_sealing *")
    if lib.link_load(LIBCRYPTO):
        assert lib.link_key(key, KEY, SALT) and key.key != ffi.NULL
    lib.link_forget(key)
    lib.link_forget(key)
    assert key.key == ffi.NULL
