"""What a person sees while a session runs: messages scroll by, a few lines at the bottom stay."""

from __future__ import annotations

import os
import textwrap
import unicodedata
from collections.abc import Callable, Sequence

from ...configs.printable import printable
from .outlet import Outlet

CLEAR_BELOW = "\x1b[J"
CLEAR_RIGHT = "\x1b[K"
FALLBACK = (80, 24)
"""Columns and rows of a terminal that does not tell."""
FEW_ROWS = 5
"""On a terminal with fewer, only the first line stays."""
INDENT = " " * 13
PARTING_S = 0.5
"""How long the last messages may take to be read."""


class Screen:
    """A terminal, or a plain file or pipe that gets messages only, one a line.

    The lines that stay never fill a row to its last column, where terminals differ; the cursor waits at their
    beginning, so that they are found again after the window has changed its size.
    """

    def __init__(self, outlet: Outlet, live: bool, size: Callable[[], tuple[int, int]]) -> None:
        """Live screens have lines that stay; ``size`` gives columns and rows."""
        self._outlet, self._live, self._size = outlet, live, size
        self._lines: list[str] = []
        self._shown = False

    def message(self, text: str) -> None:
        """A message, of one or more lines."""
        clean = [printable(line) for line in text.splitlines()]
        if self._live:
            columns, _ = self._size()
            clean = [row for line in clean for row in _wrapped(line, columns - 1)]
        self._outlet.write(self._hidden() + "".join(f"{line}\n" for line in clean) + self._drawn())

    def stay(self, lines: Sequence[Sequence[str]]) -> None:
        """New lines at the bottom, each a list of words of which the first ones are the most important."""
        if not self._live:
            return
        columns, rows = self._size()
        keep = lines if rows >= FEW_ROWS else lines[:1]
        self._lines = [fit([printable(word) for word in words], columns - 1) for words in keep]
        if self._outlet.idle:  # a slow terminal gets the next ones
            self._outlet.write(self._drawn())

    def leave(self) -> None:
        """Take the lines at the bottom away."""
        text, self._lines = self._hidden(), []
        if text:
            self._outlet.write(text)

    def forget(self) -> None:
        """The screen is somebody else's now, with what stands on it."""
        self._lines, self._shown = [], False

    def flush(self) -> None:
        """Go on with what the terminal has not taken yet."""
        self._outlet.flush()

    def close(self) -> None:
        """Nothing more comes."""
        self.leave()
        self._outlet.close(PARTING_S)

    def _hidden(self) -> str:
        shown, self._shown = self._shown, False
        return f"\r{CLEAR_BELOW}" if shown else ""

    def _drawn(self) -> str:
        if not self._lines:
            return ""
        self._shown = True
        rows = "\n".join(f"\r{line}{CLEAR_RIGHT}" for line in self._lines)
        up = f"\x1b[{len(self._lines) - 1}A" if len(self._lines) > 1 else ""
        return f"{rows}{CLEAR_BELOW}\r{up}"


def steerable(fd: int) -> bool:
    """Whether this is a terminal that knows how to move its cursor."""
    return os.isatty(fd) and os.environ.get("TERM", "") not in ("", "dumb")


def terminal_size(fd: int) -> tuple[int, int]:
    """Columns and rows of the terminal behind ``fd``, as it is now."""
    try:
        size = os.get_terminal_size(fd)
    except OSError:
        return FALLBACK
    return size.columns or FALLBACK[0], size.lines or FALLBACK[1]


def fit(words: Sequence[str], columns: int) -> str:
    """As many words as there is room for, two blanks between them; of the first one, at least a part."""
    line = _cut(words[0], columns) if words else ""
    for word in words[1:]:
        longer = f"{line}  {word}"
        if width(longer) <= columns:
            line = longer
    return line


def width(text: str) -> int:
    """Columns that a terminal gives a text."""
    return sum(_columns(c) for c in text)


def _columns(character: str) -> int:
    if unicodedata.combining(character):
        return 0
    return 2 if unicodedata.east_asian_width(character) in "WF" else 1


def _cut(text: str, columns: int) -> str:
    while width(text) > max(0, columns):
        text = text[:-1]
    return text


def _wrapped(line: str, columns: int) -> list[str]:
    if width(line) <= columns:
        return [line]
    indent = INDENT if columns > 3 * len(INDENT) else "  "
    return textwrap.wrap(line, max(columns, 10), subsequent_indent=indent, break_on_hyphens=False) or [line]
