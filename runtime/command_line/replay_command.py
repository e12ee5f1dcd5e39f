"""``hapticd replay``: a recorded session once more."""

from __future__ import annotations

import argparse

from .arguments import Commands, name
from .logs import newest_log
from .progress import counting


def add_replay(commands: Commands) -> None:
    """Add `hapticd replay`."""
    replay = commands.add_parser(
        "replay",
        help="re-run a recorded session",
        description="Re-run a recorded session through the same code and compare every tick.",
    )
    replay.add_argument(
        "log",
        type=name,
        metavar="LOG",
        nargs="?",
        help="a recording that `hapticd run` wrote; default: the newest in log/",
    )
    replay.add_argument(
        "--verify", action="store_true", help="exit with 1 unless every tick comes out bit for bit the same"
    )
    replay.add_argument(
        "--json",
        action="store_true",
        help="print ticks, differing_ticks, missing_ticks, first, speed_x, environment as JSON",
    )
    replay.set_defaults(handler=run)


def run(options: argparse.Namespace) -> int:
    """Compare every tick; the exit status.

    Raises:
        LogError: the recording cannot be read.
        LogPathError: there is none.
    """
    import msgspec

    from ..recording.log import open_log
    from ..recording.replay import describe, replay

    log = newest_log() if options.log is None else options.log
    with counting(options.json) as progress:
        found = replay(open_log(log), progress)
    print(msgspec.json.encode(found).decode() if options.json else describe(found))
    return 1 if options.verify and found.differing_ticks else 0
