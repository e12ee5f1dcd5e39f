"""Answers as they come: a file that only grows, and of which a crash at any moment leaves all answers."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import Any

import msgspec

from .settings import StudyError


class Journal:
    """Lines of JSON, each on the disk before the next trial begins.

    Attributes:
        lines: that it holds.
    """

    def __init__(self, path: Path) -> None:
        """Open, or begin; an answer that a crash cut short was not given.

        Raises:
            StudyError: somebody else writes it, it is damaged, or it cannot be written.
        """
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        except OSError as error:
            raise StudyError(f"cannot write {path}: {error.strerror}") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(self._file)
            raise StudyError(f"{path} is being written by another session; end that first") from error
        data = path.read_bytes()
        whole = data.rpartition(b"\n")[0] + b"\n" if b"\n" in data else b""
        if len(whole) < len(data):
            os.ftruncate(self._file, len(whole))
        self.lines: list[dict[str, Any]] = []
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                self.lines.append(msgspec.json.decode(line, type=dict[str, Any]))
            except msgspec.DecodeError as error:
                os.close(self._file)
                raise StudyError(f"{path}:{number}: no line of this program; move the file away") from error

    def add(self, line: dict[str, Any]) -> None:
        """Write a line; when this returns, it is on the disk."""
        data = msgspec.json.encode(line) + b"\n"
        while data:
            data = data[os.write(self._file, data) :]
        os.fsync(self._file)
        self.lines.append(line)

    def close(self) -> None:
        """Let others write it."""
        os.close(self._file)
