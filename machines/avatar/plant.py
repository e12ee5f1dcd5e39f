"""The simulated avatar: two arms whose palms may touch walls."""

from __future__ import annotations

import numpy as np

from ...devices.network import Network
from ...models import Robot
from ...sim.hand import Grip
from ...sim.leading_hands import LeadingHands
from ...sim.wall import Wall, Walls
from ..telemanipulation.plant import SimArm, StationPlant, hands
from ..telemanipulation.wire import arms_alike
from .config import AvatarConfig, AvatarSimulation


class AvatarPlant(StationPlant):
    """Two arms and walls; scripted hands lead them until the link gets another port.

    Attributes:
        walls: that a palm may touch.
    """

    leads = False

    def __init__(
        self, config: AvatarConfig, simulation: AvatarSimulation, robot: Robot, network: Network
    ) -> None:
        own = simulation.hand
        grip = Grip(
            (own.stiffness, own.rotational_stiffness),
            (own.damping, own.rotational_damping),
            (own.force, own.torque),
        )
        leading = LeadingHands(hands(simulation), grip, 1.0 / config.loop.rate)
        self.walls = Walls(
            [
                Wall(np.array(wall.point), np.array(wall.normal), wall.stiffness, wall.damping)
                for wall in simulation.walls or ()
            ]
        )
        self._chains = config.avatar.arms
        super().__init__(config.avatar, simulation, robot, network, leading)
        self.link.port = leading
        self._measure()

    def identity(self) -> dict[str, str]:
        """See ``StationPlant``."""
        return {"arms": arms_alike(self._chains.left, self._chains.right)}

    def _touch(self, i: int, arm: SimArm) -> None:
        held = arm.arm
        self.walls.press(held.hold, held.position, held.twist[:3])


def avatar_plant(config: AvatarConfig, robot: Robot, network: Network) -> AvatarPlant:
    """The plant, at rest in its initial posture."""
    assert config.simulation is not None
    return AvatarPlant(config, config.simulation, robot, network)
