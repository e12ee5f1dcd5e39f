"""Child processes: what a terminal says is their parent's business, and none of them outlives it.

Plant and recorder of a session see their parent's death by themselves, for each has something to bring to
an end then; others are tied to it.
"""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from typing import Any

from .._rt import lib
from ..errors import HapticdError
from .interrupts import heard, held, interrupt

CHILD_LIMIT_S = 30.0
"""How long a child process may take to start or to finish."""

LOOK_S = 0.01
"""Between two looks whether a child has ended."""
FAREWELL_S = 5.0
"""How long an interrupted child may take to bring its machine to rest and its log to an end."""

Child = subprocess.Popen[bytes]
Done = subprocess.CompletedProcess[Any]


class ChildError(HapticdError):
    """A child process did not start."""

    code = "child"


def spawn(module: str, arguments: list[str], fds: list[int], stdin: int = subprocess.DEVNULL) -> Child:
    """Start a module of this folder; it inherits the descriptors, and gets no signal of the terminal."""
    command = [sys.executable, "-m", f"{__package__}.{module}", *arguments]
    with held():
        return subprocess.Popen(command, pass_fds=fds, stdin=stdin, stdout=subprocess.PIPE)


def report_ready() -> bool:
    """Called by a child: it is ready. Whether its parent is still there."""
    try:
        os.write(1, b"\n")
    except BrokenPipeError:
        return False
    return True


def ignore_job_control() -> None:
    """In a child: whether the terminal suspends the session is the daemon's business."""
    for number in (signal.SIGQUIT, signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU):
        signal.signal(number, signal.SIG_IGN)


async def until_ready(name: str, child: Child) -> None:
    """A child writes one byte when it is ready.

    Raises:
        ChildError: it ended instead, or took too long.
    """
    try:
        async with asyncio.timeout(CHILD_LIMIT_S):
            said = await _next_words(child, 1)
    except TimeoutError:
        said = b""
    if not said:
        raise ChildError(f"the {name} process did not start; its message stands above")


async def last_words(child: Child, limit_s: float = CHILD_LIMIT_S) -> bytes:
    """What a child writes until it closes its standard output.

    Raises:
        TimeoutError: it did not within the limit.
    """
    words = b""
    async with asyncio.timeout(limit_s):
        while said := await _next_words(child, 1 << 16):
            words += said
    return words


async def _next_words(child: Child, size: int) -> bytes:
    """What a child writes next, nothing where it closed its standard output."""
    assert child.stdout is not None
    loop, readable = asyncio.get_running_loop(), asyncio.Event()
    loop.add_reader(child.stdout, readable.set)
    try:
        await readable.wait()
    finally:
        loop.remove_reader(child.stdout)
    return os.read(child.stdout.fileno(), size)


async def reap(child: Child, limit_s: float = CHILD_LIMIT_S) -> None:
    """Wait for a child's end, and bring it about where it does not come in time, or this is cancelled."""
    try:
        async with asyncio.timeout(limit_s):
            while child.poll() is None:
                await asyncio.sleep(LOOK_S)
    except TimeoutError:
        return
    finally:
        end(child)


def end(child: Child) -> None:
    """Whatever it is doing; where it has ended already, nothing."""
    child.kill()
    child.wait()


def tied(number: int = signal.SIGKILL) -> Callable[[], None]:
    """For ``preexec_fn``: the child gets a signal when this process is gone, however it went."""
    parent = os.getpid()

    def tie() -> None:
        lib.rt_die_with_parent(number, parent)

    return tie


def run_tied(command: Sequence[str], number: int = signal.SIGKILL, **options: Any) -> Done:
    """Run a program to its end; it ends, by a signal, where this process is interrupted or dies first.

    Args:
        command: the program and its arguments.
        number: the signal; one that has time to stop a machine first gets SIGTERM.
        options: of ``subprocess.Popen``.

    Raises:
        Interrupted: by a signal that asks for an end.
    """
    with held():
        child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            preexec_fn=tied(number),
            process_group=0,  # what the terminal says is said to this process alone
            **options,
        )
    try:
        with heard(interrupt):
            out, err = child.communicate()
    except KeyboardInterrupt:
        child.send_signal(number)
        try:
            child.wait(FAREWELL_S)
        except subprocess.TimeoutExpired:
            end(child)
        raise
    return Done(command, child.returncode, out, err)
