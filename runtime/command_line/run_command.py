"""``hapticd run``: a machine, live or in lockstep."""

from __future__ import annotations

import argparse
import shlex
import sys
from functools import partial
from typing import TYPE_CHECKING

from ..configuration.known import built_in
from ..errors import HapticdError
from ..invocation import program
from ..live.interrupts import held
from .arguments import MAX_SECONDS, Commands, add_twin, chosen, file, name, number
from .logs import new_log

if TYPE_CHECKING:
    from pathlib import Path

    from ..configuration.config import Loaded
    from ..live.outcome import Outcome


class ViewedError(HapticdError):
    """A session that cannot be watched as asked."""

    code = "view"
    exit_status = 2


def add_run(commands: Commands) -> None:
    """Add `hapticd run`."""
    added = commands.add_parser(
        "run", help="run a machine", description="Run a machine, live or in lockstep."
    )
    known = ", ".join(built_in())
    added.add_argument(
        "config",
        type=name,
        metavar="CONFIG",
        help=f"a TOML file, or the name of a built-in machine: {known}",
    )
    add_twin(added)
    added.add_argument(
        "--duration",
        type=number(MAX_SECONDS),
        metavar="S",
        help="seconds; default: as the configuration says, but once a person at the keyboard has taken the"
        " simulated hand, until that person quits",
    )
    added.add_argument(
        "--log", type=file, metavar="FILE", help="recording; default: log/CONFIG-DATE-TIME.mcap"
    )
    added.add_argument(
        "--lockstep", action="store_true", help="virtual time, as fast as it goes, plant in-process"
    )
    added.add_argument(
        "--view", action="store_true", help="show it in the browser, too: prints the address of a dashboard"
    )
    added.add_argument("--json", action="store_true", help="print the summary as one JSON object")
    added.set_defaults(handler=run, demo=False)


def run(options: argparse.Namespace) -> int:
    """Run the machine, and say what came of it; the exit status.

    Raises:
        ViewedError: it cannot be watched as asked.
        LogPathError: the recording cannot be written.
    """
    from ..configuration import config
    from ..live import daemon, lockstep_run
    from ..live.recorder import STDERR
    from ..live.screen import steerable
    from ..live.watching import watching

    loaded = config.load(chosen(options))
    if options.demo or (options.view and options.lockstep):
        _require_playable(options, loaded)
    live = steerable(STDERR) and not options.json
    session = lockstep_run.run if options.lockstep else partial(daemon.run, endless=options.demo)
    with held(), watching(options.view, options.demo):
        log = new_log(options.log, loaded)
        try:
            outcome = session(loaded, log, options.duration, live)
        finally:
            if log.exists() and log.stat().st_size == 0:  # nothing began
                log.unlink()
    return _tell(options, loaded, outcome, log)


def _tell(options: argparse.Namespace, loaded: Loaded, outcome: Outcome, log: Path) -> int:
    """What came of the session; the exit status."""
    from ..configuration.session import remarks
    from ..live.never_active import never_active
    from ..live.promise import verdict
    from ..recording.summary import as_json, table
    from .paragraphs import tell

    status, last = outcome.status, ""
    idle = never_active(loaded.config, outcome)
    if outcome.report:
        shown, last = verdict(loaded, outcome.report, options.lockstep, idle)
        status = status or int(not shown)
    if outcome.report and options.json:
        speed = {} if outcome.speed_x is None else {"speed_x": outcome.speed_x}
        more = {"log": str(log), "status": status, "message": outcome.message, "verdict": last, **speed}
        more |= {"remarks": remarks(loaded), "never_active": idle.why if idle else ""}
        print(as_json(outcome.report, **more))
    elif outcome.report:
        print(table(outcome.report))
        if outcome.speed_x is not None:
            print(f"lockstep: {outcome.speed_x:g} times real time")
        for remark in remarks(loaded):
            tell(f"note: {remark}")
        print(f"log: {log}")
        print(f"replay: {program()} replay {shlex.quote(str(log))} --verify")
        tell(last)
    if outcome.message:
        tell(f"hapticd: {outcome.message}", sys.stderr)
    return status


def _require_playable(options: argparse.Namespace, loaded: Loaded) -> None:
    """A demonstration is of a simulated machine, and virtual time passes too fast to be watched."""
    from ..core.sections import SimulatedBus

    if options.lockstep:
        raise ViewedError("virtual time is over before it is seen; leave out --view, and view the log")
    if not isinstance(loaded.config.bus, SimulatedBus):
        why = f"{loaded.source} is on a real bus, and a demonstration would move it"
        raise ViewedError(f"{why}; type: {program()} run {shlex.quote(options.config)} --view")
