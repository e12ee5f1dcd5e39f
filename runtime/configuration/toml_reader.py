"""Reads TOML within stated bounds: a hostile or damaged file costs an error, not the program or the day."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from ...configs.numerals import SMALLEST_NORMAL
from ...configs.units import shown
from ..errors import ConfigError, Finding
from .toml_lines import key_lines, line_of

MAX_BYTES = 256 << 10
"""Of what a person writes."""
MAX_WHOLE = 1_000_000
"""Of a configuration with all that a recording keeps in it; a recording's own records have at most 1 MiB."""
MAX_LINE = 1000
"""Characters; the parser's effort grows with the square of a key's length."""
MAX_DEPTH = 10
"""Tables and arrays within each other, and names in a dotted key."""
MAX_INTEGER = 2**53
"""The largest up to which every integer is a double."""
_LONG_KEY = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]+\s*\.\s*){{{MAX_DEPTH}}}""")


def read(text: str, source: str, most: int = MAX_BYTES) -> dict[str, Any]:
    """The tree of a TOML text: tables, arrays, texts, booleans, numbers (nan and inf, too) and dates.

    Raises:
        ConfigError: for what is no TOML, has more than ``most`` characters, is too deep, or holds a denormal
            number or an integer beyond MAX_INTEGER.
    """
    _require_size(text, source, most)
    try:
        tree = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        told = re.search(r"line (\d+)", str(error))
        line = int(told[1]) if told else text.rstrip().count("\n") + 1
        fix = "mend the syntax" if told else "close what was opened; or is the file cut short?"
        raise _refusal(source, line, "", f"not TOML: {error}", fix) from error
    except RecursionError as error:
        raise _refusal(source, 0, "", "nested too deep", "a few levels are enough") from error
    except ValueError as error:  # an integer of thousands of digits
        raise _refusal(source, 0, "", f"not TOML: {error}", "write numbers of a few digits") from error
    _require_values(tree, text, source)
    return tree


def _require_size(text: str, source: str, most: int) -> None:
    if len(text) > most:
        raise _refusal(source, 0, "", f"larger than {most} bytes", "this is not a configuration")
    if text.startswith("\ufeff"):
        raise _refusal(source, 1, "", "begins with a byte order mark", "save it as plain UTF-8")
    for number, line in enumerate(text.split("\n"), 1):
        if len(line) > MAX_LINE:
            raise _refusal(source, number, "", f"a line of {len(line)} characters", f"at most {MAX_LINE}")
        if _LONG_KEY.search(line) and not line.lstrip().startswith("#"):
            raise _refusal(source, number, "", f"a key of more than {MAX_DEPTH} names", "use tables")


def _require_values(tree: dict[str, Any], text: str, source: str) -> None:
    """Bounds of the values, found without recursion."""
    stack: list[tuple[str, Any, int]] = [("", tree, 0)]
    while stack:
        path, value, depth = stack.pop()
        problem, fix = "", ""
        if isinstance(value, dict | list):
            if depth >= MAX_DEPTH:
                problem, fix = "nested too deep", "a few levels are enough"
            elif isinstance(value, dict):
                stack += [(f"{path}.{key}".lstrip("."), child, depth + 1) for key, child in value.items()]
            else:
                stack += [(f"{path}[{i}]", child, depth + 1) for i, child in enumerate(value)]
        elif isinstance(value, float) and 0.0 < abs(value) < SMALLEST_NORMAL:
            problem, fix = f"{value:g} is too small to be meant", "give 0 or more"
        elif isinstance(value, int) and abs(value) > MAX_INTEGER:
            problem, fix = "an integer beyond 2^53", "give a smaller one"
        if problem:
            lines = key_lines(text)
            raise _refusal(source, line_of(path, lines), path, problem, fix)


def _refusal(source: str, line: int, key: str, problem: str, fix: str) -> ConfigError:
    return ConfigError(source, [Finding(line, shown(key), problem, fix)])
