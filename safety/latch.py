"""Stops latch: the strongest reaction stands until its cause is gone and a person resets it."""

from __future__ import annotations

from dataclasses import dataclass

from .verdict import Reaction, Verdict

TRIP_WORDS = "{reaction} {reason} at tick {tick}: {detail}"
"""A latched stop in one line for people, of its values."""


@dataclass(frozen=True, slots=True)
class Trip:
    """A latched stop: what, and at which tick it first tripped."""

    verdict: Verdict
    tick: int

    @property
    def values(self) -> dict[str, str | int]:
        """Values for ``TRIP_WORDS``."""
        verdict = self.verdict
        return {
            "reaction": verdict.reaction.code,
            "reason": verdict.reason,
            "tick": self.tick,
            "detail": verdict.detail,
        }


class StopLatch:
    """Holds the first trip of the strongest reaction.

    Attributes:
        trip: the latched stop, None while there is none.
    """

    def __init__(self) -> None:
        self.trip: Trip | None = None

    @property
    def reaction(self) -> Reaction:
        """The reaction that stands."""
        return self.trip.verdict.reaction if self.trip else Reaction.PASS

    def take(self, verdict: Verdict, tick: int) -> Trip | None:
        """Latch a stop that is stronger than the one that stands; None where it is not."""
        if not verdict.reaction.stops or verdict.reaction <= self.reaction:
            return None
        self.trip = Trip(verdict, tick)
        return self.trip

    def reset(self, present: Verdict, dead_man: bool, at_rest: bool) -> str:
        """Try to clear the latch; returns why not, '' where it is clear.

        Args:
            present: what the monitor says now.
            dead_man: whether the dead-man switch is pressed; it must be released first.
            at_rest: whether the stop is complete.
        """
        why = "" if self.trip is None else refusal(present, dead_man, at_rest)
        if not why:
            self.trip = None
        return why


def refusal(present: Verdict, dead_man: bool, at_rest: bool) -> str:
    """Why a stop may not be reset now, "" where it may; see ``StopLatch.reset``."""
    if not at_rest:
        return "the machine is not at rest yet"
    if present.reaction.stops:
        return f"the cause is still there: {present.detail}"
    if dead_man:
        return "release the dead-man switch first"
    return ""


def describe(trip: Trip | None) -> str:
    """One line for people."""
    return TRIP_WORDS.format_map(trip.values) if trip else "no stop"
