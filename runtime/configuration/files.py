"""Files that a configuration is made of: read up to a known size, and nothing that would be waited for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import ConfigError, Finding


def exists(entry: Any) -> bool:
    """Whether something of that name is there; no name is too long or too odd to ask."""
    try:
        return bool(entry.is_file() or entry.is_dir() or (isinstance(entry, Path) and entry.exists()))
    except (OSError, ValueError):
        return False


def leaves(file: str) -> bool:
    """Whether a name leads out of the folder that it is meant in."""
    return file.startswith("/") or ".." in file.split("/")


def read_bytes(entry: Any, name: str, most: int, otherwise: str) -> bytes:
    """Content of a file, or of a resource.

    Args:
        entry: it.
        name: for people.
        most: bytes that it may have.
        otherwise: what it is not, where it is something else, for people.

    Raises:
        ConfigError: it cannot be read, is no file, or is larger.
    """
    if exists(entry) and not entry.is_file():  # a pipe would be waited for
        raise ConfigError(name, [Finding(0, "", "is not a regular file", otherwise)])
    try:
        with entry.open("rb") as file:
            content: bytes = file.read(most + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise ConfigError(name, [Finding(0, "", f"cannot be read: {reason}", "check the path")]) from error
    if len(content) > most:
        raise ConfigError(name, [Finding(0, "", f"is larger than {most} bytes", otherwise)])
    return content


def decoded(content: bytes, name: str, otherwise: str) -> str:
    """Content of a file as text.

    Raises:
        ConfigError: it is none.
    """
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise ConfigError(name, [Finding(line, "", "is not UTF-8 text", otherwise)]) from error


def read_text(entry: Any, name: str, most: int, otherwise: str) -> str:
    """Text of a file.

    Raises:
        ConfigError: see ``read_bytes`` and ``decoded``.
    """
    return decoded(read_bytes(entry, name, most, otherwise), name, otherwise)
