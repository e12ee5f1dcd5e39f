"""Renders a stimulus: a session of the machine, recorded."""

from __future__ import annotations

from pathlib import Path

from ...runtime.configuration.config import Loaded
from ...runtime.live import daemon, lockstep_run
from ...runtime.live.interrupts import Interrupted
from ...runtime.live.never_active import never_active


class SessionError(Exception):
    """A session that ended otherwise than it should.

    Attributes:
        status: of the program: 1, or 3 where safety stopped it.
    """

    def __init__(self, status: int, message: str) -> None:
        self.status = status
        super().__init__(message)


SAFETY = 3
"""The status of a session that safety stopped."""


def render(loaded: Loaded, seconds: float, log: Path, live: bool) -> None:
    """Run the machine for so many seconds, live or in lockstep.

    Raises:
        SessionError: the session stopped by itself, or the machine never became active in it.
        Interrupted: a signal ended it; the machine is at rest.
    """
    if live:
        outcome = daemon.run(loaded, log, seconds, False)
    else:
        outcome = lockstep_run.run(loaded, log, seconds, False, quiet=True)
    if outcome.signals:
        raise Interrupted(outcome.signals[0])
    if outcome.status:
        raise SessionError(outcome.status, outcome.message)
    if idle := never_active(loaded.config, outcome):  # whatever the reason, nobody felt the stimulus
        raise SessionError(1, str(idle))
