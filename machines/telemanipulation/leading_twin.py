"""A machine's twin as an avatar's arm: it leads the arm, and what the arm's palm feels drives the twin.

The twin has the arm's kinematics, inertia and limits, and an elbow that is drawn home like the arm's. So what
the arm cannot do the twin does not do either, and the person feels that as a constraint of the twin.
"""

from __future__ import annotations

import numpy as np

from ...control.chain_twin import ChainTwin
from ...control.lease import FRESH_S, Lease
from ...control.task_arm import Posture, TaskArm
from ...devices.image import ProcessImage
from ...devices.remote import ACTS, ENGAGED, TOLD, packed
from ...devices.remote_avatar import RemoteAvatars
from ..rendering import sections as s
from ..rendering.logged import Field
from ..rendering.twin import end_of, robot_of
from .arm import SIDES, quaternion
from .far_arm import FarArm
from .sections import Leads

WEIGHTLESS = (0.0, 0.0, 0.0)


def led_fields(leads: Leads | None) -> list[Field]:
    """Numbers of a state, where a twin leads."""
    if leads is None:
        return []
    n = len(getattr(leads, leads.side).home)
    return [
        ("goal", "<f8", 3),  # of the avatar's palm, in its station [m]
        ("there", "<f8", n),  # joints of the avatar, as they were heard [rad]
        ("felt", "<f8", 6),  # of the avatar's world, as it drives the twin: at the palm in its axes [N, N m]
        ("driving", "<f8", n),  # that, and what draws the elbow home, at the twin's joints [N m]
        ("share", "<f8"),  # of what the avatar feels
        ("age", "<f8"),  # of what was heard [s]
        ("tank", "<f8"),  # energy that the link may give out [J]
        ("taken", "<f8"),  # by its passivity, so far [J]
        ("standing", "<f8"),  # order of `control.lease.Standing`
        ("stopped", "<f8"),  # whether the arm stopped itself
    ]


class LeadingTwin:
    """Between the twin and the gateways of an avatar.

    A tick is ``exchange``, then ``drive`` where the machine renders, or ``rest``.

    Attributes:
        far: the arm.
        palm: of the twin, in the avatar's station; its joints are the twin's.
        notes: what people should be told, in words; whoever tells it empties the list.
        numbers: of ``led_fields``.
    """

    def __init__(
        self,
        leads: Leads,
        section: s.ChainTwin,
        twin: ChainTwin,
        image: ProcessImage,
        notes: list[str],
        dt: float,
    ) -> None:
        """Let a twin lead.

        Args:
            leads: whom.
            section: what the twin was made of.
            twin: whose ``start`` and ``driving`` are written here.
            image: with a gateway to either arm of the avatar.
            notes: the machine's.
            dt: of a tick [s].
        """
        self._twin, self._row, self.notes = twin, SIDES.index(leads.side), notes
        home, pull = twin.start.copy(), leads.posture
        posture = Posture(home, pull.stiffness, pull.damping)
        self.palm = TaskArm(robot_of(section), end_of(section), twin.q, twin.qd, posture, gravity=WEIGHTLESS)
        self._home, self._most_age = home, leads.link.delay + FRESH_S
        self._remote, self._pose, self._twist = (
            RemoteAvatars(image),
            image["remote.pose"],
            image["remote.twist"],
        )
        self._energy = image["remote.own_energy"]
        self._felt = np.zeros(6)
        self.far = FarArm(
            leads.side,
            Lease(leads.link.delay, dt),
            self._remote,
            self._row,
            (self.palm.palm.rotation, self.palm.twist),
            self._felt,
            (leads.most.force, leads.most.torque),
            leads.feedback,
            leads.link.passivity,
            dt,
        )
        self._standing = self.far.lease.standing
        self._act, self._begins, self._renders = 0, False, False
        self._wrench, self._states = np.zeros(6), np.zeros(6)
        self.driving = twin.driving = np.zeros(len(home))
        self.numbers = (
            *(self.palm.palm.position, self._remote.joints[self._row, : len(home)], self._felt, self.driving),
            self._states,
        )

    def exchange(self) -> None:
        """Take what the avatar says, and tell it where its palm is to be."""
        self._hear()
        self._say()

    def _hear(self) -> None:
        far = self.far
        self.palm.update()
        if far.hear(self._act):
            what = "stopped itself: press the dead-man switch anew" if far.stopped else "goes on"
            self.notes.append(f"{far.name} avatar arm {what}")
        if far.lease.standing is not self._standing:
            self._standing = far.lease.standing
            self.notes.append(f"{far.name} avatar arm {self._standing.value}")

    def engage(self) -> None:
        """The machine is about to put the twin on its handle: with joints where the avatar's are.

        Where they are not known, or not within the twin's limits, they are at home.
        """
        limits, n = self._twin.limits, len(self._home)
        there = self._remote.joints[self._row, :n]
        inside = bool(((limits.lower <= there) & (there <= limits.upper)).all())
        known = inside and self.far.age <= self._most_age
        self._twin.start[:] = there if known else self._home
        self.far.fader.share = 0.0
        self.far.feel(0.0)
        self._begins = True

    def drive(self, gain: float) -> None:
        """Before the twin's ``update``: what drives it in this tick; gain: 0 to 1, while it engages."""
        if self._begins:
            self._begins = False
            self._act = (self._act + 1) % ACTS
        self._renders = True
        far, palm = self.far, self.palm
        palm.update()
        if far.feel(gain * far.fader.update(far.lease.follows)):
            self.notes.append(f"{far.name} avatar arm: the link damps what is felt, its energy is used up")
        rotation, wrench = palm.palm.rotation, self._wrench
        np.matmul(rotation, self._felt[:3], out=wrench[:3])
        np.matmul(rotation, self._felt[3:], out=wrench[3:])
        np.matmul(wrench, palm.palm.J, out=self.driving)
        self.driving += gain * palm.null

    def rest(self) -> None:
        """The twin is not rendered in this tick."""
        self.far.feel(self.far.fader.update(False))
        self.driving[:] = 0.0

    def _say(self) -> None:
        """Nobody leads the other arm."""
        far, palm, i = self.far, self.palm.palm, self._row
        self._pose[i, :3], self._pose[i, 3:] = palm.position, quaternion(palm.rotation)
        self._twist[i] = self.palm.twist
        flags = (ENGAGED if self._renders else 0) | (TOLD if far.waits else 0)
        words = self._remote.own_flags
        words[:], words[i] = 0, packed(flags, self._act)
        self._pose[1 - i, 3:] = 0.0, 0.0, 0.0, 1.0
        self._energy[i] = far.port.sent
        self._renders = False  # until this tick drives it

    def fill(self) -> None:
        """Bring ``numbers`` up to date."""
        far = self.far
        port = far.port
        states = far.fader.share, far.age, port.level, port.taken, far.lease.number, far.stopped
        self._states[:] = states
