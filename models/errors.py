"""Errors of robot models."""

from __future__ import annotations


class ModelError(Exception):
    """A robot description that must not drive a machine.

    Attributes:
        source: file or other origin of the description.
        line: line in it, 0 where none applies.
        problem: what is wrong.
        fix: what to write instead.
    """

    def __init__(self, source: str, line: int, problem: str, fix: str) -> None:
        self.source = source
        self.line = line
        self.problem = problem
        self.fix = fix
        where = f"{source}:{line}" if line else source
        super().__init__(f"{where}: {problem}; {fix}")
