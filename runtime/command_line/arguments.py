"""What the commands say of their arguments."""

from __future__ import annotations

import argparse
import sys
import textwrap
import tomllib
from collections.abc import Callable, Iterable
from itertools import groupby
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

from ...configs.quantities import BitRate
from ...configs.units import UnitError
from ...configs.words import nearest
from ..configuration.files import exists
from ..configuration.known import AND, BETWEEN, twins

Commands: TypeAlias = "argparse._SubParsersAction[Parser]"
"""What a command adds its parser to."""


MAX_SECONDS = 1e7
"""Longest session or measurement: four months."""
MAX_RATE = 1e5
"""Fastest loop [Hz]."""
MAX_COUNT = 10**9


class Help(argparse.HelpFormatter):
    """Lines at the margin are paragraphs and fill the terminal; indented ones, to be copied, stay whole."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        filled: list[str] = []
        for kept, lines in groupby(text.strip("\n").splitlines(), lambda line: not line or line[0] == " "):
            block = list(lines)
            filled += block if kept else [textwrap.fill(" ".join(block), width)]
        return "\n".join(indent + line for line in filled) + "\n"


class Parser(argparse.ArgumentParser):
    """Says what was probably meant where a word is wrong; takes no part of an option for the whole."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"formatter_class": Help, **options, "allow_abbrev": False})
        self._typed: list[str] = []

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse's, but a command judges its own words, under its own usage."""
        self._typed = list(sys.argv[1:] if args is None else args)
        found, rest = super().parse_known_args(args, namespace)
        if rest:
            word = rest[0].partition("=")[0]
            if not word.startswith("-"):
                self.error(f"'{word}' is one word too many")
            self.error(f"there is no option '{word}'; {meant(word, self._option_string_actions)}")
        return found, rest

    def error(self, message: str) -> NoReturn:
        """As argparse's; a program that asked for JSON is answered so, too."""
        if "--json" in self._typed:
            import msgspec  # a help does without

            print(msgspec.json.encode({"error": "usage", "message": message}).decode())
        super().error(message)

    def _print_message(self, message: str, file: Any = None) -> None:
        """As argparse's, to which it is all the same whether a help arrives."""
        if file is not sys.stdout:
            return super()._print_message(message, file)
        print(message, end="", flush=True)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            what = str(action.metavar or "value").lower()
            text = f"there is no {what} '{value}'; {meant(value, action.choices)}"
            raise argparse.ArgumentError(None, text)


def meant(word: str, known: Iterable[str]) -> str:
    """What a wrong word may have meant, or else all that it could."""
    known = list(known)
    begun = [each for each in known if len(word) > len("--") and each.startswith(word)]
    near = begun[0] if begun else nearest(word, known)
    return f"did you mean '{near}'?" if near else f"known: {', '.join(known)}"


def add_twin(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Add the option that gives a machine another twin; ``more`` says what else it takes."""
    parser.add_argument(
        "--twin",
        type=twin_names,
        metavar="TWIN",
        help="render this digital twin instead: a twin's TOML file (docs/twins.md), or built in: "
        f"{', '.join(twins())}; of several, TWIN,TWIN, the first, and exchange it on demand{more}",
    )


def add_session(parser: argparse.ArgumentParser) -> None:
    """Add the option that names one of several sessions of this host."""
    parser.add_argument(
        "--session", type=count, metavar="PID", help="of the daemon, where several run; default: the newest"
    )


def chosen(options: argparse.Namespace) -> str:
    """What a configuration is loaded by, with the twin that was asked for."""
    return f"{options.config}{BETWEEN}{options.twin}" if options.twin else str(options.config)


def name(text: str) -> str:
    """A name of anything: it has at least a character that can be seen."""
    if not text.strip():
        raise argparse.ArgumentTypeError("the name is empty")
    return text


def twin_names(text: str) -> str:
    """Names of twins, each with a character that can be seen, or that of one file, whatever it is called."""
    for one in [text] if exists(Path(text)) else text.split(AND):
        name(one)
    return text


def file(text: str) -> Path:
    """A file by its name."""
    return Path(name(text))


def new_configuration(text: str) -> Path:
    """A file that does not exist yet, in a folder that does, with the suffix of a configuration."""
    path = Path(name(text))
    if path.suffix != ".toml":
        raise argparse.ArgumentTypeError(f"'{text}': a configuration ends in .toml")
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f"'{path.parent}' is not a folder")
    return path


def count(text: str) -> int:
    """A whole number of at least one."""
    if not (text.isascii() and text.isdecimal() and len(text) < 20 and 0 < int(text) <= MAX_COUNT):
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1 to {MAX_COUNT}")
    return int(text)


def seed(text: str) -> int:
    """A whole number of at least zero."""
    if not (text.isascii() and text.isdecimal() and len(text) < 20 and int(text) <= MAX_COUNT):
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 0 to {MAX_COUNT}")
    return int(text)


def bit_rate(text: str) -> BitRate:
    """A bit rate with its unit."""
    try:
        return BitRate(BitRate.read(text))
    except UnitError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def setting(text: str) -> tuple[str, Any]:
    """KEY=VALUE; the value as TOML has it, or else as text."""
    key, equals, value = text.partition("=")
    if not (key and equals):
        raise argparse.ArgumentTypeError(f"'{text}' is not KEY=VALUE")
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key, value


def number(most: float) -> Callable[[str], float]:
    """A number above zero and not above ``most``."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = 0.0
        if not 0.0 < value <= most:
            raise argparse.ArgumentTypeError(f"'{text}' is not a number above 0 and up to {most:g}")
        return value

    return read
