"""What the commands say of their arguments."""

from __future__ import annotations

import argparse
import difflib
import tomllib
from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

from .quantities import BitRate
from .units import UnitError

Commands: TypeAlias = "argparse._SubParsersAction[Parser]"
"""What a command adds its parser to."""


MAX_SECONDS = 1e7
"""Of a session or a measurement: four months."""
MAX_RATE = 1e5
"""Of a loop [Hz]."""
MAX_COUNT = 10**9


class Parser(argparse.ArgumentParser):
    """Says what was probably meant where a word is wrong."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse's, but a command judges its own words, under its own usage."""
        found, rest = super().parse_known_args(args, namespace)
        if rest:
            word = rest[0].partition("=")[0]
            if not word.startswith("-"):
                self.error(f"'{word}' is one word too many")
            self.error(f"there is no option '{word}'; {meant(word, self._option_string_actions)}")
        return found, rest

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            what = str(action.metavar or "value").lower()
            text = f"there is no {what} '{value}'; {meant(value, action.choices)}"
            raise argparse.ArgumentError(None, text)


def meant(word: str, known: Iterable[str]) -> str:
    """What a wrong word may have meant, or else all that it could."""
    near = difflib.get_close_matches(word, list(known), 1)
    return f"did you mean '{near[0]}'?" if near else f"known: {', '.join(known)}"


def count(text: str) -> int:
    """A whole number of at least one."""
    if not (text.isascii() and text.isdecimal() and len(text) < 20 and 0 < int(text) <= MAX_COUNT):
        raise argparse.ArgumentTypeError(f"'{text}' is no whole number from 1 to {MAX_COUNT}")
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
        raise argparse.ArgumentTypeError(f"'{text}' is no KEY=VALUE")
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
            raise argparse.ArgumentTypeError(f"'{text}' is no number above 0 and up to {most:g}")
        return value

    return read
