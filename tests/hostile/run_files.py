"""Loads, builds and runs configurations in a process of its own, so that its death is seen.

Reads paths from stdin, one a line, and writes a line of JSON for each: what became of it. A file that takes
more than LIMIT_S of processor time, or PATIENCE_S at all, ends the process by a signal, wherever it is.
"""

import json
import signal
import sys
import traceback

import numpy as np
from hapticd.models import ModelError
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.errors import HapticdError
from hapticd.runtime.live.lockstep import Lockstep

LIMIT_S = 5.0
PATIENCE_S = 60.0
"""Much more than LIMIT_S: others use the processors, too."""
TICKS = 200


def run(path: str) -> dict[str, str]:
    try:
        session = build(config.load(path))
    except (HapticdError, ModelError) as error:
        return {"verdict": "refused", "why": str(error)}
    try:
        Lockstep(session).run(TICKS)
    except Exception:
        return {"verdict": "fell", "why": traceback.format_exc(limit=-3)}
    return {"verdict": "ran", "why": ""}


def main() -> None:
    np.seterr(divide="raise", over="raise", invalid="raise")
    for line in sys.stdin:
        signal.setitimer(signal.ITIMER_PROF, LIMIT_S)
        signal.setitimer(signal.ITIMER_REAL, PATIENCE_S)
        try:
            result = run(line.rstrip("\n"))
        except Exception:
            result = {"verdict": "fell", "why": traceback.format_exc(limit=-3)}
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        print(json.dumps(result), flush=True)


if __name__ == "__main__":
    main()
