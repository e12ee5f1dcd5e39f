"""Both stations in one process and one virtual time, with a network between them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ...runtime.configuration.config import Loaded, parse
from ...runtime.configuration.session import build
from ...runtime.errors import HapticdError
from ...runtime.live.lockstep import Lockstep
from ...sim.gateway import Exchange
from ...sim.network_model import NetworkModel
from .sections import Leads

OPERATOR = "operator"
"""The kind of a station whose person leads."""


class PairError(HapticdError):
    """Two configurations that are not both ends of a telemanipulation.

    Attributes:
        code: stable name; see docs/errors.md.
    """

    code = "pair"
    exit_status = 2


def declared(loaded: Loaded, delay: float, *more: str) -> Loaded:
    """A station whose configuration declares a longest delay of its link [s]; its text says so, too.

    Args:
        loaded: the station.
        delay: of its link [s].
        more: further lines of that table.

    Raises:
        ConfigError: no link is like that.
    """
    station = "leads" if leads_of(loaded) else station_of(loaded)
    table = re.compile(rf"^\[{station}\.link\][^\[]*", re.MULTILINE)
    text = table.sub("", loaded.text).rstrip("\n")
    text += f"\n\n[{station}.link]\n" + "\n".join([f'delay = "{delay:g} s"', *more, ""])
    return replace(loaded, config=parse(text, loaded.source), text=text)


def leads(loaded: Loaded) -> bool:
    """Whether a station is the operator's, or a machine whose twin leads."""
    return leads_of(loaded) is not None or station_of(loaded) == OPERATOR


def station_of(loaded: Loaded) -> str:
    """The kind of a machine, as its configuration says it."""
    return str(type(loaded.config).__struct_config__.tag)


def leads_of(loaded: Loaded) -> Leads | None:
    """Whom the twin of a machine leads; None where it leads nobody, or the machine is a station."""
    found: Leads | None = getattr(loaded.config, "leads", None)
    return found


def model_of(loaded: Loaded) -> str:
    """The model in which a station has the avatar's arms: its own, or that of the twin that leads."""
    if leads_of(loaded) is None:
        return loaded.model_text.strip()
    config: Any = loaded.config
    section = getattr(config, station_of(loaded))
    return str(section.twin.kept.urdf).strip()


class Pair:
    """Two lockstep sessions whose gateways speak to each other; a tick of one, then a tick of the other.

    Attributes:
        operator, avatar: the sessions.
        network: between them.
    """

    def __init__(self, operator: Loaded, avatar: Loaded, network: NetworkModel) -> None:
        """Build both.

        Raises:
            PairError: one of them simulates no station, the first does not lead or the second does, or their
                rates or models differ.
            ConfigError: see ``build``.
        """
        self.operator, self.avatar = (Lockstep(build(loaded)) for loaded in (operator, avatar))
        self.network = network
        self.dt = 1.0 / operator.config.loop.rate
        for loaded, lockstep, port in zip(
            (operator, avatar), (self.operator, self.avatar), network.ports, strict=True
        ):
            link = getattr(lockstep.plant, "link", None)
            if not isinstance(link, Exchange):
                raise PairError(f"{loaded.source} is no station of a telemanipulation")
            link.port = port
        if not leads(operator) or leads(avatar):
            said = "leads" if leads(avatar) else "follows"
            raise PairError(
                f"{operator.source} and {avatar.source} both {said}; name who leads first, then the avatar"
                if leads(operator) == leads(avatar)
                else f"{avatar.source} leads {operator.source}; name it first"
            )
        if operator.config.loop.rate != avatar.config.loop.rate:
            raise PairError(f"{operator.source} and {avatar.source} have different rates; give both the same")
        if model_of(operator) != model_of(avatar):
            raise PairError(
                f"{operator.source} and {avatar.source} have different models; give both the same"
            )

    def tick(
        self, operator: Callable[[], None] | None = None, avatar: Callable[[], None] | None = None
    ) -> None:
        """A tick of both, and of the network; each by what is given, or else by its lockstep."""
        (operator or self.operator.tick)()
        (avatar or self.avatar.tick)()
        self.network.advance(self.dt)

    def run(self, seconds: float, watch: Callable[[], None] = lambda: None) -> None:
        """Several ticks; ``watch`` is called after each."""
        for _ in range(round(seconds / self.dt)):
            self.tick()
            watch()
