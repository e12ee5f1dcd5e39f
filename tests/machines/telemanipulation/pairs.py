"""Both stations on a bench: what happens to them, and what they do."""

from __future__ import annotations

import functools
from dataclasses import replace

import msgspec
import numpy as np
from hapticd.machines.telemanipulation.pair import Pair, declared
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.config import Loaded
from hapticd.runtime.live.lockstep import unswept
from hapticd.sim.network_model import Conditions, NetworkModel
from hapticd.sim.wall import Wall, Walls

FOLLOWS_S = 6.6
"""By then both have faded in."""
Array = np.ndarray


class Both(Pair):
    """A pair that remembers what was said, and whose hands go where a test wants."""

    def __init__(self, operator: Loaded, avatar: Loaded, network: NetworkModel) -> None:
        super().__init__(operator, avatar, network)
        self.said: list[str] = []
        self.leads, self.follows = (each.plant for each in (self.operator, self.avatar))
        self.machines = tuple(each.session.cycle.machine for each in (self.operator, self.avatar))

    def go(self, seconds: float) -> None:
        """Some time passes."""
        with unswept():
            for _ in range(round(seconds / self.dt)):
                self.tick()
                for name, each in (("operator", self.operator), ("avatar", self.avatar)):
                    self.said += [f"{name}: {event}" for event in each.outputs.events]

    def reach(self, i: int, way: list[float]) -> None:
        """The hand of an arm wants to be so far from where its palm is now, from now on."""
        arm = self.leads.arms[i].arm
        hand = self.leads.hands[i]
        hand.take()
        hand.lead([x + d for x, d in zip(arm.position, way, strict=True)])
        hand._target[:] = arm.rotation

    def palms(self, i: int) -> tuple[Array, Array]:
        """Where they are, the operator's and the avatar's [m]."""
        return tuple(plant.arms[i].arm.position.copy() for plant in (self.leads, self.follows))

    def forces(self, i: int) -> tuple[float, float]:
        """Of the hand on the operator's palm, and of the wall on the avatar's [N]."""
        return tuple(float(np.linalg.norm(p.arms[i].arm.hold.wrench[:3])) for p in (self.leads, self.follows))

    def wall_ahead(self, stiffness: float, distance: float = 0.03) -> None:
        """A wall in front of the avatar's palms, and nowhere else."""
        ahead = max(self.palms(i)[1][0] for i in range(2)) + distance
        face = Wall(np.array([ahead, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0]), stiffness, 20.0)
        self.follows.walls = Walls([face])


def both(conditions: Conditions | None = None, seed: int = 1) -> Both:
    """The built-in stations with hands that stay where they are until a test moves them, and no wall."""
    network = conditions or Conditions()
    stations = [still(config.load(name)) for name in ("operator", "avatar")]
    stations = [declared(loaded, network.longest) for loaded in stations] if network.longest else stations
    return Both(*stations, NetworkModel(network, seed))


def still(loaded: Loaded) -> Loaded:
    simulation = loaded.config.simulation
    first = simulation.hand.path[0]
    path = (first, msgspec.structs.replace(first, at=type(first.at)(100.0)))
    hand = msgspec.structs.replace(simulation.hand, path=path)
    changed = {"walls": None} if hasattr(simulation, "walls") else {}
    simulation = msgspec.structs.replace(simulation, hand=hand, **changed)
    return replace(loaded, config=msgspec.structs.replace(loaded.config, simulation=simulation))


@functools.cache
def following() -> Both:
    """An avatar that follows; tests run in copies of the process and leave it as it is."""
    made = both()
    made.go(FOLLOWS_S)
    return made
