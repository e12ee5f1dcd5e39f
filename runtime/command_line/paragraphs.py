"""Sentences for people, in rows that their terminal has room for."""

from __future__ import annotations

import sys
import textwrap
from typing import TextIO

from ..live.screen import terminal_size

DEEPER = " " * 6
"""Before the rows that a line of a table goes on in."""
NARROWEST = 20
"""A narrower terminal gets rows of so many columns."""


def tell(text: str, stream: TextIO | None = None, indent: str = "  ") -> None:
    """Print sentences, one a line: wrapped at words on a terminal, in one line for a file or a pipe.

    Paths and commands are not for it: what is copied from a terminal must come out in one piece.

    Args:
        text: the sentences.
        stream: None: standard output.
        indent: of the rows after the first.
    """
    stream = stream or sys.stdout
    for line in text.split("\n"):
        print("\n".join(rows(line, stream, indent)), file=stream, flush=True)


def rows(text: str, stream: TextIO, indent: str = "  ") -> list[str]:
    """The rows of a sentence on a stream, see ``tell``; one that is full breaks before its last column."""
    if not stream.isatty():
        return [text]
    columns = max(terminal_size(stream.fileno())[0] - 1, NARROWEST)
    wrapper = textwrap.TextWrapper(
        columns, subsequent_indent=indent, break_on_hyphens=False, break_long_words=False
    )
    return wrapper.wrap(text) or [text]
