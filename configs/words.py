"""What a wrong word of a file or a command line may have been meant for."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def nearest(word: str, known: Iterable[str]) -> str:
    """The known word that is most like another, "" where none is."""
    return next(iter(difflib.get_close_matches(word, list(known), 1)), "")


def meant(word: str, known: Iterable[str]) -> str:
    """Advice for a file: the word that was meant, or else all that could stand there; "" where none can."""
    known = list(known)
    near = nearest(word, known)
    return f'did you mean "{near}"?' if near else f"known here: {', '.join(known)}" if known else ""


def counted(n: int, what: str) -> str:
    """A number of things: 1 joint, 2 joints."""
    return f"{n} {what}" if n == 1 else f"{n} {what}s"
