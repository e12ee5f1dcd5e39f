"""``hapticd view``: the dashboard of a running session, or of a recording."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..runtime.command_line.arguments import Commands, add_session, file, name
from ..runtime.invocation import install
from .errors import ViewError

if TYPE_CHECKING:
    from .source import LiveSource, Recording

PORT = 8420
MOST_PORT = 65535


def add_view(commands: Commands) -> None:
    """Add `hapticd view`."""
    view = commands.add_parser(
        "view",
        help="a dashboard in the browser: of the running session, or of a recording",
        description="Show the session that runs, or a recording with a slider for its time, in the browser:"
        " the machine in 3D, mode and reasons, limits, hand, punctuality. Of a simulated machine"
        " one can hold the dead-man switch, press the emergency stop and lead the hand; a real one can only"
        " be stopped from there. Whatever the view does, the session does not wait for it.",
    )
    view.add_argument("log", type=name, metavar="LOG", nargs="?", help="default: the session that runs")
    add_session(view)
    view.add_argument(
        "--port",
        type=port,
        metavar="PORT",
        help=f"0: any that is free; default: {PORT}, or where that is taken another one",
    )
    view.add_argument(
        "--host",
        type=name,
        default="127.0.0.1",
        metavar="ADDRESS",
        help="default: 127.0.0.1; one that other hosts can reach needs --cert and --key",
    )
    view.add_argument("--cert", type=file, metavar="FILE", help="certificate of the server, PEM")
    view.add_argument("--key", type=file, metavar="FILE", help="its key, PEM")
    view.add_argument("--open", action="store_true", help="open it in the browser of this desktop")
    view.set_defaults(handler=run, json=False)


def port(text: str) -> int:
    """The number of a port; 0 is any that is free."""
    if not (text.isascii() and text.isdecimal() and len(text) <= 5 and int(text) <= MOST_PORT):
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 0 to {MOST_PORT}")
    return int(text)


def run(options: argparse.Namespace) -> int:
    """Serve until Ctrl-C; the exit status.

    Raises:
        ViewError: it cannot be served as asked, or a package is missing.
        SessionError: no session runs.
        LogError: the recording cannot be read.
    """
    try:
        from .server import Address, show
    except ModuleNotFoundError as error:
        if error.name != "websockets":
            raise
        raise ViewError(f"needs websockets; type: {install('websockets')}") from error
    address = Address(options.host, options.port, PORT, options.cert, options.key)
    return show(_source(options), options.session is None and options.log is None, address, options.open)


def _source(options: argparse.Namespace) -> LiveSource | Recording:
    from ..runtime.recording.log import open_log
    from .source import LiveSource, Recording, awaited, require_newest

    if options.log and options.session is not None:
        raise ViewError("a recording is of no running session; leave out --session or LOG")
    if options.log:
        return Recording(open_log(options.log))
    return LiveSource(awaited(options.session) if options.session else require_newest())
