"""A simulated machine whose handle is pushed along a line with constant forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np
import pinocchio as pin

from ..configs.quantities import HandDamping, HandStiffness, Instant
from ..models import Array, Robot
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.session import build
from ..runtime.configuration.system import Pushed, System
from ..runtime.core.modes import Mode
from ..runtime.core.scene import Grip, MachineScene
from ..runtime.core.sections import Arming, Press
from ..runtime.live.lockstep import Lockstep
from ..sim.person import Lead
from .apparent import Push, UnexcitedError
from .own_plant import Doubt
from .random_hand import pressed_at
from .recorded_joints import IdentifyError

TRIALS = 10
AWAY, BEYOND = 0.05, 0.02
"""A push begins so far before the point, and ends so far behind it [m]."""
SOFT, LOOSE = 50.0, 1.0
"""Grip of the pushing hand [N/m], [N s/m]: what it adds is its aim, so that within a tick little changes."""
LEAST_FORCE, DOUBLINGS = 0.25, 9
"""Forces that are tried first: this one [N], and twice, and so on, up to the hand's strength."""
PULSE_S, MOVED = 0.15, 3e-3
"""A direction is weighed by a pulse of the first force that moves the handle so far [s], [m]."""
PASSED_S, LONGEST_S = 0.8, 2.0
"""A force that brings the handle past the point within the first is the smallest one of the trials; pushes
end after the second [s]."""
SPREAD = 4.0
"""Largest force of the trials over the smallest."""
LIGHT, HEAVY = 0.05, 50.0
"""Masses that a direction is taken to have before it is weighed, and if it does not move [kg]."""
HELD = 0.15
"""Damping of the guide, as a share of a direction's mass times the rate: so many ticks a second hold it."""
STRONGEST_DAMPING = 60.0
"""Of the guide [N s/m]: what a tense arm has."""
LEAN_S = 1.0
"""In which a resting hand takes over what the guide bears."""
RETURN, REST_S, CALM, CALM_S, RESTLESS_S = 0.1, 0.3, 5e-3, 0.2, 5.0
"""Speed of the way back [m/s]; how long it rests there; speed that counts as rest [m/s], for how long; and
when it is given up [s]."""
ASTRAY = 3e-3
"""Distance to the line's beginning at rest at which a push may begin [m]."""
LOST = 0.1
"""Distance to where the hand leads it at which the handle is not on the way any more [m]."""
STARTS_S = 10.0
"""The machine is up by then, or never."""
POSTURE_S = 2.0
"""What a machine has to turn its posture before it is pushed."""


@dataclass(frozen=True, slots=True)
class Line:
    """Through a point at (3,) [m], along a unit vector (3,)."""

    at: Array
    along: Array

    @property
    def axes(self) -> Array:
        """The direction, and two across it, (3, 3), a row each."""
        across = np.cross(self.along, np.eye(3)[np.argmin(np.abs(self.along))])
        across /= np.linalg.norm(across)
        return np.array([self.along, across, np.cross(self.along, across)])


def _held(config: Any) -> Any:
    """The machine whose handle a soft hand holds where it begins, armed by a dead-man switch."""
    simulation = config.simulation
    hand = simulation.hand
    first = [msgspec.structs.replace(hand.path[0], at=Instant(at)) for at in (0.0, 1.0)]
    changes = {"away": None} if hasattr(hand, "away") else {}
    press = Press(Instant(pressed_at(config)), True)
    hand = msgspec.structs.replace(
        hand,
        stiffness=HandStiffness(SOFT),
        damping=HandDamping(LOOSE),
        dead_man=(press,),
        path=tuple(first),
        **changes,
    )
    return msgspec.structs.replace(
        config,
        arming=Arming("dead-man", config.arming.fade),
        simulation=msgspec.structs.replace(simulation, hand=hand, touches={}),
    )


class Handle:
    """Where a machine's state has its handle, and what it measures of the hand there."""

    def __init__(self, robot: Robot, scene: MachineScene) -> None:
        self._robot, self._scene = robot, scene
        self._grip: Grip = scene.grips[0]
        self._turned = pin.exp3(np.array(self._grip.turned))

    def read(self, state: np.void) -> tuple[Array, Array]:
        """Position (3,) [m], and force of the hand (3,) [N], in the base frame."""
        placement = self._robot.placement(np.array(self._scene.posture(state)), self._grip.frame)
        force = np.array(self._scene.wrench(state)[:3])
        if self._grip.own_axes:
            force = placement[:3, :3] @ self._turned @ force
        return placement[:3, 3] + placement[:3, :3] @ np.array(self._grip.offset), force


def handle_of(robot: Robot, system: System[Any], config: Any) -> Handle:
    """Of a machine.

    Raises:
        IdentifyError: hands hold it at several places, or at none that is known.
    """
    scene = system.scene(config) if system.scene else None
    count = len(scene.grips) if scene else 0
    if scene is None or count != 1:
        raise IdentifyError(f"the machine has {count} handles; inertia and friction are told of one")
    return Handle(robot, scene)


class Pusher:
    """A hand that leads a handle to the beginning of a line, and pushes it along."""

    def __init__(self, loaded: Loaded, pushed: Pushed[Any], doubt: Doubt, seed: int) -> None:
        """Start the machine, with the handle held where it begins.

        Raises:
            ConfigError: the configuration does not fit together.
            IdentifyError: it does not start, stops, or has not one handle.
        """
        if loaded.config.simulation is None:
            raise IdentifyError("the configuration has no [simulation]; only a simulated machine is pushed")
        if not doubt.fits(loaded.config):
            raise IdentifyError("--wrong-model: this kind of machine has no other model to be simulated with")
        config: Any = doubt.vary(_held(loaded.config), seed)
        self._lockstep = lockstep = Lockstep(build(replace(loaded, config=config), controller=pushed.machine))
        session = lockstep.session
        self._machine, self.rate = session.cycle.machine, session.config.loop.rate
        self._handle = handle_of(session.robot, session.system, session.config)
        self._strongest = 0.5 * float(config.simulation.hand.force)
        record = np.zeros(1, self._machine.state)
        self._machine.bind_state(record)
        self._state = record[0]
        self._axes, self._masses, self._lean = np.eye(3), np.full(3, LIGHT), np.zeros(3)
        self._start()
        self.position, self.force = self._seen()
        self._velocity = np.zeros(3)
        self._aim = self.position.copy()

    def _start(self) -> None:
        lockstep = self._lockstep
        for _ in range(round((STARTS_S + lockstep.session.config.arming.fade) * self.rate)):
            lockstep.tick()
            self._going_on()
            if lockstep.mode is Mode.ACTIVE:
                return
        raise IdentifyError(f"the machine did not start; it is {lockstep.mode.name}")

    def trials(self, line: Line, progress: Callable[[float], None]) -> list[Push]:
        """Pushes along a line, both ways, with forces from small to large.

        Raises:
            IdentifyError: the machine stopped.
            UnexcitedError: the hand is too weak, or the handle does not come to rest.
        """
        for _ in range(round(POSTURE_S * self.rate)):
            self._tick()
        self._axes, self._masses = line.axes, np.full(3, LIGHT)
        self._masses = np.array([self._weigh(axis) for axis in self._axes])
        least = self._least_force(line)
        forces = np.linspace(least, min(SPREAD * least, self._strongest), TRIALS)
        pushes = []
        for k, force in enumerate(forces.tolist()):
            for way in (1.0, -1.0):
                self._go_back(line, way)
                pushes.append(self._push(line, way * force, LONGEST_S))
            progress((k + 1) / TRIALS)
        return pushes

    def _weigh(self, axis: Array) -> float:
        """About the mass that a pulse along an axis moves [kg]."""
        for force in self._tried:
            self._rest()
            begin = self.position
            for k in range(round(PULSE_S * self.rate)):
                self._press(force * axis)
                way = float((self.position - begin) @ axis)
                if way > MOVED:
                    return 0.5 * force * ((k + 1) / self.rate) ** 2 / way
            self._aim[:] = begin
        return HEAVY

    @property
    def _tried(self) -> list[float]:
        forces = [LEAST_FORCE * 2.0**k for k in range(DOUBLINGS)]
        return [force for force in forces if force <= self._strongest] or [self._strongest]

    def _least_force(self, line: Line) -> float:
        """The smallest one that moves the handle past the point in time."""
        farthest = 0.0
        for force in self._tried:
            self._go_back(line, 1.0)
            end = float(self._push(line, force, PASSED_S).along[-1])
            farthest = max(farthest, end + AWAY)
            if end > BEYOND:
                return force
        raise UnexcitedError(
            f"{force:.3g} N move the handle by {1e3 * farthest:.1f} mm in {PASSED_S:g} s and not past the"
            " point; it resists there, or the hand is too weak"
        )

    def _push(self, line: Line, force: float, seconds: float) -> Push:
        """From rest, until the handle is past the point or time is over."""
        places, seen = [], []
        for _ in range(round(seconds * self.rate)):
            guide = self._lean + self._guide(line.at)
            self._press(guide - (guide @ line.along) * line.along + force * line.along)
            places.append(line.axes @ (self.position - line.at))
            seen.append(float(self.force @ line.along))
            if np.sign(force) * places[-1][0] > BEYOND:
                break
        rows = np.array(places)
        return Push(rows[:, 0], rows[:, 1:], np.array(seen))

    def _go_back(self, line: Line, way: float) -> None:
        """To where a push one way or the other begins, and to rest there."""
        begin, first = line.at - way * AWAY * line.along, self._aim.copy()
        ticks = max(1, round(float(np.linalg.norm(begin - first)) / RETURN * self.rate))
        for k in range(ticks):
            self._aim[:] = first + (k + 1) / ticks * (begin - first)
            self._tick()
            if np.linalg.norm(self.position - self._aim) > LOST:
                left, here = np.linalg.norm(self.position - begin), self.position.round(3).tolist()
                raise UnexcitedError(
                    f"the handle cannot be led to where the line begins: {1e3 * left:.0f} mm before it, at"
                    f" {' '.join(map(str, here))} m, it stays behind; choose a place in reach"
                )
        self._rest()
        away = float(np.linalg.norm(self.position - begin))
        if away > ASTRAY:
            raise UnexcitedError(
                f"the handle stays {1e3 * away:.0f} mm beside where the line begins; it does not come to rest"
                " there, or something holds it: choose another place, or direction"
            )

    def _rest(self) -> None:
        """Hold the handle until it is calm where it shall be."""
        calm = 0
        for k in range(round(RESTLESS_S * self.rate)):
            self._tick()
            self._lean += self._guide(self._aim) / (LEAN_S * self.rate)
            away = np.linalg.norm(self.position - self._aim)
            calm = calm + 1 if np.linalg.norm(self._velocity) < CALM and away < ASTRAY else 0
            if k > REST_S * self.rate and calm > CALM_S * self.rate:
                return

    def _guide(self, aim: Array) -> Array:
        """Force to a place: of each direction as stiff and damped as a hand of so many ticks a second can."""
        damping = np.minimum(HELD * self._masses * self.rate, STRONGEST_DAMPING)
        stiffness = damping**2 / (2.0 * self._masses)
        pull = stiffness * (self._axes @ (aim - self.position)) - damping * (self._axes @ self._velocity)
        force: Array = pull @ self._axes
        return force

    def _tick(self) -> None:
        """One more tick of leading the handle to where the hand aims."""
        aim = self._aim.copy()
        self._press(self._lean + self._guide(aim))
        self._aim[:] = aim

    def _press(self, force: Array) -> None:
        """One tick with a force (3,) of the hand; it aims at where the handle is then."""
        ahead = self._velocity / (2.0 * self.rate)  # in the middle of the tick the force is what it should be
        place = self.position + ahead + (force + LOOSE * self._velocity) / SOFT
        self._lockstep.plant.obey(Lead(tuple(place.tolist())))
        before = self.position
        self._lockstep.tick()
        self._going_on()
        self.position, self.force = self._seen()
        self._velocity = self.rate * (self.position - before)
        self._aim[:] = self.position

    def _seen(self) -> tuple[Array, Array]:
        self._machine.fill()
        return self._handle.read(self._state)

    def _going_on(self) -> None:
        if self._lockstep.mode in (Mode.STOPPING, Mode.HOLDING, Mode.STOPPED, Mode.FAILED):
            said = [str(event) for event in self._lockstep.outputs.events] or [self._lockstep.mode.name]
            raise IdentifyError(f"the machine stopped: {'; '.join(said)}")
