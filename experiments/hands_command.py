"""``hapticd hands``: random hands on a simulated machine, and what became of the sessions."""

from __future__ import annotations

import argparse
import shlex
import sys
from time import monotonic
from typing import TYPE_CHECKING

from ..configs.words import counted
from ..runtime.command_line.arguments import (
    MAX_SECONDS,
    Commands,
    add_twin,
    chosen,
    count,
    name,
    number,
    seed,
)
from ..runtime.configuration.known import built_in
from ..runtime.invocation import program
from .temper import RANDOM, Temper

if TYPE_CHECKING:
    from .hands import Tally

SECONDS = 25.0
MOST_FORCE, MOST_TORQUE, MOST_SPEED = 1000.0, 200.0, 5.0
MOST_WORKERS = 256


def add_hands(commands: Commands) -> None:
    """Add `hapticd hands`."""
    hands = commands.add_parser(
        "hands",
        help="random hands on a simulated machine",
        description="Run a simulated machine in lockstep under random hands: path, speed, strength, stiffness"
        " and the posture in which it engages. Prints causes of stops, how far limits were passed, how far"
        " the hand was followed, and the command that repeats the worst session. Exit status 1 where a"
        " session stopped.",
    )
    known = ", ".join(built_in())
    hands.add_argument("config", type=name, metavar="CONFIG", help=f"a TOML file, or built in: {known}")
    add_twin(hands, f"; {RANDOM}: another serial chain of one to seven joints each time")
    hands.add_argument("--count", type=count, default=40, metavar="N", help="of sessions; default: 40")
    hands.add_argument(
        "--seed",
        type=seed,
        default=1,
        metavar="S",
        help="of the first session, the others count on; default: 1",
    )
    hands.add_argument(
        "--workers", type=workers, default=1, metavar="W", help="processes that share the work; default: 1"
    )
    most = Temper()
    for option, value, unit, largest, what in (
        ("--seconds", SECONDS, "S", MAX_SECONDS, "of a session"),
        ("--force", most.force, "N", MOST_FORCE, "of the strongest hand"),
        (
            "--torque",
            most.torque,
            "NM",
            MOST_TORQUE,
            "of the strongest hand, where it holds directions [N m]",
        ),
        ("--speed", most.speed, "V", MOST_SPEED, "of the fastest hand [m/s]"),
    ):
        hands.add_argument(
            option, type=number(largest), default=value, metavar=unit, help=f"{what}; default: {value:g}"
        )
    hands.add_argument(
        "--wrong-model",
        action="store_true",
        help="a machine of another model than its controller's each time: masses +-20 %%, rotors +-30 %%,"
        " springs +-40 %%, commands a tick late",
    )
    hands.add_argument(
        "--errors", action="store_true", help="sensors that err as is typical, and joints that rub (not rhi)"
    )
    hands.add_argument(
        "--vary",
        type=name,
        metavar="WHAT",
        help="draw something else of the machine's; rhi: bodies, one to three of any kind for its wall",
    )
    hands.add_argument(
        "--json",
        action="store_true",
        help="print {sessions, finished, stops, worst_excess, worst, returned, covered} as JSON; covered"
        " where the twin is a free mass",
    )
    hands.set_defaults(handler=run)


def workers(text: str) -> int:
    """How many processes."""
    value = count(text)
    if value > MOST_WORKERS:
        raise argparse.ArgumentTypeError(f"'{text}' is more than {MOST_WORKERS} processes")
    return value


def run(options: argparse.Namespace) -> int:
    """Run the sessions and print what became of them; 1 where one stopped, else 0."""
    from ..runtime.command_line.paragraphs import DEEPER, tell
    from ..runtime.configuration import config
    from ..runtime.configuration.session import build
    from .hands import Tally, sessions
    from .own_plant import Doubt
    from .random_hand import pressed_at
    from .random_twin import with_random_chain

    chains = options.twin == RANDOM
    loaded = config.load(options.config if chains else chosen(options))
    # what is wrong with the configuration itself is said before anything else
    build(with_random_chain(loaded, options.seed) if chains else loaded)
    if options.seconds <= (engaged := pressed_at(loaded.config) + loaded.config.arming.fade):
        print(f"note: until {engaged:g} s the machine only engages; give --seconds more", file=sys.stderr)
    temper = Temper(options.force, options.torque, options.speed)
    seeds = range(options.seed, options.seed + options.count)
    tally, begin, show = Tally(), monotonic(), sys.stderr.isatty() and not options.json
    doubt, share = Doubt(options.wrong_model, options.errors), min(options.workers, options.count)
    for session in sessions(loaded, seeds, options.seconds, temper, share, doubt, chains, options.vary or ""):
        tally.add(session)
        if show:
            sys.stderr.write(f"\r{progress(tally, options.count, monotonic() - begin)}\x1b[K")
            sys.stderr.flush()
    if show:
        sys.stderr.write("\r\x1b[K")
    worst = repeat(options, tally)
    if options.json:
        print(as_json(tally, worst))
    else:
        for line in table(tally):
            tell(line, indent=DEEPER)
        print(f"the worst again: {worst}")
    return int(tally.finished < tally.sessions)


BAR = 30


def progress(tally: Tally, of: int, elapsed: float) -> str:
    """A bar, how many stopped, and how long it will take."""
    done = BAR * tally.sessions // of
    left = elapsed * (of - tally.sessions) / tally.sessions
    stopped = tally.sessions - tally.finished
    return f"[{'#' * done}{'.' * (BAR - done)}] {tally.sessions}/{of}, {stopped} stopped, {left:.0f} s left"


def repeat(options: argparse.Namespace, tally: Tally) -> str:
    """The command that repeats the worst session."""
    assert tally.worst is not None
    twin = ["--twin", options.twin] if options.twin else []
    most, words = (
        Temper(),
        [program(), "hands", options.config, *twin, "--count", "1", "--seed", tally.worst.seed],
    )
    for option, value, usual in (
        ("--seconds", options.seconds, SECONDS),
        ("--force", options.force, most.force),
        ("--torque", options.torque, most.torque),
        ("--speed", options.speed, most.speed),
    ):
        if value != usual:
            words += [option, repr(value)]
    words += [
        flag for flag, on in (("--wrong-model", options.wrong_model), ("--errors", options.errors)) if on
    ]
    words += ["--vary", options.vary] if options.vary else []
    return f"{words[0]} {shlex.join(map(str, words[1:]))}"


def as_json(tally: Tally, worst: str) -> str:
    """The tally as one JSON object; excesses in rad, m or N m, what hands got back in J, covered 0 to 1."""
    import msgspec

    found = {
        **{"sessions": tally.sessions, "finished": tally.finished, "stops": dict(tally.stops)},
        **{"worst_excess": tally.worst_excess, "worst": worst, "returned": tally.returned},
    }
    if tally.covered is not None:
        found["covered"] = tally.covered
    return msgspec.json.encode(found).decode()


def table(tally: Tally) -> list[str]:
    """The tally for people."""
    lines = [f"{counted(tally.sessions, 'session')}, simulated; {tally.finished} finished"]
    for reason, number_of in tally.stops.most_common():
        example = tally.examples[reason]
        lines.append(f"{number_of:5} x {reason}: e.g. seed {example.seed}, {example.seconds:.2f} s:")
        lines.append(f"          {example.detail}")
    if tally.worst_excess:
        lines.append("worst excess of each limit, in thousandths of its unit (negative: not reached):")
    lines += [f"  {name:20}{1e3 * excess:10.2f}" for name, excess in tally.worst_excess.items()]
    lines.append(f"most energy that a hand got back beyond what it had put in: {tally.returned:.3f} J")
    if tally.covered is None:
        lines.append("  (springs, drives and weights of what is rendered may give some of it)")
    else:
        mean, least = 1e2 * tally.covered, 1e2 * min(tally.shares)
        lines.append(f"of the way that an ideal twin goes the handle went {mean:.1f} % (least {least:.1f} %)")
    return lines
