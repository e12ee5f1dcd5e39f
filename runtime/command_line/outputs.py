"""Files that a command will write: what must fail fails before the work begins."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from .arguments import file

PICTURES = (".svg", ".png", ".pdf")


def picture(text: str) -> Path:
    """A file for a plot, in a folder that exists; one that is there already will be replaced."""
    path = Path(text)
    if path.suffix not in PICTURES:
        raise argparse.ArgumentTypeError(f"'{text}' should end with one of {', '.join(PICTURES)}")
    try:
        if path.exists():
            path.open("ab").close()
        else:
            _write_something(path.parent)
    except OSError as error:
        raise _refusal(text, error) from error
    return path


def folder(text: str) -> Path:
    """A folder for results, which need not exist yet."""
    path = file(text)
    try:
        there = next(each for each in (path, *path.absolute().parents) if each.exists())
        _write_something(there)
    except OSError as error:
        raise _refusal(text, error) from error
    return path


def _write_something(where: Path) -> None:
    """Asking for permissions is not enough: a file system may be full, or read only."""
    with tempfile.TemporaryFile(dir=where) as file:
        file.write(b"x")
        file.flush()


def _refusal(text: str, error: OSError) -> argparse.ArgumentTypeError:
    return argparse.ArgumentTypeError(f"cannot write '{text}': {error.strerror}")
