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
from .protocol import Column, Course, Design
from .settings import StudyError

WIDTH = 78
SHOWN = {
    "trial": Column("number of the trial, from 1"),
    "key": Column("key that was pressed"),
    "response_time": Column("from the end of the last stimulus to the answer", "s"),
    "simulated": Column("who answered", levels={"0": "a person", "1": "a simulated observer"}),
}

Ask = Callable[[tuple[str, ...], Callable[[str], None]], str]
Render = Callable[[Mapping[str, float], Path], None]
"""Renders a stimulus and records its session in a file."""


class Sitting:
    """Leads a participant through a study.

    Attributes:
        course: the trials; done: of them.
    """

    def __init__(self, design: Design, text: str, folder: Path, participant: str, course: Course) -> None:
        """Begin, or go on with what ``folder`` holds.

        Args:
            design: the study.
            text: of its file.
            folder: for the data.
            participant: label, letters and digits.
            course: of the participant.

        Raises:
            StudyError: the participant has begun another study of this name, or the folder cannot be written.
        """
        self._design, self.course, self._simulated = design, course, False
        self._at = folder / bids.stem(participant, design.name)
        self._columns = {"trial": SHOWN["trial"], **course.columns, **SHOWN}
        try:
            bids.write_dataset(folder, design.name, participant)
        except OSError as error:
            raise StudyError(f"cannot write {error.filename or folder}: {error.strerror}") from error
        self._journal = Journal(self._at.with_name(f"{self._at.name}_journal.jsonl"))
        self._head = {"study": f"{zlib.crc32(text.encode()):08x}", "participant": participant}
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
        if lines and {key: lines[0].get(key) for key in self._head} != self._head:
            problem = "was begun with another text of the study"
            raise StudyError(f"{self._at.name}: {problem}; take the old file, or another participant")
        for line in lines[1:]:
            trial = self.course.next()
            row = dict(line)
            key = str(row.get("key"))
            if trial is None or key not in trial.keys:
                raise StudyError(f"{self._at.name}: trial {self.done + 1} does not fit; was it edited?")
            if {**row, **self.course.answer(key)} != row:
                raise StudyError(f"{self._at.name}: trial {self.done + 1} differs; was it edited?")
            self._rows.append(row)

    def consent(self, ask: Ask, say: Callable[[str], None], simulated: bool) -> bool:
        """Show what the participant agrees to, once; whether they do."""
        if self.agreed:
            return True
        if not simulated:
            for paragraph in self._design.consent.strip().splitlines():
                say(wrapped(paragraph))
            say("Do you agree? y or n")
            if ask(("y", "n"), lambda key: say("y or n, please")) == "n":
                return False
        at = datetime.now(UTC).isoformat(timespec="seconds")
        self._journal.add({**self._head, "consent": "simulated" if simulated else "confirmed", "at": at})
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
            for k, stimulus in enumerate(trial.stimuli, 1):
                log = logs / f"{self._at.name}_trial-{number:04}_{k}.mcap"
                log.unlink(missing_ok=True)  # of a trial that was broken off
                if len(trial.stimuli) > 1:
                    say(f"  {k}")
                render(stimulus, log)
            begin = monotonic()
            if ask:
                say(wrapped(f"{trial.question} ({' or '.join(trial.keys)})"))
                key = ask(trial.keys, lambda key: say(f"{' or '.join(trial.keys)}, please"))
            else:
                key = self.course.simulate()
            row = {"trial": number, **self.course.answer(key), "key": key}
            row |= {"response_time": round(monotonic() - begin, 3), "simulated": int(ask is None)}
            self._journal.add(row)
            self._rows.append(row)
            self.write()

    def write(self) -> None:
        """The table of all answers so far."""
        if self._rows:
            bids.write_table(self._at, self._columns, self._rows)

    def close(self) -> None:
        """Let another session go on."""
        self._journal.close()


def wrapped(text: str) -> str:
    """A paragraph for a terminal of 80 columns."""
    return textwrap.fill(printable(text), WIDTH)
