"""What a person may tell a running session, and how it is typed: a key on a terminal, else a word a line."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

from ...sim.person import Deed
from ..core.modes import Command, Mode, exchange, twin_number
from ..core.sections import Config, SimulatedBus

LONGEST_LINE = 256
"""Characters of a line; the rest of a longer one is skipped."""
LONGEST_KEY = 16
"""Characters of an escape sequence."""
ESCAPE = "\x1b"
KEY = re.compile(r"\x1b[\[O][^@-~]{0,16}[@-~]|\x1b(?![\[O]|$)|[^\x1b]", re.DOTALL)
"""What a terminal sends for one key."""
SHOWN = 12
"""Characters of something that was not understood, as it is quoted."""


class Request(Enum):
    """What concerns the session, not the machine."""

    QUIT = "quit"
    HELP = "help"


@dataclass(frozen=True, slots=True)
class Order:
    """Something that can be typed.

    Attributes:
        word: where lines are read.
        keys: on a terminal, as they arrive.
        label: the keys as a person calls them.
        hint: what they do, in a word or two.
        means: what it asks for.
        explained: what it does, in a line.
    """

    word: str
    keys: tuple[str, ...]
    label: str
    hint: str
    means: Command | Deed | Request
    explained: str


STOP = Order(
    "stop",
    ("s", " "),
    "s or space",
    "stop",
    Command.STOP,
    "bring it to rest, torque off, brakes closed; needs a reset",
)
QUIT = Order("quit", ("q",), "q", "quit", Request.QUIT, "bring the machine to rest and end, as Ctrl-C does")
HELP = Order("help", ("h", "?"), "h", "help", Request.HELP, "show this again")
RESET = Order(
    "reset",
    ("r",),
    "r",
    "reset",
    Command.RESET,
    "clear a stop whose cause is gone; let go of the dead-man first",
)
# no letter: nobody who types a word that is no order may arm a machine
ARM = Order("arm", ("+",), "+", "arm", Command.ARM, "allow the next press of the dead-man switch to start")
PRESS = Order("press", ("p",), "p", "press", Deed.PRESS, "press the simulated dead-man switch")
RELEASE = Order("release", ("l",), "l", "let go", Deed.RELEASE, "let go of the simulated dead-man switch")
SUPERVISION = tuple(
    Order(word, (key,), key, hint, deed, explained)
    for word, key, hint, deed, explained in (
        ("supervise", "o", "watch", Deed.SUPERVISE, "press the safety operator's simulated dead-man switch"),
        ("look away", "i", "look away", Deed.LOOK_AWAY, "let go of it"),
        ("override", "x", "override", Deed.OVERRIDE, "turn the key: it may move without a hand at it"),
        ("ask for a hand", "c", "no override", Deed.ASK_FOR_A_HAND, "turn it back"),
        ("enter the field", "e", "enter", Deed.ENTER_FIELD, "step into the field that the scanner watches"),
        ("leave the field", "v", "leave", Deed.LEAVE_FIELD, "step out of it"),
    )
)
PUSHES = tuple(
    Order(f"push {name}", keys, label, f"push {name}", deed, f"push the simulated hand {name}")
    for name, keys, label, deed in (
        ("left", ("\x1b[D", "\x1bOD"), "arrow left", Deed.PUSH_LEFT),
        ("right", ("\x1b[C", "\x1bOC"), "arrow right", Deed.PUSH_RIGHT),
        ("forward", ("\x1b[A", "\x1bOA"), "arrow up", Deed.PUSH_FORWARD),
        ("back", ("\x1b[B", "\x1bOB"), "arrow down", Deed.PUSH_BACK),
        ("up", ("u",), "u", Deed.PUSH_UP),
        ("down", ("d",), "d", Deed.PUSH_DOWN),
    )
)


STRIKE = Order("e-stop", (), "", "e-stop", Deed.STRIKE, "press the simulated emergency stop")
PULL_OUT = Order("pull out", (), "", "pull out", Deed.PULL_OUT, "pull the simulated emergency stop out again")


def viewed(config: Config) -> tuple[Order, ...]:
    """What a view may ask for: a real machine is only stopped from there."""
    if not isinstance(config.bus, SimulatedBus):
        return (STOP,)
    return (*(order for order in possible(config) if order not in (QUIT, HELP)), STRIKE, PULL_OUT)


def possible(config: Config) -> tuple[Order, ...]:
    """What can be typed at this machine, the important first; only a simulated one has a hand to lead."""
    arm = (ARM,) if config.arming.by == "command" else ()
    person = at_the_machine(config) if isinstance(config.bus, SimulatedBus) else ()
    return (STOP, QUIT, HELP, RESET, *arm, *_twins(config), *person)


def _twins(config: Config) -> tuple[Order, ...]:
    """One for each digital twin that may be rendered, where there are several."""
    names = config.twin_names if len(config.twin_names) > 1 else ()
    return tuple(
        Order(f"twin {name}", (str(k),), str(k), name, exchange(k), f"exchange the twin for {name}")
        for k, name in enumerate(names, 1)
    )


def at_the_machine(config: Config) -> tuple[Order, ...]:
    """What people do beside a simulated machine."""
    supervision = SUPERVISION if config.arming.by == "supervisor" else ()
    return (*supervision, PRESS, RELEASE, *PUSHES)


def key_line(orders: Sequence[Order]) -> list[str]:
    """The keys in a few words, one for each order, for the line at the bottom."""
    words = [f"{order.keys[0]} {order.hint}" for order in orders if order not in PUSHES]
    return [*words, "arrows u d push"] if any(order in PUSHES for order in orders) else words


def legend(orders: Sequence[Order], single_keys: bool) -> str:
    """What can be typed, for people."""
    if not single_keys:
        rows = [(order.word, order.explained) for order in orders]
        return "\n".join(["Type a word and Enter:", *(f"  {name:14} {text}" for name, text in rows)])
    rows = [(order.label, order.explained) for order in orders if order not in PUSHES]
    if any(order in PUSHES for order in orders):
        rows.append(("arrows", "push the simulated hand: left, right, forward, back, from above"))
        rows.append(("u, d", "push it up, down"))
    return "\n".join(["Keys, without Enter:", *(f"  {name:12}{text}" for name, text in rows)])


def remark(command: Command, mode: Mode) -> str:
    """Why a command changes nothing in this mode, empty where it does or where the cycle says so itself."""
    if twin_number(command):
        return "that takes READY" if mode in (Mode.BRINGUP, Mode.FAILED) else ""
    if mode in (Mode.BRINGUP, Mode.FAILED):
        return f"nothing to {command.name.lower()} in {mode.name}" if command.name else ""
    if command is Command.STOP and not mode.powered:
        return "the drives have no power"
    if command is Command.ARM and mode is not Mode.READY:
        return "that takes READY"
    return ""


@dataclass(frozen=True, slots=True)
class Heard:
    """What came in at once: the orders in it, and what was none of them."""

    orders: list[Order]
    unknown: list[str]


class Ear:
    """Finds the orders in what is typed; nothing is guessed from a part of a word.

    Attributes:
        single_keys: whether keys are heard, otherwise lines.
    """

    def __init__(self, orders: Sequence[Order], single_keys: bool) -> None:
        self._orders, self.single_keys = orders, single_keys
        self._by_name = {
            name: order for order in orders for name in (order.keys if single_keys else (order.word,))
        }
        self._rest = ""

    def hear(self, data: bytes) -> Heard:
        """Take what was typed since the last time; no bytes mean that nothing more comes."""
        text = data.decode("utf-8", "replace")
        names = list(self._keys(text) if self.single_keys else self._lines(text))
        known = [self._by_name[name] for name in names if name in self._by_name]
        return Heard(known, [name for name in names if name not in self._by_name])

    def answer(self, unknown: Sequence[str]) -> str:
        """What to say about it."""
        quoted = ", ".join(_quoted(name) for name in unknown[:3]) + (", ..." if len(unknown) > 3 else "")
        if self.single_keys:
            return f"{quoted}: no such key; {', '.join(key_line(self._orders))}"
        return f"{quoted}: no such word; {', '.join(order.word for order in self._orders)}"

    def _keys(self, text: str) -> Iterator[str]:
        """An escape sequence is one key; one that was cut off waits for its end, the key Esc for nothing."""
        rest, self._rest = self._rest + text, ""
        waits = bool(text) and rest != ESCAPE
        while rest:
            found = KEY.match(rest)
            if waits and not found and len(rest) < LONGEST_KEY:
                self._rest = rest
                return
            key = found[0] if found else rest
            yield key
            rest = rest[len(key) :]

    def _lines(self, text: str) -> Iterator[str]:
        *lines, rest = (self._rest + text).split("\n")
        if not text and rest:
            lines, rest = [rest], ""
        self._rest = rest[:LONGEST_LINE]
        for line in lines:
            name = " ".join(line.lower().split())
            if name:
                yield name


NAMES = {"\n": "Enter", "\r": "Enter", "\t": "Tab", "\x1b": "Esc", "\x7f": "Backspace", "\x04": "Ctrl-D"}


def _quoted(name: str) -> str:
    if name in NAMES:
        return NAMES[name]
    if name.startswith("\x1b"):
        return "that key"
    cut = name if len(name) <= SHOWN else f"{name[:SHOWN]}..."
    return f'"{cut}"' if cut.isprintable() else "that key"
