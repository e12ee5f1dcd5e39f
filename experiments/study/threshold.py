"""The protocol that measures a threshold of one rendered parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Annotated, Any, Literal

from msgspec import Meta

from ...configs.strict import Strict
from ...runtime.configuration.config import Loaded
from .entries import Count, Label, Seconds, Text
from .methods import Constant, Method, QuestPlus, Staircase
from .protocol import Asked, Column, Machines, Observer, Question, Trial
from .psychometric import Posterior, Psychometric
from .settings import unit_of, with_values

Level = Annotated[float, Meta(ge=-1e9, le=1e9)]
Share = Annotated[float, Meta(gt=0.0, lt=1.0)]
KEY = "key"
"""The column of what was pressed."""
FORCED = 0.5
"""Guess rate where one of two intervals must be chosen."""


@dataclass(frozen=True, slots=True)
class Shown:
    """A stimulus: the machine with another value of a parameter, in the unit of its configuration."""

    parameter: str
    value: float
    seconds: float

    def machine(self, machines: Machines) -> Loaded:
        """See ``Stimulus``."""
        return with_values(machines(""), {self.parameter: self.value})


class ConstantStimuli(Strict, frozen=True, tag_field="kind", tag="constant"):
    """Given levels, each so many times."""

    levels: Annotated[tuple[Level, ...], Meta(min_length=2, max_length=100)]
    repeats: Count


class UpDown(Strict, frozen=True, tag_field="kind", tag="staircase"):
    """A weighted up-down staircase."""

    start: Level
    step: Annotated[float, Meta(gt=0.0, le=1e9)]
    lower: Level
    upper: Level
    target: Share = 0.75
    reversals: Count = 12
    trials: Count = 200


class Quest(Strict, frozen=True, tag_field="kind", tag="quest"):
    """QUEST+ over levels between two, so many of them."""

    lower: Level
    upper: Level
    trials: Count
    levels: Annotated[int, Meta(ge=2, le=1000)] = 41

    @property
    def grid(self) -> list[float]:
        """The levels."""
        step = (self.upper - self.lower) / (self.levels - 1)
        return [self.lower + k * step for k in range(self.levels)]


class ThresholdDesign(Strict, frozen=True, kw_only=True, tag_field="protocol", tag="threshold"):
    """A threshold of one parameter: see docs/study.md."""

    name: Label
    machine: Text
    parameter: Text
    task: Literal["detect", "greater", "forced"]
    question: Text
    consent: Text
    seconds: Seconds
    method: ConstantStimuli | UpDown | Quest
    reference: Level | None = None
    guess: Annotated[float, Meta(ge=0.0, le=0.5)] = 0.0

    @property
    def asked(self) -> tuple[Asked, ...]:
        """See ``Design``."""
        base = self.reference if self.task == "forced" and self.reference is not None else 0.0
        reference = [("reference", self.reference)] if self.reference is not None else []
        ends = {*self.range, self.reference}
        levels = [self._asked(*each, 0.0, True) for each in reference]
        return (*levels, *(self._asked(key, level, base, level in ends) for key, level in self._levels))

    def _asked(self, key: str, level: float, base: float, outermost: bool) -> Asked:
        added = f"{base:g} + " if base else ""
        shown = Shown(self.parameter, base + level, self.seconds)
        return Asked(shown, key, "seconds", f"{added}{level:g}: ", outermost)

    @property
    def _levels(self) -> list[tuple[str, float]]:
        """All that can be reached, and the keys that ask for them; a staircase's any within its bounds."""
        method = self.method
        if isinstance(method, ConstantStimuli):
            return [("method.levels", level) for level in dict.fromkeys(method.levels)]
        ends = [("method.lower", method.lower), ("method.upper", method.upper)]
        if isinstance(method, UpDown):
            return [*ends, ("method.start", method.start)]
        return [*ends, *(("method", level) for level in method.grid[1:-1])]

    @property
    def parameter_key(self) -> str:
        """See ``Design``."""
        return "parameter"

    @property
    def range(self) -> tuple[float, float]:
        """Of the levels."""
        method = self.method
        if isinstance(method, ConstantStimuli):
            return min(method.levels), max(method.levels)
        return method.lower, method.upper

    def problem(self) -> str:
        """See ``Design``."""
        low, high = self.range
        if not low < high:
            return f"method: its levels, {low:g} to {high:g}, leave no range; give a lower and a higher one"
        if isinstance(self.method, UpDown) and not low <= self.method.start <= high:
            return f"method.start: {self.method.start:g} is outside {low:g} to {high:g}; begin inside"
        if self.task != "detect" and self.reference is None:
            return f'reference: is missing; task = "{self.task}" compares with one'
        if self.task == "detect" and self.reference is not None:
            return (
                'reference: is for task = "greater" and "forced"; "detect" shows one stimulus; leave it out'
            )
        if self.task != "detect" and self.guess:
            return f'guess: is for task = "detect"; "{self.task}" has its own; leave it out'
        return ""

    def refusal(self, observer: Observer | None, live: bool) -> str:
        """See ``Design``."""
        if observer is None or isinstance(observer, Psychometric):
            return ""
        return "a hand has no threshold; --observer threshold=T,scale=S answers as one that has"

    def unit(self, machines: Machines) -> str:
        """See ``Design``."""
        return unit_of(machines(""), self.parameter)

    def course(self, seed: int, unit: str = "", observer: Observer | None = None) -> ThresholdCourse:
        """See ``Design``."""
        assert observer is None or isinstance(observer, Psychometric)
        return ThresholdCourse(self, seed, unit, observer)


class ThresholdCourse:
    """Trials of a threshold; "yes" is felt, greater, or right, by the task."""

    def __init__(self, design: ThresholdDesign, seed: int, unit: str, observer: Psychometric | None) -> None:
        self._design, self._random, self._unit = design, Random(seed), unit
        self._guess = FORCED if design.task == "forced" else design.guess
        self._posterior = Posterior(*design.range, self._guess)
        self._method = self._chosen()
        self._observer = observer
        self._level: float | None = None
        self._second, self._luck = False, 0.0
        self._asked = self._answered = 0
        self.count = self._method.count

    def _chosen(self) -> Method:
        method = self._design.method
        if isinstance(method, ConstantStimuli):
            return Constant(method.levels, method.repeats, self._random)
        if isinstance(method, UpDown):
            bounds = method.lower, method.upper
            return Staircase(
                method.start, method.step, method.target, bounds, method.reversals, method.trials
            )
        return QuestPlus(method.grid, method.trials, self._posterior)

    @property
    def columns(self) -> Mapping[str, Column]:
        """See ``Course``."""
        compared = self._design.task != "detect"
        what = "added to the reference" if self._design.task == "forced" else "of the parameter"
        order = {"1": "the level came first", "2": "the level came second"}
        yes, no = {
            "detect": ("felt", "not felt"),
            "greater": ("the level was called greater", "the reference was called greater"),
            "forced": ("right", "wrong"),
        }[self._design.task]
        return {
            "level": Column(f"level {what} {self._design.parameter}", self._unit),
            **({"interval": Column("interval that held the level", levels=order)} if compared else {}),
            "response": Column("what the answer means", levels={"1": yes, "0": no}),
            KEY: Column("key that was pressed"),
        }

    def next(self) -> Trial | None:
        """See ``Course``."""
        design = self._design
        if self._asked == self._answered:
            self._level = self._method.level()
            self._second, self._luck = self._random.random() < 0.5, self._random.random()
            self._asked += 1
        if self._level is None:
            return None
        if design.task == "detect":
            values, keys = [self._level], ("y", "n")
        else:
            assert design.reference is not None
            shown = design.reference + self._level if design.task == "forced" else self._level
            values = [design.reference, shown] if self._second else [shown, design.reference]
            keys = ("1", "2")
        stimuli = tuple(Shown(design.parameter, value, design.seconds) for value in values)
        return Trial(stimuli, (Question(KEY, design.question, keys),))

    def measure(self, logs: Sequence[Path], stopped: bool) -> dict[str, Any]:
        """See ``Course``: the answers say everything."""
        return {}

    def take(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """See ``Course``."""
        level = self._level
        assert level is not None and self._asked > self._answered
        yes = given[KEY] == self._yes
        self._posterior.observe(level, yes)
        self._method.answer(yes)
        self._answered += 1
        interval = {} if self._design.task == "detect" else {"interval": 1 + int(self._second)}
        return {"level": level, **interval, "response": int(yes)}

    @property
    def _yes(self) -> str:
        """The key that says it of the level."""
        if self._design.task == "detect":
            return "y"
        return "2" if self._second else "1"

    def simulate(self) -> dict[str, str]:
        """See ``Course``."""
        assert self._observer is not None and self._level is not None
        yes, no = self._yes, {"y": "n", "1": "2", "2": "1"}[self._yes]
        return {KEY: yes if self._luck < self._observer.probability(self._level) else no}

    def found(self) -> dict[str, Any]:
        """See ``Course``."""
        threshold, deviation = self._posterior.threshold()
        found = {"threshold": threshold, "standard_deviation": deviation, "scale": self._posterior.scale()}
        found |= {"trials": self._answered}
        if isinstance(self._method, Staircase) and len(self._method.turns) > 2:
            late = self._method.turns[len(self._method.turns) % 2 :][2:] or self._method.turns
            found["mean_of_reversals"] = sum(late) / len(late)
        return found
