"""A participant's sitting: consent, trials, answers; it goes on where it was broken off."""

from __future__ import annotations

import textwrap
import zlib
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic
from typing import Any

from ...configs.printable import printable
from . import bids
from .journal import Journal
from .protocol import Column, Course, Design, Question, Stimulus, Trial
from .rendering import SAFETY, SessionError
from .settings import StudyError

WIDTH = 78
SIMULATED = "simulated"
"""What stands for the consent of who cannot give any."""
SHOWN = {
    "trial": Column("number of the trial, from 1"),
    "response_time": Column("from the first question to the last answer", "s"),
    "simulated": Column("who took part", levels={"0": "a person", "1": "a simulated participant"}),
}

Ask = Callable[[tuple[str, ...], Callable[[str], None]], str]
Render = Callable[[Stimulus, Path], None]
"""Renders a stimulus and records its session in a file."""
BEGIN = Question("", "Enter begins it", ("\n",), "Enter")


class Sitting:
    """Leads a participant through a study.

    Attributes:
        course: the trials; done: of them.
    """

    def __init__(
        self,
        design: Design,
        texts: Mapping[str, str],
        folder: Path,
        participant: str,
        course: Course,
        simulated: bool = False,
    ) -> None:
        """Begin, or go on with what ``folder`` holds.

        Args:
            design: the study.
            texts: of the study and of its machine, by what they are.
            folder: for the data.
            participant: label, letters and digits.
            course: of the participant.
            simulated: whether it is none of a person.

        Raises:
            StudyError: the participant has begun with other texts, or as a person what is to be simulated,
                or the folder cannot be written.
        """
        self._design, self.course, self._simulated = design, course, simulated
        self._participant = participant
        self._at = folder / bids.stem(participant, design.name)
        self._columns = {"trial": SHOWN["trial"], **course.columns, **SHOWN}
        try:
            bids.write_dataset(folder, design.name, participant)
        except OSError as error:
            raise StudyError(f"cannot write {error.filename or folder}: {error.strerror}") from error
        self._journal = Journal(self._at.with_name(f"{self._at.name}_journal.jsonl"))
        self._head = {what: f"{zlib.crc32(text.encode()):08x}" for what, text in texts.items()}
        self._rows: list[dict[str, Any]] = []
        try:
            self._take_up()
        except BaseException:
            self._journal.close()
            raise

    @property
    def done(self) -> int:
        """Trials that were answered."""
        return len(self._rows)

    @property
    def agreed(self) -> bool:
        """Whether consent was given."""
        return bool(self._journal.lines)

    def _take_up(self) -> None:
        lines = self._journal.lines
        for what, code in self._head.items():
            if lines and lines[0].get(what) != code:
                problem = f"was begun with another text of the {what}"
                raise StudyError(f"{self._at.name}: {problem}; take the old file, or another participant")
        if lines and (lines[0].get("consent") == SIMULATED) != self._simulated:
            before, now = ("by a person", "simulated")[:: -1 if self._simulated else 1]
            raise StudyError(f"{self._at.name}: was begun {now}, not {before}; take another participant")
        for line in lines[1:]:
            trial = self.course.next()
            row = dict(line)
            if trial is None or not all(str(row.get(q.name)) in q.answers for q in trial.questions):
                raise StudyError(f"{self._at.name}: trial {self.done + 1} does not fit; was it edited?")
            if {**row, **self.course.take(row)} != row:
                raise StudyError(f"{self._at.name}: trial {self.done + 1} differs; was it edited?")
            self._rows.append(row)

    def consent(self, ask: Ask, say: Callable[[str], None]) -> bool:
        """Show what the participant agrees to, once; whether they do."""
        if self.agreed:
            return True
        if not self._simulated:
            for paragraph in self._design.consent.strip().splitlines():
                say(wrapped(paragraph))
            say("Do you agree? y or n")
            if ask(("y", "n"), lambda key: say("y or n, please")) == "n":
                return False
        at = datetime.now(UTC).isoformat(timespec="seconds")
        consent = SIMULATED if self._simulated else "confirmed"
        self._journal.add({**self._head, "participant": self._participant, "consent": consent, "at": at})
        return True

    def run(self, render: Render, ask: Ask | None, say: Callable[[str], None]) -> None:
        """Go through the trials that are left; without ``ask``, its observer answers.

        The screen tells which trial it is and nothing of its stimuli.
        """
        logs = self._at.parent / "logs"
        logs.mkdir(exist_ok=True)
        while (trial := self.course.next()) is not None:
            number = self.done + 1
            say(f"trial {number}" + (f" of {self.course.count}" if self.course.count else ""))
            files = [
                logs / f"{self._at.name}_trial-{number:04}_{k}.mcap" for k in range(1, len(trial.stimuli) + 1)
            ]
            if trial.instruction and ask:
                say(wrapped(trial.instruction))
                _put(BEGIN, ask, say)
            stopped = _show(trial, files, render, say)
            measured = self.course.measure(files, stopped)
            begin = monotonic()
            answers = self._answers(trial, ask, say)
            given = {**measured, **answers}
            row = {"trial": number, **self.course.take(given), **given}
            row |= {"response_time": round(monotonic() - begin, 3), "simulated": int(ask is None)}
            self._journal.add(row)
            self._rows.append(row)
            self.write()

    def _answers(self, trial: Trial, ask: Ask | None, say: Callable[[str], None]) -> dict[str, str]:
        if ask is None:
            return self.course.simulate()
        return {question.name: _put(question, ask, say) for question in trial.questions}

    def write(self) -> None:
        """The table of all answers so far."""
        if self._rows:
            bids.write_table(self._at, self._columns, self._rows)

    def close(self) -> None:
        """Let another session go on."""
        self._journal.close()


def _show(trial: Trial, files: list[Path], render: Render, say: Callable[[str], None]) -> bool:
    """Render a trial's stimuli; whether safety stopped one."""
    stopped = False
    for k, (stimulus, log) in enumerate(zip(trial.stimuli, files, strict=True), 1):
        log.unlink(missing_ok=True)  # of a trial that was broken off
        if len(files) > 1:
            say(f"  {k}")
        try:
            render(stimulus, log)
        except SessionError as error:
            if not (trial.may_stop and error.status == SAFETY):
                raise
            say(f"  {error}")
            stopped = True
    return stopped


def _put(question: Question, ask: Ask, say: Callable[[str], None]) -> str:
    say(wrapped(f"{question.text} ({question.told})" if question is not BEGIN else question.text))
    return ask(question.answers, lambda given: say(f"{question.told}, please"))


def wrapped(text: str) -> str:
    """A paragraph for a terminal of 80 columns."""
    return textwrap.fill(printable(text), WIDTH)
