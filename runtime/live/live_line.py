"""What stays on the screen while a session runs: the state in a line, what comes next, and the keys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...devices.safety_plc import DEAD_MAN
from ..configuration.session import Session
from ..core.modes import Mode
from ..core.sections import Config
from ..recording.frames import safety_inputs
from ..recording.summary import Summary
from .orders import ARM, PRESS, RELEASE, RESET, Order

BY_HAND = {
    PRESS: "press the dead-man",
    RELEASE: "let go of the dead-man",
    RESET: "reset",
    ARM: "arm",
}
"""What a person does about it where no key does."""


class LiveLine:
    """Composes the line from the summary of a session that is under way."""

    def __init__(self, session: Session, summary: Summary, orders: Sequence[Order], duration: float) -> None:
        """Orders that keys can give, none where nobody can type them; duration in s, 0 without an end."""
        self._summary, self._duration = summary, duration
        self._keys = frozenset(orders)
        self._dead_man_bytes = safety_inputs(session.network)
        self._config: Config = session.config

    def words(self, endless: bool = False) -> list[str]:
        """The most important ones first; nothing that has not been measured.

        Args:
            endless: the end that was planned does not come any more.
        """
        last = self._summary.last
        if last is None:
            return ["waiting for the first tick"]
        mode = Mode(int(last["mode"]))
        ticks = self._summary.ticks if self._config.plant_time else int(last["tick"])
        elapsed = ticks / self._summary.rate
        end = f"/{self._duration:g}" if self._duration and not endless else ""
        words = [f"{elapsed:5.1f}{end} s {mode.name}"]
        if self._summary.measured:
            pressed = bool((last["raw"][self._dead_man_bytes] & DEAD_MAN == DEAD_MAN).all())
            words += self._next_step(mode, pressed)
            words.append(f"dead-man {'pressed' if pressed else 'open'}")
            words += self._summary.figures.live(mode, last["state"])
            touching = self._touching()
            words += [f"at {', '.join(touching)}"] if touching else []
        return words + list(self._punctuality())

    def _next_step(self, mode: Mode, pressed: bool) -> Iterator[str]:
        """What the machine waits for a person to do."""
        if mode in (Mode.HOLDING, Mode.STOPPED):
            yield f"next: {self._typed(RELEASE if pressed else RESET)}"
        elif mode is Mode.READY:
            arm = f"{self._typed(ARM)}, " if self._config.arming.by == "command" else ""
            yield f"next: {self._typed(RELEASE)}" if pressed else f"next: {arm}{self._typed(PRESS)}"

    def _typed(self, order: Order) -> str:
        return f"{order.keys[0]} {order.hint}" if order in self._keys else BY_HAND[order]

    def _touching(self) -> list[str]:
        return [extent.spec.name for extent in self._summary.extents if extent.touching]

    def _punctuality(self) -> Iterator[str]:
        summary = self._summary
        if summary.skipped:
            yield f"{summary.skipped} ticks skipped"
        if summary.lateness.count:
            yield f"late {summary.lateness.quantile(0.99):.0f} us (p99)"
            yield f"tick takes {summary.compute.quantile(0.5):.0f} us"
