"""Child processes of the daemon: each says with one byte on its standard output that it is ready."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys

from .errors import HapticdError

CHILD_LIMIT_S = 30.0
"""How long a child process may take to start or to finish."""

Child = subprocess.Popen[bytes]


class ChildError(HapticdError):
    """A child process did not start."""

    code = "child"


TERMINAL_SIGNALS = (
    *(signal.SIGINT, signal.SIGQUIT, signal.SIGHUP),
    *(signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU),
)


def spawn(module: str, arguments: list[str], fds: list[int], stdin: int = subprocess.DEVNULL) -> Child:
    """Start a module of this package; it inherits the file descriptors."""
    command = [sys.executable, "-m", f"hapticd.runtime.{module}", *arguments]
    return subprocess.Popen(command, pass_fds=fds, stdin=stdin, stdout=subprocess.PIPE)


def leave_terminal_to_the_daemon() -> None:
    """In a child: what is typed at the terminal, and its end, are the daemon's business."""
    for number in TERMINAL_SIGNALS:
        signal.signal(number, signal.SIG_IGN)


async def until_ready(name: str, child: Child) -> None:
    """A child writes one byte when it is ready."""
    assert child.stdout is not None
    loop, ready = asyncio.get_running_loop(), asyncio.Event()
    loop.add_reader(child.stdout, ready.set)
    try:
        async with asyncio.timeout(CHILD_LIMIT_S):
            await ready.wait()
        said = os.read(child.stdout.fileno(), 1)
    except TimeoutError:
        said = b""
    finally:
        loop.remove_reader(child.stdout)
    if not said:
        child.kill()
        raise ChildError(f"the {name} process did not start; its message stands above")


def reap(child: Child) -> None:
    """Wait for a child's end, and no longer than the limit."""
    try:
        child.wait(CHILD_LIMIT_S)
    except subprocess.TimeoutExpired:
        child.kill()
