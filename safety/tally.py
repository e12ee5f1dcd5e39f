"""Bad ticks among the last ones: "in a row" alone forgives whatever is good every few ticks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .verdict import Reaction

WINDOW = 100
"""Ticks over which sporadic faults are counted."""


@dataclass(frozen=True, slots=True)
class Rule:
    """What so many bad ones among the last ticks lead to; in a row where both numbers are the same."""

    reaction: Reaction
    bad: int
    of: int


class Tally:
    """A shift register of good and bad ticks, and the rules for it.

    Attributes:
        count: bad ticks within the longest window of the rules.
        idle: whether it remembers no bad tick, so that a good one changes nothing and asks for nothing.
    """

    def __init__(self, *rules: Rule) -> None:
        self._rules = [(rule.reaction, rule.bad, (1 << rule.of) - 1) for rule in rules]
        self._mask = max(mask for _, _, mask in self._rules)
        self._ticks, self.idle = 0, True

    @property
    def count(self) -> int:
        """Bad ticks within the longest window."""
        return self._ticks.bit_count()

    def clear(self) -> None:
        """Forget all ticks."""
        self._ticks, self.idle = 0, True

    def push(self, bad: bool, skipped: int = 0) -> Reaction:
        """Take a tick, and skipped ones, all bad, before it; the strongest reaction that a rule asks for."""
        if self.idle and not (bad or skipped):
            return Reaction.PASS
        skipped = min(skipped, self._mask.bit_length())
        ticks = (self._ticks << skipped) | ((1 << skipped) - 1)
        self._ticks = ((ticks << 1) | bad) & self._mask
        self.idle = not self._ticks
        found = Reaction.PASS
        for reaction, most, mask in self._rules:
            if reaction > found and (self._ticks & mask).bit_count() >= most:
                found = reaction
        return found


class Tallies:
    """One tally each for several named things, idle while none of them is bad for a window."""

    def __init__(self, names: Sequence[str], *rules: Rule) -> None:
        self._names, self._tallies = names, [Tally(*rules) for _ in names]
        self._none = [False] * len(names)
        self._window = max(rule.of for rule in rules)
        self._quiet = self._window

    @property
    def idle(self) -> bool:
        """Whether none of them remembers a bad tick: one without bad things changes and says nothing."""
        return self._quiet >= self._window

    def push(self, bad: Sequence[object]) -> tuple[Reaction, list[int], str]:
        """Take a tick, one mark each, or none where nothing is bad.

        Returns:
            The strongest reaction, to which of them, and the first one's count.
        """
        self._quiet = 0 if any(bad) else self._quiet + 1
        if self._quiet > self._window:  # every tally has forgotten all that was bad
            return Reaction.PASS, [], ""
        marks = zip(self._tallies, bad or self._none, strict=True)
        found = [tally.push(bool(mark)) for tally, mark in marks]
        strong = max(found)
        worst = [i for i, reaction in enumerate(found) if reaction is strong]
        first = worst[0]
        return strong, worst, f"{self._names[first]}: {self._tallies[first].count} of {self._window}"
