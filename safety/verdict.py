"""What a safety layer says, and how strongly the machine reacts."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from ..configs.members import at_hand


@at_hand
class Reaction(IntEnum):
    """Reactions in order of strength (IEC 61800-5-2 terms in brackets)."""

    PASS = 0
    """Nothing to say."""
    RECORD = 1
    """R0: note it in the log."""
    SANITISE = 2
    """R1: replace the value by a safe one, bounded."""
    HOLD = 3
    """R2: controlled stop of all axes, then hold under power (SS2)."""
    RAMP = 4
    """R3: ramp to standstill, then torque off and brakes (SS1)."""
    OFF = 5
    """R4: torque off now, STO request."""

    @property
    def stops(self) -> bool:
        """Whether the machine must come to rest."""
        return self >= Reaction.HOLD

    @property
    def code(self) -> str:
        """R0 to R4 as the safety manual calls it, '-' for none."""
        return "-" if self is Reaction.PASS else f"R{self - 1}"


@dataclass(frozen=True, slots=True)
class Verdict:
    """A reaction with a stable reason code and a sentence for people."""

    reaction: Reaction
    reason: str = ""
    detail: str = ""


PASS = Verdict(Reaction.PASS)

OUTPUT_BEYOND_LIMIT = "output_beyond_limit"
"""Reason of a stop by a gate that had to change what was commanded, for too long."""


def strongest(first: Verdict, second: Verdict) -> Verdict:
    """The stronger of two verdicts; the first on a tie."""
    return second if second.reaction > first.reaction else first
