"""Runs a command that was understood; what goes wrong becomes a line and an exit status."""

from __future__ import annotations

import argparse
import os
import sys

import msgspec

from ...configs.printable import printable
from ...devices.errors import DeviceError
from ...link.errors import LinkError
from ...models import ModelError
from ..errors import HapticdError
from ..live.interrupts import Interrupted, say


def execute(options: argparse.Namespace) -> int:
    """Run the command that was typed; the exit status."""
    try:
        status = int(options.handler(options))
        sys.stdout.flush()
        return status
    except (HapticdError, LinkError) as error:
        return _fail(options, error.code, str(error), error.exit_status)
    except ModelError as error:
        return _fail(options, "model", str(error), 2)
    except DeviceError as error:
        return _fail(options, "device", str(error), 1)
    except OSError as error:
        return not_written(options, error)
    except Interrupted as interrupted:
        say(str(interrupted))
        return interrupted.status


def not_written(options: argparse.Namespace, error: OSError) -> int:
    """A file failed, or what was printed: says so but where nobody listens any more; the exit status."""
    if isinstance(error, BrokenPipeError):
        return _unheard()
    where = error.filename or "standard output, or a file that was being written"
    return _fail(options, "file", f"{where}: {error.strerror or error}", _unheard())


def _unheard() -> int:
    """Nobody takes the output: the rest of it is dropped, or the interpreter would complain at its end."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.close(null)
    return 1


def _fail(options: argparse.Namespace, code: str, message: str, status: int) -> int:
    if options.json:
        try:
            print(msgspec.json.encode({"error": code, "message": message}).decode(), flush=True)
        except OSError:
            _unheard()
    text = "\n".join(map(printable, message.splitlines()))  # it may quote a file of anybody's
    print(f"hapticd: error [{code}]: {text}", file=sys.stderr)
    return status
