"""What devices and simulation of a configuration must fulfil, on every machine."""

from __future__ import annotations

from itertools import pairwise
from math import dist

from .sections import Config, JointDrive, SimulatedBus

Found = list[tuple[str, str, str]]
TURNS = 2.0
"""That an encoder must be able to count to: no joint turns further from its zero than one."""
COARSEST = 1000
"""Counts a turn at the joint: a controller differentiates them."""
FASTEST_HAND = 10.0
"""A boxer's fist [m/s]."""


def check_encoders(config: Config) -> Found:
    """Motor encoders whose counts, seen from the joint, are too few, or leave the 32 bits of 6064h."""
    found = []
    for name, device in config.devices.items():
        if isinstance(device, JointDrive):
            motor, joint = device.gear_ratio
            counts = device.counts_per_turn * motor / joint
            if TURNS * counts >= 2**31:
                problem = f"{counts:g} counts a turn of the joint leave 32 bits within {TURNS:g} turns"
                found.append((f"devices.{name}.counts_per_turn", problem, "lower it, or the gear ratio"))
            for key, have in (
                ("counts_per_turn", counts),
                ("link_counts_per_turn", device.link_counts_per_turn),
            ):
                if have < COARSEST:
                    problem = f"{have:g} counts a turn of the joint"
                    found.append((f"devices.{name}.{key}", problem, f"give {COARSEST} or more"))
    return found


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
