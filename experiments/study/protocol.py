"""What a study does, whatever its protocol: trials with stimuli, a question, and keys that answer it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from .psychometric import Psychometric


@dataclass(frozen=True, slots=True)
class Trial:
    """One question to a participant.

    Attributes:
        stimuli: what is rendered, one session each: values by keys of the machine's configuration.
        question: to answer then; keys: that answer it.
    """

    stimuli: tuple[Mapping[str, float], ...]
    question: str
    keys: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Column:
    """A column of the data: what it is, its unit, and what its values mean."""

    description: str
    unit: str = ""
    levels: Mapping[str, str] | None = None


class Course(Protocol):
    """The trials of one participant. The same seed and the same answers give the same course.

    Attributes:
        count: of the trials, None where the answers decide.
        columns: of the data, in their order.
    """

    count: int | None

    @property
    def columns(self) -> Mapping[str, Column]:
        """What ``answer`` returns."""

    def next(self) -> Trial | None:
        """The trial that is to be answered now; None at the end."""

    def answer(self, key: str) -> dict[str, Any]:
        """Take the answer to it; one value a column."""

    def simulate(self) -> str:
        """The key with which the observer answers it; only with an observer."""

    def found(self) -> dict[str, Any]:
        """What the answers say so far."""


class Design(Protocol):
    """A study as its file describes it: a protocol."""

    @property
    def name(self) -> str:
        """Of the study, in its data."""

    @property
    def machine(self) -> str:
        """Configuration or built-in name."""

    @property
    def seconds(self) -> float:
        """Of the session of each stimulus."""

    @property
    def consent(self) -> str:
        """What the participant agrees to."""

    def problem(self) -> str:
        """What is wrong with it; "" where nothing is."""

    def course(self, seed: int, unit: str = "", observer: Psychometric | None = None) -> Course:
        """The trials of the participant of a seed; ``unit`` is that of the parameter."""

    @property
    def ends(self) -> tuple[Mapping[str, float], ...]:
        """Stimuli beyond which it shows none: the machine must take them all."""
