"""Numbers as people write them in files: plain decimal, finite, no more and no less."""

from __future__ import annotations

import re
from math import isinf

_NUMERAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
LONGEST = 64
"""Characters; a double has 17 significant digits."""
SMALLEST_NORMAL = 2.2250738585072014e-308


def number(word: str) -> float | None:
    """The finite number that a word stands for, or None.

    ``float`` takes more for a number than parsers of robot descriptions do, and than people mean: ``1_0``,
    digits of other scripts, ``infinity``, 1e999 (infinite), 1e-320 (denormal: most of its digits are lost).
    """
    if len(word) > LONGEST or not _NUMERAL.fullmatch(word):
        return None
    value = float(word)
    return None if isinf(value) or 0.0 < abs(value) < SMALLEST_NORMAL else value
