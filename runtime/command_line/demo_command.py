"""``hapticd demo``: a machine to play with in the browser."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from ...configs.demonstrations import DEMONSTRATIONS
from ..configuration.known import demonstrations, example
from ..invocation import program
from . import run_command
from .arguments import Commands, add_twin, file, meant, name
from .run_command import ViewedError

Parse = Callable[[Sequence[str]], argparse.Namespace]


def add_demo(commands: Commands, parse: Parse) -> None:
    """Add `hapticd demo`; parse: what reads all that can be typed."""
    demo = commands.add_parser(
        "demo",
        help="a machine to play with in the browser",
        description="Run a simulated machine with its dashboard, and open that in this desktop's browser."
        " It goes on until Ctrl-C: lead the hand, press the emergency stop, reset, engage again.",
    )
    demo.add_argument(
        "config",
        type=name,
        metavar="DEMO",
        nargs="?",
        default=example(),
        help=f"{', '.join(demonstrations())}, or a TOML file; default: {example()}."
        " Of bimanual, both stations have a dashboard",
    )
    add_twin(demo)
    demo.add_argument("--log", type=file, metavar="FILE", help="recording; default: log/NAME-DATE-TIME.mcap")
    demo.set_defaults(
        handler=partial(run, parse), demo=True, view=True, json=False, lockstep=False, duration=None
    )


def run(parse: Parse, options: argparse.Namespace) -> int:
    """A scenario is another command; anything else is run as it stands. The exit status.

    Raises:
        ViewedError: there is no such demonstration, or it takes no such option.
    """
    asked = options.config
    if asked not in DEMONSTRATIONS:
        if asked not in demonstrations() and Path(asked).name == asked and not Path(asked).exists():
            raise ViewedError(f"there is no demonstration '{asked}'; {meant(asked, demonstrations())}")
        return run_command.run(options)
    found = parse(DEMONSTRATIONS[asked])
    found.demo = True
    for option in ("log", "twin"):
        given, stands = getattr(options, option), getattr(found, option, "none such")
        if given is not None and stands is not None:
            raise ViewedError(f"'{asked}' takes no --{option}; type: {program()} demo --help")
        if given is not None:
            setattr(found, option, given)
    return run_command.run(found) if found.handler is options.handler else int(found.handler(found))
