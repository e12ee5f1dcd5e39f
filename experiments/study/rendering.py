"""Renders a stimulus: a session of the machine with the stimulus's values, recorded."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ...runtime.configuration.config import Loaded
from ...runtime.live import daemon, lockstep_run
from ...runtime.live.interrupts import Interrupted
from .settings import with_values


class SessionError(Exception):
    """A session that ended otherwise than it should.

    Attributes:
        status: of the program: 1, or 3 where safety stopped it.
    """

    def __init__(self, status: int, message: str) -> None:
        self.status = status
        super().__init__(message)


def render(loaded: Loaded, values: Mapping[str, float], seconds: float, log: Path, live: bool) -> None:
    """Run the machine for so many seconds, live or in lockstep.

    Raises:
        SessionError: the session stopped by itself.
        Interrupted: a signal ended it; the machine is at rest.
    """
    changed = with_values(loaded, dict(values))
    if live:
        outcome = daemon.run(changed, log, seconds, False)
    else:
        outcome = lockstep_run.run(changed, log, seconds, False, quiet=True)
    if outcome.signals:
        raise Interrupted(outcome.signals[0])
    if outcome.status:
        raise SessionError(outcome.status, outcome.message)
