"""What a study does, whatever its protocol: trials, each of sessions of the machine and of questions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ...runtime.configuration.config import Loaded
from .psychometric import Psychometric

Machines = Callable[[str], Loaded]
"""The machine of a study with a twin; with "", as it is."""


@dataclass(frozen=True, slots=True)
class SimulatedHand:
    """Takes part in a study of what people do."""


Observer = Psychometric | SimulatedHand
"""A simulated participant."""


class Stimulus(Protocol):
    """A session of the machine."""

    @property
    def seconds(self) -> float:
        """How long it lasts."""

    def machine(self, machines: Machines) -> Loaded:
        """What renders it.

        Raises:
            StudyError: the study's machine cannot.
            ConfigError: it does not take a value.
        """


@dataclass(frozen=True, slots=True)
class Asked:
    """A stimulus that a study may show.

    Attributes:
        key: of the study's file that asks for it; seconds_key: that says how long it lasts.
        what: the value that the key asks for, and ": "; "" where the key says it.
        outermost: whether all others lie between such: the machine is built with it before the first trial.
    """

    stimulus: Stimulus
    key: str
    seconds_key: str
    what: str = ""
    outermost: bool = True


@dataclass(frozen=True, slots=True)
class Question:
    """Something that participants are asked.

    Attributes:
        name: of the column that keeps the answer; text: for the participant.
        answers: that are taken: single keys, or words and numbers that Enter ends.
        hint: what answers look like; "" where they are few enough to be told.
    """

    name: str
    text: str
    answers: tuple[str, ...]
    hint: str = ""

    @property
    def told(self) -> str:
        """What answers look like."""
        return self.hint or " or ".join(self.answers)


@dataclass(frozen=True, slots=True)
class Trial:
    """What happens until something is written down.

    Attributes:
        stimuli: the sessions.
        questions: what is asked after them.
        instruction: what the participant is to do, who begins it then; "" where there is nothing to do.
        may_stop: whether a session that safety stopped says something, too, and is not repeated.
    """

    stimuli: tuple[Stimulus, ...]
    questions: tuple[Question, ...]
    instruction: str = ""
    may_stop: bool = False


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
        """What trials give: answers, what was measured, and what both mean."""

    def next(self) -> Trial | None:
        """The trial that is now; None at the end."""

    def measure(self, logs: Sequence[Path], stopped: bool) -> dict[str, Any]:
        """What the recordings of its sessions say; ``stopped``: whether safety ended one.

        Raises:
            StudyError: nothing can be said of them.
            LogError: one is damaged.
        """

    def take(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Take its answers and what was measured; what they mean."""

    def simulate(self) -> dict[str, str]:
        """What the observer answers; only with an observer."""

    def found(self) -> dict[str, Any]:
        """What the trials say so far; None where nothing was measured."""


class Design(Protocol):
    """A study as its file describes it: a protocol."""

    @property
    def name(self) -> str:
        """Of the study, in its data."""

    @property
    def machine(self) -> str:
        """Configuration or built-in name."""

    @property
    def consent(self) -> str:
        """What the participant agrees to."""

    def problem(self) -> str:
        """What is wrong with it; "" where nothing is."""

    def refusal(self, observer: Observer | None, live: bool) -> str:
        """Why such a participant cannot take part, None being a person, live or not; "" who can."""

    def unit(self, machines: Machines) -> str:
        """In which ``found`` is.

        Raises:
            StudyError: the machine does not fit the study.
        """

    def course(self, seed: int, unit: str = "", observer: Observer | None = None) -> Course:
        """The trials of the participant of a seed."""

    @property
    def asked(self) -> tuple[Asked, ...]:
        """Stimuli that it may show, and those that all others lie between: the machine must take them all."""

    @property
    def parameter_key(self) -> str:
        """Key of the file by which the machine may not fit the study."""
