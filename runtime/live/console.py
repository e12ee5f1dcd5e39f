"""The person at a session's terminal: what is typed becomes an order, and Ctrl-Z waits for the machine."""

from __future__ import annotations

import asyncio
import os
import signal
from typing import Protocol

from ...sim.person import DIRECTIONS, Deed, Lead
from ..core.cycle import Cycle
from ..core.events import Event, EventKind
from ..core.modes import Command
from .keyboard import STDIN, Keyboard, is_resumable, may_read
from .orders import Ear, Order, Request, legend, remark
from .recorder import STDERR
from .recorder_link import RecorderLink

REPLIES = 20
"""Answers to what is typed, a second at most: a flood of it must not fill the ring."""
BREATH_S = 0.01
"""Between two looks at what is typed: faster than anybody types, too slow for a flood to matter."""
SUSPEND_S = 0.1
"""From rest until the shell may have the screen, on which the recorder has shown everything by then."""


def typed_at() -> bool:
    """Whether somebody at a terminal can type to this process."""
    return may_read(STDIN) and os.isatty(STDIN)


class Steered(Protocol):
    """What a person can ask of a session."""

    @property
    def now(self) -> int:
        """Tick."""

    def ask(self, command: Command) -> None:
        """Give the machine a command at the next tick."""

    def lead(self) -> bool:
        """A person takes over from the script; whether the session goes on until that person ends it."""

    def act(self, deed: Deed | Lead) -> None:
        """At the simulated machine's side.

        Raises:
            OSError: the plant takes no more.
        """

    def quit(self) -> None:
        """End, after the machine has come to rest."""


class Console:
    """Hears, obeys and answers one person."""

    def __init__(
        self,
        session: Steered,
        cycle: Cycle,
        recorder: RecorderLink,
        orders: tuple[Order, ...],
        single_keys: bool,
        rate: float,
    ) -> None:
        """Listens from ``attend`` on.

        Args:
            session: what is steered.
            cycle: of its session, which tells the state of the machine.
            recorder: shows the answers.
            orders: what can be typed.
            single_keys: whether the terminal gives every key at once.
            rate: of the loop [Hz].
        """
        self._session, self._cycle, self._recorder, self._orders = session, cycle, recorder, orders
        self._rate = rate
        self._ear = Ear(orders, single_keys)
        self._keyboard: Keyboard | None = None
        self._breath: asyncio.TimerHandle | None = None
        self._suspend_at = -1
        self._resumable = is_resumable()
        self._led = False
        self._replies, self._replies_since = 0, 0

    def attend(self, loop: asyncio.AbstractEventLoop) -> None:
        """From now on the person at the terminal is listened to."""
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)  # in the background nothing is heard
        loop.add_signal_handler(signal.SIGTSTP, self._stop_and_suspend)
        loop.add_signal_handler(signal.SIGCONT, self._attach, loop)
        self._attach(loop)
        if os.isatty(STDIN) and os.isatty(STDERR):
            self._say(legend(self._orders, self._ear.single_keys))

    def leave(self, loop: asyncio.AbstractEventLoop) -> None:
        """Nobody is listened to any more; the terminal is as it was."""
        if self._breath:
            self._breath.cancel()
        if self._keyboard:
            loop.remove_reader(self._keyboard.fd)
            self._keyboard.release()

    def look(self) -> None:
        """At each tick: a suspension that was asked for comes once the machine is off."""
        if self._suspend_at < 0:
            return
        if not self._cycle.drives.secured:
            self._suspend_at = self._session.now + round(SUSPEND_S * self._rate)
        elif self._session.now >= self._suspend_at:
            self._suspend_at = -1
            if self._keyboard:
                self._keyboard.release()
            os.kill(os.getpid(), signal.SIGSTOP)

    def _attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """Read what is typed, from the start or again after the shell had the terminal."""
        self._recorder.show(True)
        if may_read(STDIN):
            self._keyboard = self._keyboard or Keyboard(STDIN, self._ear.single_keys)
            self._keyboard.grab()
            loop.add_reader(self._keyboard.fd, self._typed, loop)

    def _stop_and_suspend(self) -> None:
        """Ctrl-Z: nobody freezes the controller of a machine that moves."""
        self._session.ask(Command.STOP)
        if not self._resumable:
            self._note(EventKind.NOT_SUSPENDED())
            return
        self._suspend_at = self._session.now + round(SUSPEND_S * self._rate)
        self._recorder.event(self._session.now, EventKind.SUSPENDING())
        self._recorder.show(False)

    def _typed(self, loop: asyncio.AbstractEventLoop) -> None:
        assert self._keyboard
        data = self._keyboard.read()
        if data is None:
            return
        loop.remove_reader(self._keyboard.fd)
        if data:
            self._breath = loop.call_later(BREATH_S, loop.add_reader, self._keyboard.fd, self._typed, loop)
        heard = self._ear.hear(data)
        for order in heard.orders:
            self.obey(order)
        if heard.unknown:
            self._say(self._ear.answer(heard.unknown))

    def obey(self, order: Order) -> None:
        """What a person asks for, at the keyboard or from a view."""
        match order.means:
            case Command() as command:
                self._session.ask(command)
                why = remark(command, self._cycle.mode)
                self._note(EventKind.TYPED(what=[order.word, why] if why else [order.word]))
            case Deed() as deed:
                self.act(deed)
                if deed not in DIRECTIONS:
                    self._note(EventKind.TYPED(what=[order.word]))
            case Request.HELP:
                self._say(legend(self._orders, self._ear.single_keys))
            case Request.QUIT:
                self._note(EventKind.TYPED(what=[order.word]))
                self._session.quit()

    def act(self, deed: Deed | Lead) -> None:
        """The person at the simulated machine; only what its devices then measure comes back."""
        if not self._led:
            self._led = True
            endless = self._session.lead()
            taken = EventKind.TAKEN_OVER_ENDLESS() if endless else EventKind.TAKEN_OVER()
            self._recorder.event(self._session.now, taken)
        try:
            self._session.act(deed)
        except OSError as error:
            self._say(f"the plant did not take that: {error.strerror}")

    def _say(self, text: str) -> None:
        if self._may_answer():
            self._recorder.say(text)

    def _note(self, event: Event) -> None:
        if self._may_answer():
            self._recorder.event(self._session.now, event)

    def _may_answer(self) -> bool:
        now = self._session.now
        if now - self._replies_since >= self._rate:
            self._replies, self._replies_since = 0, now
        self._replies += 1
        return self._replies <= REPLIES
