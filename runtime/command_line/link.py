"""``hapticd link``: keys of the stations, and a measurement of the link between them."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from .arguments import Commands, count, file, number

if TYPE_CHECKING:
    from ...link.round_trip import Comparison, Trips

ROLES: Final = ("avatar", "operator", "maintainer", "observer", "publisher")
MOST_DAYS: Final = 36500
LEAST_SIZE, MOST_SIZE = 9, 1176
MOST_FORGED: Final = 255
MOST_RATE: Final = 1e4

KEYGEN = """Make a folder of keys for each station, and the lab's own authority that signs them.

Without options it makes an avatar and an operator of those names. Run it again in the same DIR for another
station: the authority that is there signs that, too. Nothing is ever overwritten.

  avatar      is moved; waits for the others
  operator    moves an avatar, one operator at a time
  maintainer  may end an operator's session
  observer    may ask who moves an avatar, and look at what a publisher shows
  publisher   shows a session to observers (hapticd share), and moves nothing"""


def add_link(commands: Commands) -> None:
    """Add `hapticd link`."""
    link = commands.add_parser(
        "link",
        help="keys and test of the link between two stations",
        description="The link between an operator's station and an avatar; docs/link.md explains it.",
    )
    kinds = link.add_subparsers(required=True, metavar="COMMAND")
    keygen = kinds.add_parser(
        "keygen",
        help="make keys for stations",
        description=KEYGEN,
    )
    keygen.add_argument("folder", type=file, metavar="DIR", help="where all keys are kept")
    for role in ROLES:
        keygen.add_argument(
            f"--{role}",
            action="append",
            default=[],
            metavar="NAME",
            help=f"make keys for such {'an' if role[0] in 'ao' else 'a'} {role}; more than once for more",
        )
    keygen.add_argument(
        "--days", type=days, default=365, metavar="N", help="how long the certificates hold; default: 365"
    )
    keygen.add_argument("--json", action="store_true", help="print {folders, authority} as JSON")
    keygen.set_defaults(handler=_keygen)

    test = kinds.add_parser(
        "test",
        help="measure the link on this host",
        description="Send packets to another process of this host and back, in turns over the link and over"
        " plain UDP: what sealing costs.",
    )
    test.add_argument("--rounds", type=count, default=5, metavar="N", help="of each; default: 5")
    test.add_argument("--packets", type=count, default=1000, metavar="N", help="of a round; default: 1000")
    test.add_argument(
        "--size",
        type=size,
        default=240,
        metavar="BYTES",
        help="of a packet's payload; default: 240, two arms",
    )
    test.add_argument(
        "--rate", type=number(MOST_RATE), default=1000.0, metavar="HZ", help="of packets; default: 1000"
    )
    test.add_argument(
        "--forged",
        type=forged,
        default=0,
        metavar="N",
        help="a third way, on which N forged packets follow each answer, up to 255; default: 0",
    )
    test.add_argument(
        "--json", action="store_true", help="print {plain, link, flooded, ratio_p50, ...} as JSON"
    )
    test.set_defaults(handler=_test)


def days(text: str) -> int:
    """How many days."""
    value = count(text)
    if value > MOST_DAYS:
        raise argparse.ArgumentTypeError(f"'{text}' is more than {MOST_DAYS} days")
    return value


def size(text: str) -> int:
    """Bytes of a payload."""
    value = count(text)
    if not LEAST_SIZE <= value <= MOST_SIZE:
        raise argparse.ArgumentTypeError(
            f"'{text}' is not a number of bytes from {LEAST_SIZE} to {MOST_SIZE}"
        )
    return value


def forged(text: str) -> int:
    """How many forged packets come with each answer."""
    value = int(text) if text == "0" else count(text)
    if value > MOST_FORGED:
        raise argparse.ArgumentTypeError(f"'{text}' is more than {MOST_FORGED}")
    return value


def _keygen(options: argparse.Namespace) -> int:
    import msgspec

    with _extra():
        from ...link.keygen import AUTHORITY_FOLDER, keygen
        from ...link.stations import Role, Station, named
    stations = [named(name, Role(role)) for role in ROLES for name in getattr(options, role)]
    made = keygen(
        options.folder,
        stations or [Station(role, Role(role)) for role in ("avatar", "operator")],
        options.days,
    )
    authority = options.folder / AUTHORITY_FOLDER
    if options.json:
        content = {"folders": [str(path) for path in made], "authority": str(authority)}
        print(msgspec.json.encode(content).decode())
        return 0
    for path in made:
        print(f"{path}: copy this folder to that station, and nowhere else: scp -rp {path} STATION:")
    print(f"{authority}: stays here; whoever has its key can make stations, so keep it off the network")
    print("files key.pem are secret (mode 0600); a station refuses one that others may read")
    return 0


def _test(options: argparse.Namespace) -> int:
    with _extra():
        from ...link.round_trip import compare
    rounds, show = options.rounds, sys.stderr.isatty() and not options.json

    def progress(done: int) -> None:
        sys.stderr.write(f"\rround {done} of {rounds}\x1b[K" if done < rounds else "\r\x1b[K")
        sys.stderr.flush()

    seen = (progress,) if show else ()
    found = compare(options.size, options.rate, options.packets, rounds, options.forged, *seen)
    print(_as_json(found) if options.json else "\n".join(_lines(found, options)))
    return 0


@contextmanager
def _extra() -> Iterator[None]:
    """Says how to get the package that only the link needs."""
    try:
        yield
    except ModuleNotFoundError as error:
        if not (error.name or "").startswith("cryptography"):
            raise
        from ...link.errors import LinkError

        raise LinkError(
            f"the link needs a package that is not installed; type: {sys.executable} -m pip install"
            " 'hapticd[link]'"
        ) from error


def _microseconds(trips: Trips) -> dict[str, float]:
    names = {"p50_us": trips.p50, "p99_us": trips.p99, "p999_us": trips.p999, "max_us": trips.longest}
    return {name: round(1e6 * value, 1) for name, value in {**names, "late_p999_us": trips.late}.items()}


def _ways(found: Comparison) -> dict[str, Trips]:
    ways = {"plain": found.plain, "link": found.link, "flooded": found.flooded}
    return {name: trips for name, trips in ways.items() if trips}


def _as_json(found: Comparison) -> str:
    import msgspec

    content: dict[str, object] = {
        name: {"sent": trips.sent, "lost": trips.lost, **_microseconds(trips)}
        for name, trips in _ways(found).items()
    }
    content["ratio_p50"] = round(found.link.p50 / found.plain.p50, 3)
    if found.flooded:
        content["ratio_late_p999"] = round(found.flooded.late / found.link.late, 3)
        content["refused"] = found.refused
    content["handshake_ms"] = round(1e3 * found.handshake, 1)
    return msgspec.json.encode(content).decode()


def _lines(found: Comparison, options: argparse.Namespace) -> list[str]:
    lines = [
        f"round trip within this host, {options.size} bytes at {options.rate:g} Hz, in turns [us]",
        f"{'':12}{'p50':>9}{'p99':>9}{'p99.9':>9}{'max':>9}{'late p99.9':>12}{'lost':>8}",
    ]
    for name, trips in _ways(found).items():
        *values, late = _microseconds(trips).values()
        row = "".join(f"{value:9.1f}" for value in values)
        lines.append(f"{name:12}{row}{late:12.1f}{trips.lost:8} of {trips.sent}")
    lines.append(f"link: {found.link.p50 / found.plain.p50:.2f} times plain UDP (p50)")
    if found.flooded:
        lines.append(
            f"flooded: {options.forged} forged packets after each answer, {found.refused} dropped;"
            f" turns began {found.flooded.late / found.link.late:.2f} times as late as without (p99.9)"
        )
    lines.append(f"handshake: {1e3 * found.handshake:.0f} ms")
    return lines
