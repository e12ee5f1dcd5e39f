"""Files beside a configuration that become a part of its text: a recording replays without them."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import ConfigError, Finding
from .files import exists, leaves, read_bytes
from .toml_lines import key_lines, line_of
from .toml_reader import MAX_WHOLE, read

_BARE = re.compile(r"[A-Za-z0-9_-]+")


class UnfitFileError(ValueError):
    """A file does not hold what a key names it for.

    Attributes:
        problem, fix: for people; the problem goes on behind the file's name.
    """

    def __init__(self, problem: str, fix: str) -> None:
        self.problem, self.fix = problem, fix
        super().__init__(f"{problem}; {fix}")


@dataclass(frozen=True, slots=True)
class Beside:
    """A file that a key of a configuration names, and what a table ``kept`` beside the key keeps of it.

    Attributes:
        table: path of the key's table.
        key: in the table.
        file: its name.
        most: bytes that it may have.
        what: it is, for people.
        keep: from its content the lines of the table ``kept``; raises UnfitFileError, or ConfigError for what
            is said with the file's own lines.
        absent: what to do where it is not there.
        folder: where it may lie as well.
    """

    table: Sequence[str]
    key: str
    file: str
    most: int
    what: str
    keep: Callable[[bytes], str]
    absent: str = "check the name"
    folder: Any = None


def with_files(text: str, source: str, files: Iterable[Beside], folder: Any) -> str:
    """A text that holds what it needs of the files beside it.

    Args:
        text: of a configuration.
        source: its file, for errors.
        files: that it names and does not hold yet.
        folder: where it is.

    Raises:
        ConfigError: with the line of the key whose file is not there, lies elsewhere or is unfit.
    """
    for file in files:
        text = _with_file(text, source, file, folder)
    return text


def _with_file(text: str, source: str, beside: Beside, folder: Any) -> str:
    key = ".".join((*beside.table, beside.key))

    def refusal(problem: str, fix: str) -> ConfigError:
        return ConfigError(source, [Finding(line_of(key, key_lines(text)), key, problem, fix)])

    table = ".".join(map(_quoted, beside.table))
    head = f"{text.rstrip()}\n\n[{table}.kept]\n"
    if _unfit(head, source):
        raise refusal("stands in braces, to which a recording can add nothing", f"write a table [{table}]")
    try:
        whole = head + beside.keep(_content(beside, folder, refusal))
    except UnfitFileError as error:
        raise refusal(f'"{beside.file}" {error.problem}', error.fix) from error
    if (size := len(whole.encode())) > MAX_WHOLE:
        problem = f'"{beside.file}" makes this file {size} bytes in a recording; the most are {MAX_WHOLE}'
        raise refusal(problem, "make the file smaller")
    if unfit := _unfit(whole, source):
        raise refusal(f'"{beside.file}" cannot be kept: {unfit.problem}', unfit.fix)
    return whole


def _quoted(name: str) -> str:
    """As a part of a table's name."""
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _unfit(text: str, source: str) -> Finding | None:
    """What is wrong with a text as TOML."""
    try:
        read(text, source, MAX_WHOLE)
    except ConfigError as error:
        return error.findings[0]
    return None


def _content(beside: Beside, folder: Any, refusal: Callable[[str, str], ConfigError]) -> bytes:
    """What the file holds; problem and fix make a refusal."""
    file = beside.file
    if leaves(file):
        raise refusal(f'"{file}" leaves the folder', "put it beside the configuration")
    entry = folder / file
    if beside.folder is not None and not exists(entry):
        entry = beside.folder / file
    if not exists(entry):
        raise refusal(f'no {beside.what} "{file}" beside it', beside.absent)
    try:
        return read_bytes(entry, file, beside.most, f"this is no {beside.what}")
    except ConfigError as error:
        (found,) = error.findings
        raise refusal(f'"{file}" {found.problem}', found.fix) from error
