"""What both stations must agree on before a packet is sent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Final

from ..configs.printable import beginning, printable

OVERHEAD: Final = 56
"""Bytes of a datagram beside its payload: header 20, stamps 20, tag 16."""
LARGEST: Final = 1232 - OVERHEAD
"""Longest payload: such a datagram passes through any network that IPv6 passes through, in one piece."""
MOST_IDENTITIES: Final = 64
LONGEST: Final = 64
"""Longest name, and longest checksum, of something that is compared."""
TOLD: Final = 5
"""Differences that are named; of more, only how many."""


@dataclass(frozen=True, kw_only=True)
class Terms:
    """What this station sends, expects and tolerates.

    Attributes:
        sends, receives: lengths of the payloads [bytes]; the other station's must mirror them.
        oldest: packets of a greater age move nothing [s]: the declared delay of the link.
        identity: a name and a checksum for all that must be the same on both stations: configurations,
            models, calibrations (`checksums`).
        lease: the session ends after so long without a packet that may move something [s].
        deaf: a station that has not heard of us for so long moves nothing here either [s].
    """

    sends: int
    receives: int
    oldest: float
    identity: Mapping[str, str] = field(default_factory=dict)
    lease: float = 2.0
    deaf: float = 0.1

    def __post_init__(self) -> None:
        for name, size in (("sends", self.sends), ("receives", self.receives)):
            if not 1 <= size <= LARGEST:
                raise ValueError(f"{name}: {size} bytes; a payload has 1 to {LARGEST}")
        for name, seconds in (("oldest", self.oldest), ("lease", self.lease), ("deaf", self.deaf)):
            if not 1e-3 <= seconds <= 60.0:
                raise ValueError(f"{name}: {seconds:g} s; it is from 1 ms to 60 s")
        words = [*self.identity, *self.identity.values()]
        if len(self.identity) > MOST_IDENTITIES or not all(map(_word, words)):
            raise ValueError(
                f"identity: at most {MOST_IDENTITIES} names and checksums of {LONGEST} ASCII characters each"
            )


def checksums(files: Mapping[str, Path]) -> dict[str, str]:
    """SHA-256 of each file, for `Terms.identity`.

    Raises:
        OSError: a file cannot be read.
    """
    return {name: sha256(path.read_bytes()).hexdigest() for name, path in files.items()}


def difference(here: Mapping[str, str], there: Mapping[str, str]) -> str:
    """What the two stations do not have alike, in words; "" where they agree."""
    found = []
    for name in sorted(here.keys() | there.keys()):
        mine, theirs = here.get(name), there.get(name)
        if mine != theirs:
            found.append(f"{beginning(name, LONGEST)} ({_short(mine)} here, {_short(theirs)} there)")
    more = [f"{len(found) - TOLD} more"] if len(found) > TOLD else []
    return ", ".join(found[:TOLD] + more)


def _word(text: str) -> bool:
    return len(text) <= LONGEST and text.isascii() and text.isprintable()


def _short(checksum: str | None) -> str:
    return printable(checksum[:12]) if checksum else "missing"
