"""Numbers of others side by side: what a tick copies, in one call."""

from __future__ import annotations

from collections.abc import Sequence

from ..binding import bind
from ..models import Array
from ._kernels import ffi, lib


class Copies:
    """Copies arrays of others to where they are read."""

    def __init__(self, pairs: Sequence[tuple[Array, Array]]) -> None:
        """Bind to arrays (k,), each with the one of its length that it is copied to, in this order."""
        self._parts = ffi.new("copies_part[]", [{"n": len(source)} for source, _ in pairs])
        for k, (source, target) in enumerate(pairs):
            bind(lib, self._parts, {}, k, **{"from": source, "to": target})
        self._call = self._parts, len(pairs)

    def update(self) -> None:
        """Those of this tick."""
        lib.copies_take(*self._call)
