"""How the linter names what it found."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NoReturn

from ..configs.printable import beginning
from ..configs.words import nearest
from .errors import ModelError
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
    found = nearest(word[:SHOWN], names)
    if found:
        return f"did you mean {shown(found)}?"
    return f"known here: {', '.join(map(shown, names[:LISTED])) or 'none'}"


def shown(text: str) -> str:
    """A text of a file, fit for a message: its beginning, printable."""
    return beginning(text, SHOWN)
