"""Members of an enumeration, for code that looks them up in every tick."""

from __future__ import annotations

from enum import Enum
from typing import TypeVar

E = TypeVar("E", bound=Enum)


def at_hand(kind: type[E]) -> type[E]:
    """Make the members of an enumeration plain attributes of it, as they are from Python 3.12 on.

    Before, ``Kind.MEMBER`` goes through a descriptor, which takes longer than what it is looked up for.
    """
    for name, member in kind.__members__.items():
        type.__setattr__(kind, name, member)
    return kind
