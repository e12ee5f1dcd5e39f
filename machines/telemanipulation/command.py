"""`hapticd bimanual`: both stations of a telemanipulation together."""

from __future__ import annotations

import argparse
from math import inf
from pathlib import Path

from ...runtime.command_line.arguments import Commands, file, name, number, seed
from ...runtime.invocation import program

DESCRIPTION = """Run an operator's station and an avatar together. In lockstep: one virtual time for both and
for the network between them, as fast as it goes, with a processor each where there are two. Each station has
a log of its own, which replays by itself.

The network is drawn at random from a seed: the same seed gives the same session, bit for bit.

With --live: two daemons and two plants in real time, on this computer, over the sealed link."""

EPILOG = """examples:
  {program} bimanual
      both built-in stations, an ideal network
  {program} bimanual --delay 0.12 --jitter 0.04 --loss 0.05
  {program} bimanual my_operator.toml my_avatar.toml --duration 60 --logs log/first
      writes log/first-operator.mcap and log/first-avatar.mcap
  {program} bimanual --scene peg --duration 40
      the person takes a bar and a part, and puts one into the other
      (extra `scene`)
  {program} bimanual --live --duration 60

exit status: 0 done, 1 a check failed, 2 bad usage or configuration, 3 stopped by safety
"""


def add_bimanual(commands: Commands) -> None:
    """Add the command to the command line."""
    both = commands.add_parser(
        "bimanual",
        help="run an operator's station and an avatar together",
        description=DESCRIPTION,
        epilog=EPILOG.format(program=program()),
    )
    both.add_argument("operator", nargs="?", type=name, default="operator", metavar="OPERATOR")
    both.add_argument("avatar", nargs="?", type=name, default="avatar", metavar="AVATAR")
    both.add_argument(
        "--duration", type=number(1e5), metavar="S", help="seconds; default: as the operator's says"
    )
    both.add_argument(
        "--logs", type=file, metavar="PREFIX", help="of both recordings; default: log/bimanual-DATE-TIME"
    )
    for option, metavar, what in (
        ("--delay", "S", "mean delay of each direction [s]"),
        (
            "--jitter",
            "S",
            "largest deviation from it; each packet's own, so that packets overtake others [s]",
        ),
        ("--loss", "SHARE", "share of the packets that are lost"),
    ):
        both.add_argument(option, type=least_zero, default=0.0, metavar=metavar, help=f"{what}; default: 0")
    both.add_argument(
        "--burst", type=number(1e4), default=1.0, metavar="N", help="packets lost in a row, mean; default: 1"
    )
    both.add_argument(
        "--seed",
        type=seed,
        default=1,
        metavar="N",
        help="of the network, and of the person in a scene; default: 1",
    )
    both.add_argument(
        "--scene",
        choices=["peg"],
        metavar="SCENE",
        help="peg: a task with objects, in lockstep; needs MuJoCo",
    )
    both.add_argument("--live", action="store_true", help="in real time, over the sealed link of this host")
    both.add_argument(
        "--view", action="store_true", help="with --live: a dashboard in the browser for each station"
    )
    both.add_argument("--json", action="store_true", help="print both summaries as one JSON object")
    both.set_defaults(handler=run, demo=False)


def least_zero(text: str) -> float:
    """A number of at least zero."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value < inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of at least 0")
    return value


def run(options: argparse.Namespace) -> int:
    """Run both, and print both summaries; the exit status.

    Raises:
        PairError: the network cannot be, or the two are no pair.
        ConfigError: with file and line of everything that is wrong with a configuration.
    """
    from ...runtime.configuration import config
    from ...runtime.errors import ConfigError
    from ...sim.network_model import Conditions, NetworkModel
    from .apart import run_apart
    from .pair import Pair, PairError, declared
    from .pair_run import pair_run, report
    from .peg import set_task

    if options.live and options.scene:
        raise PairError("a scene runs in lockstep, not live; leave out --live or --scene")
    if options.view and not options.live:
        raise PairError("virtual time is over before it is seen; give --live, too")
    if options.live:
        from .live_pair import live_pair

        command = ("demo",) if options.demo else ("run", "--view") if options.view else ("run",)
        both = (options.operator, options.avatar)
        return live_pair(*both, options.duration, _logs(options.logs), options.json, command)
    try:
        conditions = Conditions(options.delay, options.jitter, options.loss, options.burst)
    except ValueError as error:
        raise PairError(f"no network is like that: {error}") from error
    stations = [config.load(each) for each in (options.operator, options.avatar)]
    if conditions.longest > 0.0:
        try:
            stations = [declared(loaded, conditions.longest) for loaded in stations]
        except ConfigError as error:
            problem = f"no link is declared with a delay of up to {conditions.longest:g} s; give less --delay"
            raise PairError(problem) from error
    pair = Pair(stations[0], stations[1], NetworkModel(conditions, options.seed))
    task = set_task(pair, options.seed) if options.scene else None
    logs = _logs(options.logs)
    run_both = pair_run if task else run_apart  # what both have to do with is in one process
    outcomes, speed = run_both(pair, stations, logs, options.duration, not options.json)
    print(report(stations, logs, outcomes, speed, options.json, task))
    return max(outcome.status for outcome in outcomes)


def _logs(prefix: Path | None) -> list[Path]:
    """Two new files."""
    from datetime import datetime

    from .pair import PairError

    if prefix is None:
        Path("log").mkdir(exist_ok=True)
        prefix = Path("log") / f"bimanual-{datetime.now():%Y%m%d-%H%M%S}"
    paths = [prefix.with_name(f"{prefix.name}-{station}.mcap") for station in ("operator", "avatar")]
    for path in paths:
        if path.exists():
            raise PairError(f"{path} exists already; name another with --logs PREFIX")
        if not path.parent.is_dir():
            raise PairError(f"there is no folder {path.parent} for the logs; make it")
    return paths
