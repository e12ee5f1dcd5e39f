"""A machine with another value of one of its parameters."""

from __future__ import annotations

import re
from dataclasses import replace

from ...configs.words import nearest
from ...runtime.configuration.config import Loaded, parse
from ...runtime.configuration.toml_lines import key_lines
from ...runtime.errors import HapticdError

_VALUE = re.compile(
    r"""^(?P<key>\s*[^=]+=\s*)(?P<quote>"?)(?P<number>[-+]?[0-9.][0-9.eE+-]*)(?P<unit>(?:\s*[A-Za-z][^"#]*?)?)(?P=quote)"""
    r"(?P<rest>\s*(#.*)?)$"
)


class StudyError(HapticdError):
    """A study that cannot be run as asked."""

    code = "study"
    exit_status = 2


def unit_of(loaded: Loaded, key: str) -> str:
    """The unit in which a configuration writes a parameter; "" for a plain number.

    Raises:
        StudyError: it does not write it, or not as one number.
    """
    return _found(loaded, key)[1]["unit"].strip()


def with_values(loaded: Loaded, values: dict[str, float]) -> Loaded:
    """The machine with other values of some parameters, in their units, in its text as well.

    Raises:
        StudyError: the configuration does not write one of them as one number.
        ConfigError: the machine does not take a value.
    """
    lines = loaded.text.splitlines()
    for key, value in values.items():
        at, match = _found(loaded, key)
        quote, unit = match["quote"], match["unit"]
        number = int(value) if value.is_integer() else value  # a count is not written 3.0
        lines[at] = f"{match['key']}{quote}{number}{unit}{quote}{match['rest']}"
    text = "\n".join(lines) + "\n"
    return replace(loaded, text=text, config=parse(text, loaded.source))


def _found(loaded: Loaded, key: str) -> tuple[int, re.Match[str]]:
    """Index of a key's line, and its value in it."""
    line = key_lines(loaded.text).get(key)
    if line is None:
        near = nearest(key, key_lines(loaded.text))
        meant = f"did you mean '{near}'? Or " if near else ""
        raise StudyError(
            f"{loaded.source} has no line for '{key}'; {meant}write it there, with the value it has"
        )
    match = _VALUE.match(loaded.text.splitlines()[line - 1])
    if not match:
        raise StudyError(f"{loaded.source}:{line}: '{key}' is not one number; choose a parameter that is")
    return line - 1, match
