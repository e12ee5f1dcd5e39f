"""What devices and simulation of a configuration must fulfil, on every machine."""

from __future__ import annotations

from itertools import pairwise
from math import dist

from ..core.sections import Config, SimulatedBus

Found = list[tuple[str, str, str]]
FASTEST_HAND = 10.0
"""A boxer's fist [m/s]."""


def check_devices(config: Config) -> Found:
    """What each kind of device knows to be wrong with its table."""
    return [
        (f"devices.{name}.{key}", problem, fix)
        for name, device in config.devices.items()
        for key, problem, fix in device.check()
    ]


def check_simulation(config: Config) -> Found:
    """A simulated bus with nothing to simulate."""
    if config.simulation is not None or not isinstance(config.bus, SimulatedBus):
        return []
    return [("simulation", "is missing", "a simulated bus needs this section")]


def check_hand_speed(config: Config) -> Found:
    """A hand that moves faster than any hand."""
    if config.simulation is None:
        return []
    for i, (a, b) in enumerate(pairwise(config.simulation.hand.path)):
        way, time = dist(a.position, b.position), b.at - a.at
        if time > 0.0 and way > FASTEST_HAND * time:
            problem = f"{way:g} m in {time:g} s"
            return [(f"simulation.hand.path[{i + 1}]", problem, f"at most {FASTEST_HAND:g} m/s")]
    return []
