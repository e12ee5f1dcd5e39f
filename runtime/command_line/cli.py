"""The command line.

What a command works with is imported when it runs: help, a wrong word and completion answer at once.
"""

from __future__ import annotations

import argparse
import os
import sys
from importlib import import_module, metadata
from io import TextIOWrapper
from typing import IO

from ...configs import plugins
from ..configuration.known import example
from ..invocation import program
from .arguments import Parser
from .check_command import add_check
from .demo_command import add_demo
from .doctor_command import add_doctor
from .experiment_command import add_experiment
from .plant_command import add_plant
from .replay_command import add_replay
from .run_command import add_run

EPILOG = """examples:
  {program} run {machine}
      a built-in machine, simulated, in a scripted hand
  {program} run my_machine.toml --duration 600
  {program} run {machine} --twin door
      the same machine as a door with a handle; docs/twins.md: one of your own
  {program} run {machine} --twin mass,door,excavator
      begins with the first; the keys 1 to 3 exchange it while the machine runs
  {program} replay --verify
      the newest session again, every tick compared bit for bit
  {program} check my_machine.toml
  {program} doctor
  {program} bench solve --json

While a session runs, its terminal shows the keys that can be pressed: stop,
reset, quit, and those of the simulated person. Through a pipe, commands are
whole words, one a line; the word help lists them. Ctrl-C ends the session
after the machine has come to rest.

exit status: 0 done, 1 a check failed, or the machine never became active
             though there was time for it, 2 bad usage or configuration,
             3 stopped by safety; ended before anything moved, or at once
             because asked twice: 130 by Ctrl-C, 143 by SIGTERM, 129 by a
             terminal that closed

hapticd is not a certified safety device. Nobody may rely on it instead of STO,
brakes, dead-man switch and emergency stop."""


def main(arguments: list[str] | None = None) -> int:
    """Run a command; returns the exit status."""
    # a path that a terminal cannot show is no reason to fail
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    closed = _require_streams()
    parser = commands()
    try:
        options = parser.parse_args(arguments)
    except OSError as error:  # a help that nobody takes
        from .execution import not_written

        return not_written(argparse.Namespace(json=False), error)
    if options.json and sys.stdout in closed:
        parser.error("standard output is closed, and what --json prints goes there: give it a file or a pipe")
    from .execution import execute

    return execute(options)


def _require_streams() -> list[IO[str]]:
    """Where a standard stream was closed, nothing else may take its place: a log would be written to.

    Returns:
        what stands for those that were closed.
    """
    closed: list[IO[str]] = []
    for fd, stream, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(fd)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which is fd
            closed.append(open(fd, mode, closefd=False))
            setattr(sys, stream, closed[-1])
    return closed


def commands() -> argparse.ArgumentParser:
    """All that can be typed."""
    parser = Parser(
        prog="hapticd",
        description="Real-time daemon for kinesthetic haptic interfaces.",
        epilog=EPILOG.format(program=program(), machine=example()),
    )
    parser.add_argument("--version", action="version", version=f"hapticd {metadata.version('hapticd')}")
    added = parser.add_subparsers(required=True, metavar="COMMAND")

    add_run(added)
    add_demo(added, parser.parse_args)
    for add in (add_replay, add_check, add_doctor, add_plant):
        add(added)
    for command in plugins.names(plugins.COMMANDS):
        plugins.plugin(plugins.COMMANDS, command)(added)
    # by name: benchmarks build on the runtime, which must not import them
    import_module("hapticd.bench.command").add_benchmarks(added)
    add_experiment(added)
    return parser
