"""Where in a TOML text a key stands: what the parser does not tell."""

from __future__ import annotations

import re

_TABLE = re.compile(r"^\s*(\[\[?)\s*([^\]]+?)\s*\]\]?\s*(#.*)?$")
_KEY = re.compile(r"^\s*([A-Za-z0-9_.\"'-]+)\s*=")


def key_lines(text: str) -> dict[str, int]:
    """Line of every key and table, by its path, e.g. ``simulation.hand.path[2].at``."""
    lines: dict[str, int] = {}
    counts: dict[str, int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), 1):
        if match := _TABLE.match(line):
            table = re.sub(r"\s*\.\s*", ".", match[2].replace('"', ""))
            if match[1] == "[[":
                index = counts.get(table, 0)
                counts[table] = index + 1
                lines.setdefault(table, number)
                table = f"{table}[{index}]"
            lines.setdefault(table, number)
        elif match := _KEY.match(line):
            key = match[1].replace('"', "")
            lines.setdefault(f"{table}.{key}" if table else key, number)
    return lines


def line_of(path: str, lines: dict[str, int]) -> int:
    """Line of a path, or of the nearest table around it."""
    while path:
        if path in lines:
            return lines[path]
        cut = max(path.rfind("."), path.rfind("["))
        path = path[:cut] if cut > 0 else ""
    return 1
