"""``hapticd share`` and ``hapticd follow``: a session that observers on other hosts look at."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from ipaddress import ip_address
from time import sleep
from typing import Final

from ..runtime.command_line.arguments import Commands, add_session, file, name
from ..runtime.invocation import install, program
from .errors import ViewError

LISTEN: Final = "127.0.0.1:7447"
MOST_PORT: Final = 65535
LOOK_S: Final = 0.02
"""Between two looks for frames."""
PACKAGES: Final = {"zenoh": "eclipse-zenoh", "cryptography": "cryptography"}
"""Modules that only this needs, and the packages that they are in."""


def add_share(commands: Commands) -> None:
    """Add `hapticd share`."""
    share = commands.add_parser(
        "share",
        help="show the running session to observers on other hosts",
        description="Show the session that runs here to observers on other hosts, over zenoh: TLS with"
        " certificates on both sides, and a slow observer holds up nobody. They can look, and nothing else."
        " Goes on until the session is over, or until Ctrl-C.",
    )
    share.add_argument(
        "keys", type=file, metavar="KEYS", help="folder of a publisher; `hapticd link keygen` makes it"
    )
    share.add_argument(
        "--listen",
        type=endpoint,
        default=LISTEN,
        metavar="ADDRESS:PORT",
        help=f"where observers reach it; default: {LISTEN}, so this host alone",
    )
    add_session(share)
    share.set_defaults(handler=_share, json=False)


def add_follow(commands: Commands) -> None:
    """Add `hapticd follow`."""
    follow = commands.add_parser(
        "follow",
        help="look at a session of another host",
        description="Follow a session that another host shows with `hapticd share`. As long as this runs,"
        " `hapticd top` and `hapticd view` show it here like a session of this host; nothing can be pressed."
        " A link that is lost is tried again, with longer and longer pauses. Goes on until the session is"
        " over, or until Ctrl-C.",
    )
    follow.add_argument(
        "keys", type=file, metavar="KEYS", help="folder of an observer; `hapticd link keygen` makes it"
    )
    follow.add_argument("where", type=endpoint, metavar="ADDRESS:PORT", help="of the publisher")
    follow.add_argument(
        "--name", type=name, default="*", metavar="NAME", help="of the publisher; default: whichever is there"
    )
    follow.set_defaults(handler=_follow, json=False)


def endpoint(text: str) -> str:
    """An address in numbers, and a port."""
    address, _, port = text.rpartition(":")
    try:
        found = ip_address(address[1:-1] if address.startswith("[") and address.endswith("]") else address)
        if not (port.isascii() and port.isdecimal() and len(port) <= 5 and 0 < int(port) <= MOST_PORT):
            raise ValueError
    except ValueError as error:
        raise argparse.ArgumentTypeError(
            f"'{text}' is no address and port in numbers, e.g. 192.168.1.7:7447 or [fd00::7]:7447"
        ) from error
    return f"[{found}]:{port}" if found.version == 6 else f"{found}:{port}"


@contextmanager
def _extra() -> Iterator[None]:
    """Says how to get what only this needs."""
    try:
        yield
    except ModuleNotFoundError as error:
        package = PACKAGES.get((error.name or "").partition(".")[0])
        if package is None:
            raise
        raise ViewError(f"needs {package}; type: {install(*PACKAGES.values())}") from error


def _share(options: argparse.Namespace) -> int:
    """Show it until it is over; the exit status.

    Raises:
        LinkError: the keys cannot be used.
        ViewError: nobody can wait there, or a package is missing.
        SessionError: no session runs.
    """
    with _extra():
        from ..link.credentials import load
        from .observers import Shown, publishes
    from .source import awaited, require_newest

    credentials = publishes(load(options.keys))  # before anybody waits for a session
    path = awaited(options.session) if options.session else require_newest()
    shown = Shown(credentials, options.listen, path)
    follow = f"{program()} follow KEYS {options.listen}"
    print(f"shown at {options.listen}; observers type: {follow}", flush=True)
    try:
        while not shown.over:
            shown.pass_on()
            sleep(LOOK_S)
        shown.pass_on()
    finally:
        shown.close()
    print("the session is over")
    return 0


def _follow(options: argparse.Namespace) -> int:
    """Follow it until it is over; the exit status.

    Raises:
        LinkError: the keys cannot be used.
        ViewError: nobody there takes them, or a package is missing.
        SessionError: nobody shows a session there.
    """
    with _extra():
        from ..link.credentials import load
        from .observers import Followed, Seen

    followed = Followed(load(options.keys), options.where, options.name)
    seen, about = Seen.LOST, None
    try:
        while followed.seen is not Seen.OVER:
            if followed.seen is not seen or followed.about is not about:
                seen, about = followed.seen, followed.about
                print(_now(about.config, seen is Seen.SHOWN), flush=True)
            followed.wait(1.0)
    finally:
        followed.close()
    wrong = f", {followed.wrong} messages were none" if followed.wrong else ""
    print(f"the session is over; {followed.count} frames came{wrong}")
    return 0


def _now(session: str, shown: bool) -> str:
    if shown:
        return f"following {session}; `{program()} top` and `{program()} view` show it"
    return f"{session} is shown no more, or the link is lost; trying again until Ctrl-C"
