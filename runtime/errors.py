"""Errors of the runtime; each carries a stable code listed in docs/errors.md."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..configs.printable import printable


class HapticdError(Exception):
    """Base of everything the command line reports without a traceback.

    Attributes:
        code: stable name of the error.
        exit_status: 1 a check failed, 2 bad usage or configuration, 3 stopped by safety.
    """

    code = "runtime"
    exit_status = 1

    def __reduce__(self) -> tuple[Any, ...]:
        """From a process of its own it comes back whole, whatever it was made of."""
        return _again, (type(self), self.args, self.__dict__)


def _again(kind: type[HapticdError], args: tuple[Any, ...], known: dict[str, Any]) -> HapticdError:
    error = kind.__new__(kind, *args)
    error.__dict__.update(known)
    return error


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is wrong with a configuration; line 0 where it is about no line."""

    line: int
    key: str
    problem: str
    fix: str

    def __str__(self) -> str:
        text = (f"{self.key}: " if self.key else "") + self.problem + (f"; {self.fix}" if self.fix else "")
        return printable(text)


class ConfigError(HapticdError):
    """A configuration that must not run a machine.

    Attributes:
        source: the file.
        findings: everything that is wrong with it.
    """

    code = "config"
    exit_status = 2

    def __init__(self, source: str, findings: list[Finding]) -> None:
        self.source = source
        self.findings = findings
        places = (f"{source}:{finding.line}" if finding.line else source for finding in findings)
        super().__init__("\n".join(f"{at}: {each}" for at, each in zip(places, findings, strict=True)))


class LogError(HapticdError):
    """A recording that cannot be used: ``problem`` says why, ``fix`` what to do."""

    code = "log"
    exit_status = 2

    def __init__(self, source: str, problem: str, fix: str) -> None:
        self.source, self.problem, self.fix = source, problem, fix
        super().__init__(f"{source}: {problem}; {fix}")


class LogTruncatedError(LogError):
    """A recording that ends in mid-record."""

    code = "log-truncated"


class LogModelError(LogError):
    """A recording of another machine, model or layout than the one it is used with."""

    code = "log-model"
