"""The protocol in which participants do tasks with the giant, and rate the workload of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from statistics import fmean, median
from typing import Annotated, Any

from msgspec import Meta

from ...configs.strict import Strict
from ...machines.giant.config import GiantConfig
from ...runtime.configuration.config import Loaded
from . import giant_tasks, workload
from .entries import Label, Text
from .giant_tasks import Task, judged, motion_of
from .protocol import Asked, Column, Machines, Observer, SimulatedHand, Trial
from .psychometric import Psychometric
from .settings import StudyError

OVERALL = "workload"


@dataclass(frozen=True, slots=True)
class Doing:
    """A session in which a task is done; by a simulated hand, if ``seed`` draws one, in its k-th trial."""

    task: Task
    seed: int | None
    k: int

    @property
    def seconds(self) -> float:
        """See ``Stimulus``."""
        return self.task.seconds

    def machine(self, machines: Machines) -> Loaded:
        """See ``Stimulus``."""
        loaded = machines(self.task.twin)
        if not isinstance(loaded.config, GiantConfig):
            raise StudyError(f"{loaded.source} is no giant; the tasks are its own")
        if self.seed is None:
            return loaded
        if loaded.config.simulation is None:
            raise StudyError(f"{loaded.source} simulates nothing; --live lets a person do the tasks with it")
        who = f"{self.seed} {self.task.kind}"
        config = giant_tasks.simulated(loaded.config, self.task, Random(who), Random(f"{who} {self.k}"))
        return replace(loaded, config=config)


class TasksDesign(Strict, frozen=True, kw_only=True, tag_field="protocol", tag="tasks"):
    """Tasks that are done several times each, and rated: see docs/study.md."""

    name: Label
    machine: Text
    consent: Text
    trials: Annotated[int, Meta(ge=1, le=100)]
    tasks: Annotated[tuple[Task, ...], Meta(min_length=1, max_length=10)]

    def problem(self) -> str:
        """See ``Design``."""
        kinds = [task.kind for task in self.tasks]
        twice = sorted({kind for kind in kinds if kinds.count(kind) > 1})
        return f"tasks: {twice[0]} is there more than once; leave one" if twice else ""

    def refusal(self, observer: Observer | None, live: bool) -> str:
        """See ``Design``."""
        if isinstance(observer, Psychometric):
            return "tasks are done, not answered; --observer hand lets a simulated hand do them"
        if observer and live:
            return "a simulated hand moves simulated machines; leave --live out"
        if not (observer or live):
            return "a person does the tasks in real time: add --live; --observer hand is a simulated hand"
        return ""

    def unit(self, machines: Machines) -> str:
        """See ``Design``: what is found has several."""
        return ""

    @property
    def asked(self) -> tuple[Asked, ...]:
        """See ``Design``."""
        keys = [f"tasks[{k}]" for k in range(len(self.tasks))]
        doings = [Doing(task, None, 0) for task in self.tasks]
        return tuple(Asked(doing, key, f"{key}.seconds") for doing, key in zip(doings, keys, strict=True))

    @property
    def parameter_key(self) -> str:
        """See ``Design``."""
        return "machine"

    def course(self, seed: int, unit: str = "", observer: Observer | None = None) -> TasksCourse:
        """See ``Design``."""
        return TasksCourse(self, seed, isinstance(observer, SimulatedHand))


class TasksCourse:
    """Each task so many times; the participant's seed draws their order. The last trial of each is rated."""

    def __init__(self, design: TasksDesign, seed: int, simulated: bool) -> None:
        order = list(design.tasks)
        Random(seed).shuffle(order)
        self._trials = [(task, k) for task in order for k in range(1, design.trials + 1)]
        self._design, self._seed = design, seed if simulated else None
        self._rows: list[dict[str, Any]] = []
        self.count = len(self._trials)

    @property
    def columns(self) -> Mapping[str, Column]:
        """See ``Course``."""
        own = {name: column for task in self._design.tasks for name, column in task.columns.items()}
        return {
            "task": Column("what was to be done", levels={t.kind: t.instruction for t in self._design.tasks}),
            "repetition": Column("of the task, from 1"),
            **giant_tasks.COLUMNS,
            "stopped": Column("whether safety ended the session", levels={"1": "yes", "0": "no"}),
            **own,
            **workload.COLUMNS,
        }

    @property
    def _now(self) -> tuple[Task, int]:
        return self._trials[len(self._rows)]

    def next(self) -> Trial | None:
        """See ``Course``."""
        if len(self._rows) == self.count:
            return None
        task, k = self._now
        rated = k == self._design.trials and self._seed is None
        questions = workload.QUESTIONS if rated else ()
        return Trial((Doing(task, self._seed, k),), questions, task.instruction, may_stop=True)

    def measure(self, logs: Sequence[Path], stopped: bool) -> dict[str, Any]:
        """See ``Course``."""
        (log,) = logs
        return {**judged(self._now[0], motion_of(log)), "stopped": int(stopped)}

    def take(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """See ``Course``."""
        task, k = self._now
        row = {"task": task.kind, "repetition": k}
        self._rows.append({**given, **row})
        return row

    def simulate(self) -> dict[str, str]:
        """See ``Course``: a simulated hand feels no workload."""
        return {}

    def found(self) -> dict[str, Any]:
        """See ``Course``; medians over the trials of a task [s, N], and the mean of its six ratings."""
        found: dict[str, Any] = {"trials": len(self._rows)}
        for task in self._design.tasks:
            rows = [row for row in self._rows if row["task"] == task.kind]
            found[f"{task.kind}_done"] = sum(row["done"] for row in rows)
            for name in (*task.columns, "mean_force"):
                values = [row[name] for row in rows if row.get(name) is not None]
                found[f"{task.kind}_{name}"] = median(values) if values else None
            rated = [row for row in rows if all(name in row for name in workload.SCALES)]
            scores = [fmean(float(row[name]) for name in workload.SCALES) for row in rated]
            found[f"{task.kind}_{OVERALL}"] = scores[-1] if scores else None
        return found
