"""How far the reading of a recording is."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

EVERY = 1000
"""Ticks between two signs of progress."""


@contextmanager
def counting(quiet: bool) -> Iterator[Callable[[int], None]]:
    """What is told the number of ticks read, and shows it on a terminal; the line is clear afterwards."""
    show = sys.stderr.isatty() and not quiet

    def tell(ticks: int) -> None:
        if show and ticks % EVERY == 0:
            sys.stderr.write(f"\r{ticks} ticks")
            sys.stderr.flush()

    try:
        yield tell
    finally:
        if show:
            sys.stderr.write("\r\x1b[K")
