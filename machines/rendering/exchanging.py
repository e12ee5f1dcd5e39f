"""Machines that render one of several twins, and exchange it."""

from __future__ import annotations

from .rendering import Rendering


class ExchangesTwins:
    """What such a machine tells and takes; see ``Exchanging``."""

    _rendering: Rendering
    twins: tuple[str, ...]

    @property
    def rendered(self) -> int:
        """See ``Exchanging``."""
        return self._rendering.control.rendered

    @property
    def wanted(self) -> int:
        """See ``Exchanging``."""
        return self._rendering.exchange.wanted

    @property
    def abandoned(self) -> str:
        """See ``Exchanging``."""
        return self._rendering.exchange.abandoned

    @abandoned.setter
    def abandoned(self, why: str) -> None:
        self._rendering.exchange.abandoned = why

    def exchange(self, index: int, at_rest: bool) -> None:
        """See ``Exchanging``."""
        if at_rest:
            self._rendering.control.exchange(index)
        else:
            self._rendering.exchange.begin(index)

    def give_up(self, why: str) -> None:
        """See ``Exchanging``."""
        self._rendering.exchange.give_up(why)
