"""Numbers in the lines of a file that somebody else's program wrote."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from ...runtime.configuration.beside import UnfitFileError


def numbers(words: Sequence[bytes], least: int, most: int, line: int) -> list[float]:
    """Finite ones; from ``least`` to ``most`` of them.

    Raises:
        UnfitFileError: with the line of the file.
    """
    if not least <= len(words) <= most:
        problem = f"has {len(words)} numbers in its line {line}, where {least} belong"
        raise UnfitFileError(problem, "export it anew")
    try:
        found = [float(word) for word in words]
    except ValueError:
        found = []
    if not found or not all(map(isfinite, found)):
        raise UnfitFileError(f"holds what is no finite number in its line {line}", "export it anew")
    return found
