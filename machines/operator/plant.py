"""The simulated operator station: two arms, and the hands of a person at their palms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...devices.network import Network
from ...devices.sense_glove import FINGERS
from ...models import Robot
from ...sim.buttons import ButtonScript, SimButtons
from ...sim.fingers import GlovedFingers
from ...sim.foot_paddle import SimFootPaddle
from ...sim.hand import Course, Grip, Hand, turned
from ...sim.head_tracker import SimHeadTracker
from ...sim.sense_glove import SimSenseGlove
from ..telemanipulation.plant import Closes, SimArm, StationPlant, closing, hands, nodding, treading
from ..telemanipulation.wire import arms_alike
from .config import OperatorConfig, OperatorSimulation

LEFT, RIGHT = 1, 2
"""Buttons of the arms."""


class BothHands:
    """The hands of one person, who pushes with both."""

    def __init__(self, hands: Sequence[Hand]) -> None:
        self._hands = hands

    def take(self) -> None:
        """See ``hapticd.sim.plant.Operator``."""
        for hand in self._hands:
            hand.take()

    def push(self, direction: Sequence[float]) -> None:
        """See ``hapticd.sim.plant.Operator``."""
        for hand in self._hands:
            hand.push(direction)

    def lead(self, place: Sequence[float]) -> None:
        """See ``hapticd.sim.plant.Operator``; the middle between the handles is to be there."""
        handles = np.array([hand.handle for hand in self._hands])
        for hand, where in zip(self._hands, handles - handles.mean(axis=0) + place, strict=True):
            hand.lead(where.tolist())


class OperatorPlant(StationPlant):
    """Two arms whose palms are in hands.

    Attributes:
        hands: left and right.
        gloves: with the fingers in them, left and right.
    """

    leads = True

    def __init__(
        self, config: OperatorConfig, simulation: OperatorSimulation, robot: Robot, network: Network
    ) -> None:
        own = simulation.hand
        grip = Grip(
            (own.stiffness, own.rotational_stiffness),
            (own.damping, own.rotational_damping),
            (own.force, own.torque),
        )
        self.hands = [Hand(way, grip, turned(np.eye(3))) for way in hands(simulation)]
        super().__init__(config.operator, simulation, robot, network, BothHands(self.hands))
        self._avatar, self._far = config.operator.avatar, config.operator.gloves
        self._closing: Closes = closing(simulation)
        self._nodding, self._treading = nodding(simulation), treading(simulation)
        self._trackers, self._paddles = self.nodes.of(SimHeadTracker), self.nodes.of(SimFootPaddle)
        self.gloves = [(glove, GlovedFingers()) for glove in self.nodes.of(SimSenseGlove)]
        (buttons,) = self.nodes.of(SimButtons)
        presses = [
            (LEFT * push.left + RIGHT * push.right, float(push.at), float(push.until))
            for push in simulation.buttons or ()
        ]
        self._buttons = ButtonScript(buttons, presses)
        self._measure()

    def identity(self) -> dict[str, str]:
        """See ``StationPlant``."""
        found = {"arms": arms_alike(self._avatar.left, self._avatar.right)} if self._avatar else {}
        if self._far:
            found["hands"] = repr([list(self._far.left), list(self._far.right)])
        return found

    def follow(self, courses: Sequence[Course], closing: Closes) -> None:
        """The hands go other ways from now on, and close otherwise."""
        self._closing = closing
        for hand, course in zip(self.hands, courses, strict=True):
            hand.follow(course)

    def _touch(self, i: int, arm: SimArm) -> None:
        held = arm.arm
        self.hands[i].aim(held.hold, self.time, held.position, held.rotation)

    def _equip(self, dt: float) -> None:
        for (glove, fingers), closed in zip(self.gloves, self._closing.at(self.time), strict=False):
            glove.advance(fingers, [closed] * len(FINGERS), dt)
        for tracker in self._trackers:
            *place, x, y, z = self._nodding.at(self.time)
            tracker.see(place, (x, y, z))
        for paddle in self._paddles:
            paddle.axes = self._treading.at(self.time)

    def _sense(self) -> None:
        self._buttons.advance(self.time)
        super()._sense()


def operator_plant(config: OperatorConfig, robot: Robot, network: Network) -> OperatorPlant:
    """The plant, at rest in its initial posture."""
    assert config.simulation is not None
    return OperatorPlant(config, config.simulation, robot, network)
