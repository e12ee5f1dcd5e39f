"""Where recordings are."""

from __future__ import annotations

import os
import shlex
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from ..configuration.known import example
from ..errors import HapticdError
from ..invocation import program

if TYPE_CHECKING:
    from ..configuration.config import Loaded

LOGS = Path("log")


class LogPathError(HapticdError):
    """The recording cannot be written, or there is none to read."""

    code = "log-path"
    exit_status = 2


def new_log(given: Path | None, loaded: Loaded) -> Path:
    """A new, empty file; recordings are never overwritten.

    Raises:
        LogPathError: it cannot be made there.
    """
    name = f"{Path(loaded.source).stem}-{datetime.now():%Y%m%d-%H%M%S-%f}"[:-3]
    path = given or LOGS / f"{name}.mcap"
    try:
        if given is None:
            LOGS.mkdir(exist_ok=True)
        path.touch(exist_ok=False)
    except FileNotFoundError as error:
        if path.parent.is_dir():  # such as /proc
            raise LogPathError(f"cannot write the log {path}: nothing can be made in that folder") from error
        make = f"mkdir -p {shlex.quote(str(path.parent))}"
        raise LogPathError(f"there is no folder {path.parent} for the log; type: {make}") from error
    except FileExistsError as error:
        if not os.path.lexists(path):
            raise LogPathError(f"cannot write the log {path}: {error.filename} is not a folder") from error
        what = "is a folder" if path.is_dir() else "exists already"
        raise LogPathError(f"{path} {what}; name a new file with --log FILE") from error
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise LogPathError(f"cannot write the log {path}: {why}; name another with --log FILE") from error
    return path


def newest_log() -> str:
    """The recording that was written last.

    Raises:
        LogPathError: there is none.
    """
    logs = sorted(LOGS.glob("*.mcap"), key=lambda path: path.stat().st_mtime)
    if not logs:
        make = f"{program()} run {example()}"
        raise LogPathError(f"there is no recording in {LOGS}/; name one, or make one: {make}")
    return str(logs[-1])
