"""Libraries: every requirement of the installed package, at the version it asks for."""

from __future__ import annotations

import re
from importlib import metadata

from ..invocation import install, name_of
from .line import Line, State

WHY = "Older libraries lack calls that the daemon uses, or make its ticks slower."


def installed() -> dict[str, str | None]:
    """Requirements of the core (``name>=version``), each with the installed version or None."""
    found: dict[str, str | None] = {}
    for requirement in metadata.requires("hapticd") or []:
        if "extra ==" not in requirement:
            try:
                found[requirement] = metadata.version(name_of(requirement))
            except metadata.PackageNotFoundError:
                found[requirement] = None
    return found


def library_lines(versions: dict[str, str | None]) -> list[Line]:
    """A line for uvloop, which the loop stands on, and one for all others."""
    loop = {need: have for need, have in versions.items() if name_of(need) == "uvloop"}
    rest = {need: have for need, have in versions.items() if need not in loop}
    return [_line("uvloop", loop), _line("libraries", rest)]


def _line(check: str, versions: dict[str, str | None]) -> Line:
    wrong = {
        name_of(need): f"{name_of(need)} {have or 'is missing'}, {need.partition(';')[0]} is needed"
        for need, have in versions.items()
        if have is None or _numbers(have) < _numbers(_least(need))
    }
    if wrong:
        return Line(check, State.FAIL, "; ".join(wrong.values()), WHY, install(*wrong))
    text = ", ".join(f"{name_of(need)} {have}" for need, have in versions.items())
    return Line(check, State.PASS, text, WHY)


def _least(requirement: str) -> str:
    match = re.search(r">=\s*([0-9.]+)", requirement)
    return match[1] if match else "0"


def _numbers(version: str) -> tuple[int, ...]:
    """The release part of a version, without zeros at its end: 2 and 2.0 are the same."""
    match = re.match(r"\d+(\.\d+)*", version)
    numbers = [int(part) for part in match[0].split(".")] if match else []
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)
