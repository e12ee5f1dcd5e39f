"""``hapticd completion``: the words of every command, for the Tab key of a shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from ..configuration.known import built_in, demonstrations, twins
from .arguments import Commands

SHELLS = ("bash", "zsh", "fish", "tcsh")
FOLDERS = ("DIR", "FOLDER")
FILES = ("FILE", "FILE.toml", "LOG", "ROBOT.urdf")
NAMES = {"CONFIG": built_in, "TWIN": twins, "DEMO": demonstrations}
"""What may be a file, too."""


def add_completion(commands: Commands) -> None:
    """Add `hapticd completion`."""
    completion = commands.add_parser(
        "completion",
        help="a script that completes commands, options and machines by Tab",
        description="Print a script with which a shell completes commands, options, built-in machines and"
        " twins, and files by Tab.",
        epilog='  In ~/.bashrc:                    eval "$(hapticd completion bash)"\n'
        '  In ~/.zshrc, after compinit:     eval "$(hapticd completion zsh)"\n'
        "  In ~/.config/fish/config.fish:   hapticd completion fish | source",
    )
    completion.add_argument("shell", choices=SHELLS, metavar="SHELL", help=", ".join(SHELLS))
    completion.set_defaults(handler=run, json=False)


def run(options: argparse.Namespace) -> int:
    """Print the script; the exit status."""
    import shtab

    from .cli import commands

    parser = commands()
    for action in arguments(parser):
        if isinstance(action.choices, range):
            action.choices = None  # nobody picks a number from a list
        elif action.metavar in NAMES:
            action.choices = [*NAMES[action.metavar](), shtab.Choice("file")]
        elif action.metavar in FILES:
            action.complete = shtab.FILE  # type: ignore[attr-defined]
        elif action.metavar in FOLDERS:
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]
    print(shtab.complete(parser, options.shell))
    return 0


def arguments(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """The arguments of a command and of the commands below it."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from arguments(below)
        else:
            yield action
