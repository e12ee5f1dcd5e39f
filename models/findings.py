"""How the linter names what it found."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import NoReturn

from .errors import ModelError
from .printable import beginning
from .xml_tree import SHOWN, Element

LISTED = 20
"""Names that a message lists."""


def refuse(element: Element, source: str, problem: str, fix: str) -> NoReturn:
    """Raise a ModelError at the line of an element."""
    raise ModelError(source, element.line, problem, fix)


def called(element: Element) -> str:
    """What to call an element by."""
    name = element.attributes.get("name")
    return f"{element.tag} '{shown(name)}'" if name else f"<{element.tag}>"


def near(word: str, known: Iterable[str]) -> str:
    """What a word that is not known may have been meant for."""
    names = list(known)
    found = difflib.get_close_matches(word[:SHOWN], names, 1)
    if found:
        return f"did you mean {shown(found[0])}?"
    return f"known here: {', '.join(map(shown, names[:LISTED])) or 'none'}"


def shown(text: str) -> str:
    """A text of a file, fit for a message: its beginning, printable."""
    return beginning(text, SHOWN)
