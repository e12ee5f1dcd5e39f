"""The operator station between process image and gate: weightless arms lead, and give back what is felt."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...control.avatar_model import AvatarModel
from ...control.clutch import Clutch
from ...control.cue import AVATAR_LIMIT, ENERGY, LIMIT, QUIET, UNLED, Cue
from ...control.cue import STOPPED as STOPPED_THERE
from ...control.lease import ENDS_S
from ...control.limit_avoidance import LOWER, SPEED, LimitAvoidance
from ...control.notice import Notice
from ...control.operator_law import OperatorLaw
from ...control.task_arm import Posture
from ...devices.buttons import ButtonRows
from ...devices.image import ProcessImage
from ...devices.remote import ACTS, CLUTCHED, ENGAGED, STOPPED, TOLD, packed
from ...devices.remote_avatar import RemoteAvatars
from ...models import Array, ModelError, Robot
from ...runtime.core.stages import Mark
from ..telemanipulation.arm import PALM, SIDES, StationArm, chain_of, quaternion
from ..telemanipulation.far_arm import QUIET_S, FarArm, push
from ..telemanipulation.sections import Chain
from ..telemanipulation.station import Station
from .body import OperatorBody
from .config import Foreseen, OperatorConfig
from .glove import OperatorGlove

PUSHES, FADED = 1.0, 0.3
"""Torque that is worth a word, and that is none any more [N m]."""
MOST_PUSH = 25.0, 1.5
"""Of what keeps the avatar from its limits [N, N m]. Without a bound a limit of speed that is foreseen throws
a wrist to and fro faster than its own limit (experiments/strange_pair.py, seed 3)."""
CUE_AXIS = 0
"""Of a palm, along which cues vibrate: forward, where hands push."""
WHOLE = {ENERGY: 10.0, LIMIT: 10.0, AVATAR_LIMIT: 10.0, UNLED: ENDS_S, STOPPED_THERE: 1.0}
"""How much of each cause is announced with the whole force [N s/m, N m, N m, s, 1]."""


def state_layout(n: int) -> np.dtype[np.void]:
    """What the log keeps of a tick, both arms side by side."""
    arms = len(SIDES)
    return np.dtype(
        [
            ("q", "<f8", (arms, n)),
            ("position", "<f8", (arms, 3)),  # of the palms [m]
            ("goal", "<f8", (arms, 3)),  # of the avatar's palms [m]
            ("hand", "<f8", (arms, 6)),  # wrench of the operator on the palms, in their axes [N, N m]
            ("felt", "<f8", (arms, 6)),  # of the avatar's world, as it is given back
            ("alpha", "<f8", (arms, n)),  # shares of the command that are left
            ("own_limits", "<f8", (arms, n)),  # torques that keep joints from their limits [N m]
            ("avatar_limits", "<f8", (arms, n)),  # that keep the avatar's from theirs
            ("torque", "<f8", (arms, n)),  # of the laws [N m]
            ("share", "<f8", arms),  # of what the avatar feels
            ("age", "<f8", arms),  # of what was heard [s]
            ("tank", "<f8", arms),  # energy that the link may give out [J]
            ("taken", "<f8", arms),  # by its passivity, so far [J]
            ("damping", "<f8", arms),  # by it [N s/m]
            ("act", "u1", arms),
            ("standing", "u1", arms),  # order of `control.lease.Standing`
            ("stopped", "u1", arms),
            ("clutched", "u1", arms),
            ("foreseen", "<f8", (arms, 7)),  # joints of the avatar [rad]
            ("near", "u1", (arms, n)),  # bits of `control.limit_avoidance`
            ("head", "<f8", 7),  # of the operator [m]
            ("paddle", "<f8", 3),  # shares of its way
            ("brakes", "u1", arms),  # of the gloves, a bit a finger from the thumb on
            ("cause", "u1", arms),  # what intervenes, of those of `control.cue` the most urgent
            ("amount", "<f8", arms),  # how much [N s/m, N m, N m, s, -]
            ("announced", "u1", arms),  # what the hand is being told
            ("cue", "<f8", arms),  # with what force [N]; in `torque`, too
        ]
    )


def _model(avatar: Foreseen | None, side: str, robot: Robot, dt: float) -> tuple[AvatarModel | None, str]:
    """What this station foresees of an arm of the avatar, or why it foresees nothing."""
    if avatar is None:
        return None, "operator.avatar says nothing about it"
    chain: Chain = getattr(avatar, side)
    arm = chain_of(robot, chain)
    arm.lower, arm.upper, arm.velocity = (
        np.array(x, float) for x in (chain.lower, chain.upper, chain.velocity)
    )
    posture = Posture(np.array(chain.home), avatar.posture.stiffness, avatar.posture.damping)
    try:
        return AvatarModel(arm, PALM, posture, avatar.lag, dt), ""
    except ModelError as error:
        return None, f"{error.problem}; {error.fix}"


def _pushed(whose: str, torques: Sequence[float], limits: LimitAvoidance) -> str:
    """Which joint is pushed away from which limit, and how hard."""
    joint = torques.index(max(torques))
    near = int(limits.near[joint])
    what = "largest speed" if near & SPEED else "lower limit" if near & LOWER else "upper limit"
    return f"{whose}: joint {joint + 1} is pushed away from its {what}"


class OperatorStation(Station):
    """See ``Machine``."""

    def __init__(self, config: OperatorConfig, robot: Robot, image: ProcessImage, mark: Mark) -> None:
        section = config.operator
        super().__init__(config, section, robot, image, mark)
        arms = self.arms
        self._remote, self._buttons = RemoteAvatars(image), ButtonRows(image)
        self._pose, self._twist = image["remote.pose"], image["remote.twist"]
        self._hand, self._felt_there = np.zeros((len(arms), 6)), np.zeros((len(arms), 6))
        self._limits = np.zeros((len(arms), 6))
        self._laws = [
            OperatorLaw(
                arm.task, arm.avoidance, self._hand[i], self._felt_there[i], self._limits[i], section.assist
            )
            for i, arm in enumerate(arms)
        ]
        self._clutches = [Clutch(section.scale) for _ in arms]
        most = float(section.stop.force), float(section.stop.torque)
        self.far = [
            FarArm(
                *(arm.side, lease, self._remote, i, (arm.task.palm.rotation, arm.task.twist)),
                *(self._felt_there[i], most, section.feedback, section.link.passivity, self._dt),
            )
            for i, (arm, lease) in enumerate(zip(arms, self.leases, strict=True))
        ]
        self._energy = image["remote.own_energy"]
        models = [_model(section.avatar, side, robot, self._dt) for side in SIDES]
        self._models = [model for model, _ in models]
        self._unforeseen = [why for _, why in models]
        quiet = round(QUIET_S / self._dt)
        self._notices = [(Notice(PUSHES, FADED, quiet), Notice(PUSHES, FADED, quiet)) for _ in arms]
        self._cues = [Cue(section.cue.force, self._dt) for _ in arms]
        self._causes, self._amounts = [QUIET] * len(arms), [0.0] * len(arms)
        self._pushed = [[0.0, 0.0] for _ in arms]  # by limits, the own ones and those there
        self._led = [False] * len(arms)
        self._scale = section.scale
        self._acts, self._pressed = [0] * len(arms), 0
        far = section.gloves
        self.gloves = (
            [OperatorGlove(i, getattr(far, side), image, self._dt) for i, side in enumerate(SIDES)]
            if far
            else []
        )
        self.body = OperatorBody(image) if section.body else None
        self._pressed_starts = 0
        self.state = state_layout(arms[0].n)

    def _hear(self) -> None:
        self._press(int(self._buttons.pressed[0]))
        for far, act in zip(self.far, self._acts, strict=True):
            if far.hear(act):
                self.notes.append(
                    f"{far.name} avatar arm stopped itself: press the {far.name} button to start it again"
                    if far.stopped
                    else f"{far.name} avatar arm goes on"
                )

    def _press(self, pressed: int) -> None:
        """A button opens the clutch of its arm while it is pressed; to let go of it is an act."""
        for i, arm in enumerate(self.arms):
            bit = 1 << i
            if self._pressed & bit and not pressed & bit:
                self._acts[i] = (self._acts[i] + 1) % ACTS
                self.restart(i)
            if (self._pressed ^ pressed) & bit:
                self.notes.append(f"{arm.side} arm {'moves alone' if pressed & bit else 'leads again'}")
        self._pressed = pressed

    def _say(self) -> None:
        words = self._remote.own_flags
        for i, (arm, clutch) in enumerate(zip(self.arms, self._clutches, strict=True)):
            pose, twist = self._pose[i], self._twist[i]
            pose[:3], pose[3:] = clutch.position, quaternion(clutch.rotation)
            twist[:] = 0.0 if clutch.open else arm.task.twist
            twist[:3] *= self._scale
            flags = STOPPED if arm.stopped else ENGAGED if self._engaged else 0
            self._energy[i] = self.far[i].port.sent
            flags |= TOLD if self.far[i].waits else 0
            words[i] = packed(flags | (CLUTCHED if clutch.open else 0), self._acts[i])
        for glove, arm in zip(self.gloves, self.arms, strict=False):
            glove.say(self._engaged and not arm.stopped)
        if self.body is not None:
            self.body.say(self._engaged, self._pressed_starts)

    def update(self, gain: float, trust: float) -> None:
        """See ``Machine``."""
        super().update(gain, trust)
        for i, glove in enumerate(self.gloves):
            glove.update(self.leases[i].follows and not self.arms[i].stopped, self._most_age)

    def brake(self, dropped: Sequence[bool]) -> bool:
        """See ``Machine``; no finger is held in a stop."""
        for glove in self.gloves:
            glove.release()
        return super().brake(dropped)

    def _begin(self) -> None:
        for arm, why in zip(self.arms, self._unforeseen, strict=True):
            if why:
                self.notes.append(f"{arm.side} avatar arm: its limits are not foreseen: {why}")
        self._pressed_starts = (self._pressed_starts + 1) % ACTS
        for i, (arm, clutch) in enumerate(zip(self.arms, self._clutches, strict=True)):
            self._acts[i] = (self._acts[i] + 1) % ACTS
            clutch.align(arm.task.palm.position, arm.task.palm.rotation)

    def engage(self) -> None:
        """See ``Machine``."""
        super().engage()
        for arm, clutch, cue in zip(self.arms, self._clutches, self._cues, strict=True):
            clutch.align(arm.task.palm.position, arm.task.palm.rotation)
            cue.reset()
        self._led = [False] * len(self.arms)

    def _stop(self, i: int) -> None:
        self.leases[i].bar()
        self._cues[i].reset()
        self._causes[i], self._amounts[i] = QUIET, 0.0

    def restart(self, i: int) -> None:
        """See ``Station``; what the avatar feels fades in again."""
        if self.arms[i].stopped:
            self.arms[i].engage()
            self.far[i].fader.share = 0.0
        super().restart(i)

    def _move(self, i: int, arm: StationArm, gain: float, trust: float) -> None:
        clutch, palm = self._clutches[i], arm.task.palm
        clutch.update(palm.position, palm.rotation, bool(self._pressed >> i & 1))
        far = self.far[i]
        share = far.fader.update(self.leases[i].follows and not clutch.open)
        np.multiply(arm.force.wrench, gain * trust, out=self._hand[i])
        if far.feel(share * gain):
            self.notes.append(f"{arm.side} arm: the link damps what is felt, its energy is used up")
        self._foresee(i, clutch, share * gain)
        law = self._laws[i]
        law.update()
        self._announce(i, arm, law, gain)
        arm.move(law.torque, 1.0 - gain)
        self._tell(i, arm)

    def _foresee(self, i: int, clutch: Clutch, share: float) -> None:
        """What keeps the avatar's arm from its limits, as it will be where it is led."""
        model, limits = self._models[i], self._limits[i]
        if model is None:
            return
        if not self.leases[i].follows:
            if share == 0.0:
                model.reset()
            push(model.wrench, share, MOST_PUSH, limits)
            return
        model.position[:], model.rotation[:] = clutch.position, clutch.rotation
        model.measured[:] = self._remote.joints[i]
        model.update()
        push(model.wrench, share, MOST_PUSH, limits)

    def _intervenes(self, i: int) -> tuple[int, float]:
        """What keeps the avatar from following the hand, or the hand from moving, and how much of it."""
        own, there = self._notices[i]
        far = self.far[i]
        if far.stopped:
            return STOPPED_THERE, 1.0
        if self._led[i] and not self.leases[i].follows and not self._clutches[i].open:
            return UNLED, far.age
        if there.on:
            return AVATAR_LIMIT, self._pushed[i][1]
        if own.on:
            return LIMIT, self._pushed[i][0]
        return (ENERGY, far.port.damping) if far.damped or far.behind else (QUIET, 0.0)

    def _announce(self, i: int, arm: StationArm, law: OperatorLaw, gain: float) -> None:
        """Tell the hand what intervenes."""
        self._led[i] |= self.leases[i].follows
        cause, amount = self._causes[i], self._amounts[i] = self._intervenes(i)
        palm, cue = arm.task.palm, self._cues[i]
        axis = palm.rotation[:, CUE_AXIS]
        share = amount / WHOLE[cause] if cause else 0.0
        force = cue.update(cause if gain == 1.0 else QUIET, share, float(axis.dot(arm.task.twist[:3])))
        if force:
            law.torque += force * (axis @ palm.J[:3])

    def _tell(self, i: int, arm: StationArm) -> None:
        """Which limit pushes back, and how hard: a hand that is not obeyed must know why."""
        own, there = self._notices[i]
        pushed = list(map(abs, (arm.avoidance.torque + arm.ends).tolist()))
        self._pushed[i][0] = max(pushed)
        if own.update(max(pushed)):
            self.notes.append(_pushed(f"{arm.side} arm", pushed, arm.avoidance))
        model = self._models[i]
        if model is None:
            return
        acts = bool(np.count_nonzero(self._limits[i]))
        pushed = [abs(torque) * acts for torque in model.limits.torque.tolist()]
        self._pushed[i][1] = max(pushed)
        if there.update(max(pushed)):
            self.notes.append(_pushed(f"{arm.side} avatar arm", pushed, model.limits))

    def _numbers(self) -> Sequence[Sequence[Array]]:
        arms, laws = self.arms, self._laws
        return (
            [arm.task.q for arm in arms],
            [arm.task.palm.position for arm in arms],
            [clutch.position for clutch in self._clutches],
            [arm.force.wrench for arm in arms],
            list(self._felt_there),
            [arm.avoidance.alpha for arm in arms],
            [arm.avoidance.torque for arm in arms],
            [law.avatar for law in laws],
            [law.torque for law in laws],
        )

    def fill(self) -> None:
        """See ``state_layout``."""
        self._copy_numbers()
        logged = self._logged
        for i, (arm, lease, clutch) in enumerate(zip(self.arms, self.leases, self._clutches, strict=True)):
            far, port, cue = self.far[i], self.far[i].port, self._cues[i]
            logged["share"][i], logged["age"][i] = far.fader.share, self._remote.age[i]
            logged["act"][i] = self._acts[i]
            logged["tank"][i], logged["taken"][i], logged["damping"][i] = port.level, port.taken, port.damping
            logged["standing"][i], logged["stopped"][i] = lease.number, bool(arm.stopped)
            if (model := self._models[i]) is not None:
                logged["foreseen"][i] = model.q
            logged["brakes"][i] = self.gloves[i].brakes.bits if self.gloves else 0
            logged["cause"][i], logged["amount"][i] = self._causes[i], self._amounts[i]
            logged["announced"][i], logged["cue"][i] = cue.cause, cue.force
            logged["clutched"][i], logged["near"][i] = clutch.open, arm.avoidance.near
        if self.body is not None:
            logged["head"][:], logged["paddle"][:] = self.body.head, self.body.paddle
