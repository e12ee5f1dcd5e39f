"""The simulated avatar: two arms whose palms may touch walls, or whose hands are in a scene."""

from __future__ import annotations

import numpy as np

from ...devices.network import Network
from ...devices.robot_hand import RobotHand
from ...models import Robot
from ...sim.base_drive import SimBaseDrive
from ...sim.fingers import Fingers, Grasped, Servo
from ...sim.hand import Grip
from ...sim.leading_hands import LeadingHands
from ...sim.neck_arm import SimNeckArm
from ...sim.robot_hand import SimRobotHand
from ...sim.scene import Scene
from ...sim.wall import Wall, Walls
from ..telemanipulation.arm import SIDES
from ..telemanipulation.plant import SimArm, StationPlant, closing, hands, nodding, treading
from ..telemanipulation.wire import arms_alike
from .config import AvatarConfig, AvatarSimulation, Thing


class AvatarPlant(StationPlant):
    """Two arms and walls; scripted hands lead them until the link gets another port.

    Attributes:
        walls: that a palm may touch.
        hands: with their fingers, left and right; none where the avatar has none.
        scene: that its hands are in instead, once they have entered one.
    """

    leads = False

    def __init__(
        self, config: AvatarConfig, simulation: AvatarSimulation, robot: Robot, network: Network
    ) -> None:
        hand = simulation.hand
        grip = Grip(
            (hand.stiffness, hand.rotational_stiffness),
            (hand.damping, hand.rotational_damping),
            (hand.force, hand.torque),
        )
        own = config.avatar.hands
        leading = LeadingHands(
            hands(simulation),
            grip,
            1.0 / config.loop.rate,
            closing(simulation) if own else None,
            (nodding(simulation), treading(simulation)) if config.avatar.body else None,
        )
        self.walls = Walls(
            [
                Wall(np.array(wall.point), np.array(wall.normal), wall.stiffness, wall.damping)
                for wall in simulation.walls or ()
            ]
        )
        self.scene: Scene | None = None
        self._chains = config.avatar.arms
        super().__init__(config.avatar, simulation, robot, network, leading)
        self.link.port = leading
        self.hands: list[tuple[SimRobotHand, Fingers]] = []
        for side in SIDES if own else ():
            drives = list(getattr(own, side).drives.values())
            lower, upper = (np.array([getattr(each, key) for each in drives]) for key in ("lower", "upper"))
            device = self.nodes[f"{side}_hand"]
            assert isinstance(device, SimRobotHand)
            self.hands.append((device, Fingers(lower, upper, Servo())))
        self._parts: list[SimNeckArm | SimBaseDrive] = [
            *self.nodes.of(SimNeckArm),
            *self.nodes.of(SimBaseDrive),
        ]
        self._things = [
            (SIDES.index(thing.side), float(thing.at), float(thing.until), self._grasped(thing))
            for thing in simulation.things or ()
        ]
        self._measure()

    def identity(self) -> dict[str, str]:
        """See ``StationPlant``."""
        found = {"arms": arms_alike(self._chains.left, self._chains.right)}
        if self.hands:
            found["hands"] = repr([list(each.device.drives) for each, _ in self.hands])
        return found

    def _grasped(self, thing: Thing) -> Grasped:
        """Where its hand's drives meet it; those that spread fingers or turn the thumb do not."""
        device, fingers = self.hands[SIDES.index(thing.side)]
        at = fingers.lower + thing.share * (fingers.upper - fingers.lower)
        return Grasped(np.where(_closing(device.device), at, np.inf), thing.stiffness)

    def _equip(self, dt: float) -> None:
        for i, (device, fingers) in enumerate(self.hands):
            held = [
                thing for side, begin, end, thing in self._things if side == i and begin <= self.time < end
            ]
            fingers.grasped = held[0] if held else None
            device.advance(fingers, dt)
        for part in self._parts:
            part.advance(dt)

    def enter(self, scene: Scene) -> None:
        """From now on the hands are in a scene, and touch what is there, and nothing else is in them.

        Their grippers are shut where the fingers that close are more than half closed, and open otherwise.
        """
        self.scene, self._things = scene, []
        for i, arm in enumerate(self.arms):
            scene.put(i, arm.arm.position, arm.arm.rotation)

    def _move(self, dt: float) -> None:
        super()._move(dt)
        if self.scene is not None:
            for i, (device, fingers) in enumerate(self.hands):
                share = (fingers.position - fingers.lower) / (fingers.upper - fingers.lower)
                self.scene.closed[i] = bool(share[_closing(device.device)].mean() > 0.5)
            self.scene.step([arm.arm.hold.wrench for arm in self.arms])

    def _touch(self, i: int, arm: SimArm) -> None:
        held = arm.arm
        if self.scene is not None:
            self.scene.hold(i, held.hold, held.position, held.rotation)
        else:
            self.walls.press(held.hold, held.position, held.twist[:3])


def _closing(hand: RobotHand) -> list[bool]:
    """Which of its drives close fingers; the others spread them or turn the thumb."""
    return [not {"spread", "opposition"} & set(name.split("_")) for name in hand.drives]


def avatar_plant(config: AvatarConfig, robot: Robot, network: Network) -> AvatarPlant:
    """The plant, at rest in its initial posture."""
    assert config.simulation is not None
    return AvatarPlant(config, config.simulation, robot, network)
