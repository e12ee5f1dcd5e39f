"""Signals that ask for an end: Ctrl-C, termination, a closed terminal.

A program that has begun nothing says one line and is gone (``end_at_once``). What must not be left half done
holds the signals back (``held``), and lets them through where it takes care of them itself (``heard``).
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from errno import EIO
from types import FrameType
from typing import NoReturn

WORDS = {
    signal.SIGINT: "interrupted",
    signal.SIGTERM: "terminated",
    signal.SIGHUP: "the terminal was closed",
}


class Interrupted(KeyboardInterrupt):
    """A signal asked for the end.

    Attributes:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(WORDS[signal.Signals(number)])

    @property
    def status(self) -> int:
        """Exit status, as a shell has it."""
        return exit_status(self.number)


def exit_status(number: int) -> int:
    """Exit status of a program that a signal ended, as a shell has it: 130 for Ctrl-C."""
    return 128 + number


def asking() -> list[int]:
    """The signals that ask for an end here; under nohup, that the terminal closes is none of them."""
    return [n for n in WORDS if n != signal.SIGHUP or signal.getsignal(n) is not signal.SIG_IGN]


def end_at_once() -> None:
    """From now on a signal says one line and ends the process."""
    for number in asking():
        signal.signal(number, _end)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, WORDS)


def end_in_silence() -> None:
    """In a child that was begun with signals held: a signal ends it, and its parent says so."""
    for number in asking():
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, WORDS)


def hear_no_more() -> None:
    """All is done and said: a signal would only take the place of the exit status while Python clears up."""
    signal.pthread_sigmask(signal.SIG_BLOCK, WORDS)


def _end(number: int, _: FrameType | None) -> NoReturn:
    # not an exception: one that strikes in a destructor or between two imports is printed, or lost
    say(WORDS[signal.Signals(number)])
    os._exit(exit_status(number))


def say(text: str) -> None:
    """One line for people, whatever the state of the standard streams; the terminal may be gone."""
    end_of_line = "\n" if os.isatty(2) else ""  # the terminal echoed ^C
    try:
        os.write(2, f"{end_of_line}hapticd: {text}\n".encode())
    except OSError:
        return


def show(text: str) -> None:
    """Write for people; where nobody reads it, that is no reason to stop."""
    try:
        sys.stderr.write(text)
        sys.stderr.flush()
    except OSError:
        leave_terminal()


def leave_terminal() -> None:
    """Let go of a terminal that is gone: whoever writes to it gets an error."""
    null = os.open(os.devnull, os.O_RDWR | os.O_CLOEXEC)
    for fd in (0, 1, 2):
        try:
            os.ttyname(fd)
        except OSError as error:
            if error.errno == EIO:
                os.dup2(null, fd)
    os.close(null)


@contextmanager
def held() -> Iterator[None]:
    """Signals wait until what is half done is done; processes that start here never get them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, WORDS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def let_through() -> Iterator[None]:
    """Signals come through, even where they are held around this."""
    before = signal.pthread_sigmask(signal.SIG_UNBLOCK, WORDS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def heard(handler: Callable[[int], object]) -> Iterator[None]:
    """Signals come through to a handler, which is called between any two instructions."""
    with held():
        before = {n: signal.signal(n, lambda number, _: handler(number)) for n in asking()}
        try:
            with let_through():
                yield
        finally:
            for number, previous in before.items():
                signal.signal(number, previous)


def interrupt(number: int) -> NoReturn:
    """A handler for ``heard`` that raises.

    Raises:
        Interrupted: always.
    """
    raise Interrupted(number)
