"""The text of a study's file, and where in it something stands."""

from __future__ import annotations

from dataclasses import dataclass

from ...configs.printable import printable
from ...runtime.configuration.toml_lines import key_lines, line_of
from .settings import StudyError


@dataclass(frozen=True, slots=True)
class StudyText:
    """A study as it is written.

    Attributes:
        source: its file, as it was named; text: what it holds.
    """

    source: str
    text: str

    def refusal(self, key: str, problem: str) -> StudyError:
        """What is wrong with a key, with file and line; of several lines, each."""
        at = f"{self.source}:{line_of(key, key_lines(self.text))}: {f'{key}: ' if key else ''}"
        return StudyError("\n".join(at + printable(line) for line in problem.splitlines()))
