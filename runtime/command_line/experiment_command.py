"""``hapticd experiment``: the papers' figures and tables."""

from __future__ import annotations

import argparse
from importlib import import_module

from .arguments import Commands, name
from .outputs import folder


def add_experiment(commands: Commands) -> None:
    """Add `hapticd experiment`."""
    experiment = commands.add_parser(
        "experiment",
        help="run the papers' figures and tables",
        description="Run figures and tables of the papers in simulation: their numbers beside ours.",
    )
    which = experiment.add_mutually_exclusive_group(required=True)
    which.add_argument(
        "name", type=name, nargs="?", metavar="NAME", help="a figure or a table; a wrong name lists them"
    )
    which.add_argument(
        "--all", action="store_true", help="every experiment, two at a time; takes some minutes"
    )
    experiment.add_argument(
        "--machine",
        type=name,
        metavar="MACHINE",
        help="with --all: those of one machine alone; a wrong name lists them",
    )
    experiment.add_argument(
        "--full",
        action="store_true",
        help="more trials where an experiment has a study of many; takes longer",
    )
    experiment.add_argument(
        "--out",
        type=folder,
        metavar="DIR",
        help="write each plot into DIR/figures, each table into DIR/fidelity.md; default: write nothing",
    )
    experiment.add_argument("--json", action="store_true", help="print the figures as JSON, one line each")
    experiment.set_defaults(handler=run)


def run(options: argparse.Namespace) -> int:
    """Run what is asked for; the exit status."""
    # by name: experiments build on the runtime, which must not import them
    command = import_module("hapticd.experiments.command")
    return int(command.run(options.name, options.machine, options.out, options.json, options.full))
