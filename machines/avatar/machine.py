"""The avatar between process image and gate: it follows the operator's palms, and tells what it feels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from ...control.avatar_law import AvatarLaw
from ...control.avatar_law import Impedance as Gains
from ...control.lease import Granted
from ...control.link_passivity import AvatarPort
from ...control.notice import Notice
from ...devices.image import ProcessImage
from ...devices.remote import BEHIND, ENGAGED, STOPPED, TOLD, WAITING, packed, unpacked
from ...devices.remote_operator import RemoteOperators
from ...models import Array, Robot
from ...runtime.core.stages import Mark
from ..telemanipulation.arm import SIDES, StationArm
from ..telemanipulation.station import Station, sane_pose
from .body import AvatarBody
from .config import Avatar, AvatarConfig
from .hand import AvatarHand

PULLS = 2.0
"""Most force of the impedance, as a multiple of the one at the palm that stops the arm: it damps what moves
fast, and a forearm that presses on somebody is felt by no sensor."""
EVERY = 4
"""Ticks between what hands, neck and base are told: gloves and trackers measure no faster."""
DRIFTS, QUIET_S = 5e-3, 0.5
"""How far the link may lead a palm from where it is wanted before people are told [m], [s]."""


def state_layout(n: int, drives: int) -> np.dtype[np.void]:
    """What the log keeps of a tick: both arms of n joints side by side, and all drives of both hands."""
    arms = len(SIDES)
    return np.dtype(
        [
            ("q", "<f8", (arms, n)),
            ("position", "<f8", (arms, 3)),  # of the palms [m]
            ("goal", "<f8", (arms, 3)),  # of the impedances [m]
            ("commanded", "<f8", (arms, 3)),  # as heard last [m]
            ("error", "<f8", (arms, 6)),  # palm less goal [m, rad]
            ("wrench", "<f8", (arms, 6)),  # of the world on the palms, in their axes [N, N m]
            ("limits", "<f8", (arms, n)),  # torques that keep joints from their limits [N m]
            ("torque", "<f8", (arms, n)),  # of the laws [N m]
            ("share", "<f8", arms),  # of the way to the commanded pose
            ("age", "<f8", arms),  # of what was heard [s]
            ("tank", "<f8", arms),  # energy that the link may give out [J]
            ("taken", "<f8", arms),  # by its passivity, so far [J]
            ("drift", "<f8", (arms, 6)),  # commanded pose less the reference [m, rad]
            ("standing", "u1", arms),  # order of `control.lease.Standing`
            ("stopped", "u1", arms),
            ("fingers", "<f8", drives),  # where they are to be, left hand first [rad]
            ("currents", "<f8", drives),  # of their motors [A]
            ("neck", "<f8", 6),  # where the head is to be, from its middle [m, rad]
            ("base", "<f8", 3),  # speed that it is to have [m/s, rad/s]
            ("grasping", "u1", arms),  # drives of each hand that hold something
        ]
    )


def impedance(section: Avatar) -> Gains:
    """From the palm to where it is to be; its springs never pull harder than is bearable."""
    k = section.impedance
    return Gains(
        k.stiffness,
        k.rotational_stiffness,
        k.damping,
        k.rotational_damping,
        k.fade,
        most_pull=PULLS * section.stop.force,
        most_turn=PULLS * section.stop.torque,
    )


class AvatarStation(Station):
    """See ``Machine``."""

    def __init__(self, config: AvatarConfig, robot: Robot, image: ProcessImage, mark: Mark) -> None:
        section = config.avatar
        super().__init__(config, section, robot, image, mark)
        gains = impedance(section)
        self._laws = [AvatarLaw(arm.task, arm.avoidance, gains, self._dt) for arm in self.arms]
        self._ports = [
            AvatarPort(arm.task.palm.rotation, arm.task.twist, arm.force.wrench, gains, self._dt)
            for arm in self.arms
        ]
        self._granted = [Granted() for _ in self.arms]
        self._followed = [False] * len(self.arms)
        self._led = [False] * len(self.arms)  # since the daemon began
        self._passive = section.link.passivity
        quiet = round(QUIET_S / self._dt)
        self._damped = [Notice(DRIFTS, 0.5 * DRIFTS, quiet) for _ in self.arms]
        self._energy = image["remote.own_energy"]
        self._remote = RemoteOperators(image)
        self._wrench, self._joints = image["remote.wrench"], image["remote.joints"]
        self._acts = [0] * len(self.arms)
        own = section.hands
        self.hands = (
            [AvatarHand(side, getattr(own, side), image, EVERY * self._dt) for side in SIDES] if own else []
        )
        slow = EVERY * self._dt
        self.body = (
            AvatarBody(section.body, section.link.delay, image, self._dt, slow) if section.body else None
        )
        drives = [hand.equipment for hand in self.hands]
        self.equipment = (*drives, *(self.body.equipment if self.body else ()))
        counts = [len(each.points) for each in drives]
        self.wanted = np.zeros(sum(counts) + (len(self.body.wanted) if self.body else 0))
        *self._fingers, self._rest = np.split(self.wanted, np.cumsum(counts, dtype=int))
        self._tick = 0
        self.state = state_layout(self.arms[0].n, sum(counts))

    def _hear(self) -> None:
        remote = self._remote
        poses, ages, words = remote.pose.tolist(), remote.age.tolist(), remote.flags.tolist()
        for i, lease in enumerate(self.leases):
            flags, act = unpacked(words[i])
            valid = sane_pose(poses[i])
            lease.update(ages[i], valid, bool(flags & ENGAGED), act, bool(flags & TOLD))
            if act != self._acts[i] and lease.follows:
                self._acts[i] = act
                self.restart(i)
            if lease.follows:
                port = self._ports[i]
                port.position[:] = poses[i][:3]
                x, y, z, w = poses[i][3:]
                port.rotation[:] = pin.Quaternion(w, x, y, z).normalized().matrix()

    def _say(self) -> None:
        words = self._remote.own_flags
        for i, (arm, lease) in enumerate(zip(self.arms, self.leases, strict=True)):
            self._wrench[i], self._joints[i, : arm.n] = arm.force.wrench, arm.task.q
            flags = STOPPED if arm.stopped else 0
            flags |= ENGAGED if self._engaged and self._laws[i].share > 0.0 else 0
            flags |= 0 if lease.follows else WAITING
            flags |= BEHIND if lease.follows and self._damped[i].on else 0
            self._energy[i] = self._ports[i].sent
            words[i] = packed(flags, self._acts[i])
        for hand in self.hands:
            hand.say()
        if self.body is not None:
            self.body.hear()
            self.body.say()

    def engage(self) -> None:
        """See ``Machine``."""
        super().engage()
        for arm, law in zip(self.arms, self._laws, strict=True):
            law.goal[:] = arm.task.palm.position
        for hand, wanted in zip(self.hands, self._fingers, strict=True):
            hand.engage()
            wanted[:] = hand.law.target
        if self.body is not None:
            self.body.engage()
            self._rest[:] = self.body.wanted

    def update(self, gain: float, trust: float) -> None:
        """See ``Machine``."""
        super().update(gain, trust)
        self._lead_on(gain == 1.0)

    def _lead_on(self, permitted: bool) -> None:
        """Hands, neck and base, whose own controllers are slower than the tick."""
        self._tick = (self._tick + 1) % EVERY
        if self._tick:
            return
        for i, hand in enumerate(self.hands):
            moves = permitted and self._followed[i] and not self.arms[i].stopped
            share = self._laws[i].share if moves else 0.0
            if news := hand.update(share, self._most_age):
                self.notes.append(news)
            self._fingers[i][:] = hand.law.target
        if self.body is not None:
            self.body.update(permitted, not any(arm.stopped for arm in self.arms))
            self._rest[:] = self.body.wanted

    def brake(self, dropped: Sequence[bool]) -> bool:
        """See ``Machine``; hands keep what they hold as long as they have power, the base comes to rest."""
        self._lead_on(False)
        return super().brake(dropped)

    def _begin(self) -> None:
        """Started again here: the operator must act anew, too."""
        for i, law in enumerate(self._laws):
            law.reset()
            if self._led[i]:
                self.leases[i].bar(told=False)
        if self.body is not None:
            self.body.restart()

    def _stop(self, i: int) -> None:
        self.leases[i].bar(told=False)
        self._followed[i] = False

    def restart(self, i: int) -> None:
        """See ``Station``; it holds its pose, and fades in from there."""
        if self.arms[i].stopped:
            self._laws[i].reset()
        super().restart(i)

    def _move(self, i: int, arm: StationArm, gain: float, trust: float) -> None:
        law = self._laws[i]
        follows = self.leases[i].follows and gain == 1.0
        if follows:
            self._lead(i, law)
        self._followed[i] = follows
        self._led[i] |= follows
        law.update(follows)
        arm.move(law.torque, 1.0 - gain)

    def _lead(self, i: int, law: AvatarLaw) -> None:
        """Where the law is to go: the commanded pose, as far as the energy of the link allows."""
        port, granted = self._ports[i], self._granted[i]
        if not self._passive:
            law.commanded[:], law.commanded_rotation[:] = port.position, port.rotation
            return
        if not self._followed[i]:
            port.reset()
            granted.begin()
        port.update(granted.update(float(self._remote.energy[i])))
        law.commanded[:], law.commanded_rotation[:] = port.reference, port.reference_rotation
        if self._damped[i].update(float(np.abs(port.drift[:3]).max())):
            self.notes.append(f"{self.arms[i].side} arm: the link's energy is used up; it stays behind")

    def _numbers(self) -> Sequence[Sequence[Array]]:
        arms, laws = self.arms, self._laws
        return (
            [arm.task.q for arm in arms],
            [arm.task.palm.position for arm in arms],
            [law.goal for law in laws],
            [law.commanded for law in laws],
            [law.error for law in laws],
            [arm.force.wrench for arm in arms],
            [arm.avoidance.torque for arm in arms],
            [law.torque for law in laws],
        )

    def fill(self) -> None:
        """See ``state_layout``."""
        self._copy_numbers()
        logged = self._logged
        for i, (arm, law, lease) in enumerate(zip(self.arms, self._laws, self.leases, strict=True)):
            logged["share"][i], logged["age"][i] = law.share, self._remote.age[i]
            port = self._ports[i]
            logged["tank"][i], logged["taken"][i], logged["drift"][i] = port.level, port.taken, port.drift
            logged["standing"][i] = lease.number
            logged["stopped"][i] = bool(arm.stopped)
        if self.hands:
            np.concatenate(self._fingers, out=logged["fingers"])
            np.concatenate([hand.current for hand in self.hands], out=logged["currents"])
            logged["grasping"][:] = [hand.grasping for hand in self.hands]
        if self.body is not None:
            logged["neck"][:], logged["base"][:] = self._rest[:6], self._rest[6:]
