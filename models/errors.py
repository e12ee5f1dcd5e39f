"""Errors of robot models."""

from __future__ import annotations

from collections.abc import Sequence


class ModelError(Exception):
    """A robot description that must not drive a machine.

    Attributes:
        source: file or other origin of the description.
        line: line in it, 0 where none applies.
        problem: what is wrong.
        fix: what to write instead.
        findings: this one and all others that are wrong with the description, as errors of their own.
    """

    def __init__(
        self, source: str, line: int, problem: str, fix: str, others: Sequence[ModelError] = ()
    ) -> None:
        self.source = source
        self.line = line
        self.problem = problem
        self.fix = fix
        where = f"{source}:{line}" if line else source
        self.findings: list[ModelError] = [self, *others]
        super().__init__("\n".join([f"{where}: {problem}; {fix}", *map(str, others)]))
