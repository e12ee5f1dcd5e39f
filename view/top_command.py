"""``hapticd top``: the essentials of the running session in a terminal."""

from __future__ import annotations

import argparse
import sys
from time import monotonic_ns, sleep
from typing import TYPE_CHECKING

from ..runtime.command_line.arguments import Commands, add_session

if TYPE_CHECKING:
    from ..runtime.recording.frames import Frame

LOOK_S = 0.2
PATIENCE_S = 2.0
"""How long the first frame may take."""
PIPED = 80
"""Columns where there is no terminal."""


def add_top(commands: Commands) -> None:
    """Add `hapticd top`."""
    top = commands.add_parser(
        "top",
        help="the essentials of the running session in a terminal",
        description="Mode, switches, punctuality, force, solver, limits, bus and recording of the session"
        " that runs, from any other terminal, e.g. over ssh. Only looks; the session does not notice. Through"
        " a pipe it prints them once. Ctrl-C ends it.",
    )
    add_session(top)
    top.add_argument("--json", action="store_true", help="print the newest frame as one JSON object, once")
    top.set_defaults(handler=run)


def run(options: argparse.Namespace) -> int:
    """Show it until the session is over, or once; the exit status.

    Raises:
        SessionError: no session runs.
    """
    import msgspec

    from ..runtime.live.recorder import STDERR
    from ..runtime.live.screen import steerable, terminal_size
    from ..runtime.recording.published import SessionError
    from .source import SessionWatch
    from .top import rows, screen

    watch = SessionWatch.of(options.session)
    for _ in range(round(PATIENCE_S / LOOK_S)):
        if watch.look():
            break
        sleep(LOOK_S)
    if watch.newest is None:
        raise SessionError("the session has published nothing yet")
    live = steerable(1) and steerable(STDERR) and not options.json
    if options.json:
        print(
            msgspec.json.encode(
                {**msgspec.structs.asdict(watch.newest), "age_s": _age_s(watch.newest)}
            ).decode()
        )
        return 0
    while True:
        columns, high = terminal_size(1)
        size = (columns, high) if live else (PIPED, 1000)
        lines = rows(watch.newest, watch, watch.said, size, _age_s(watch.newest))
        if not live:
            print("\n".join(lines))
            return 0
        sys.stdout.write(screen(lines, columns, high))
        sys.stdout.flush()
        sleep(LOOK_S)
        if not watch.look() and watch.over:
            print("the session is over")
            return 0


def _age_s(frame: Frame) -> float:
    """Since it was published on this host [s]."""
    return (monotonic_ns() - frame.published_ns) / 1e9
