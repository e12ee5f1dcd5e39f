"""What the linter found, and how it names it."""

from __future__ import annotations

from collections.abc import Iterable

from ..configs.printable import beginning
from ..configs.words import nearest
from .errors import ModelError
from .xml_tree import SHOWN, Element

LISTED = 20
"""Names that a message lists."""


MOST_TOLD = 20
"""Findings of a description that are told: who has more begins with these."""


class Findings:
    """Everything that is wrong with a description.

    Attributes:
        source: of the description.
    """

    def __init__(self, source: str) -> None:
        self.source = source
        self._found: list[ModelError] = []

    def __len__(self) -> int:
        """How many things are wrong so far."""
        return len(self._found)

    def refuse(self, element: Element, problem: str, fix: str) -> None:
        """Something is wrong at the line of an element."""
        self._found.append(ModelError(self.source, element.line, problem, fix))

    def require_none(self) -> None:
        """Go on only with a description in which nothing is wrong.

        Raises:
            ModelError: with all findings, in the order of their lines.
        """
        if not self._found:
            return
        first, *others = sorted(self._found, key=lambda found: found.line)
        told, left = others[: MOST_TOLD - 1], len(others) - (MOST_TOLD - 1)
        if left > 0:
            told.append(ModelError(self.source, 0, f"{left} more findings", "mend these first"))
        raise ModelError(first.source, first.line, first.problem, first.fix, told)


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
