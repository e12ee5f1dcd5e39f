"""One line of the doctor's report."""

from __future__ import annotations

from enum import StrEnum

from msgspec import Struct


class State(StrEnum):
    """How a check came out."""

    PASS = "pass"
    WARN = "warn"
    """Ticks may come late; a machine can run."""
    FAIL = "fail"
    """No machine should run here."""


class Line(Struct, frozen=True):
    """What a check found.

    Attributes:
        check: its name.
        state: how it came out.
        found: the value, for people.
        why: why it matters, one sentence.
        fix: the command that mends it; "" where it passes.
    """

    check: str
    state: State
    found: str
    why: str
    fix: str = ""
