"""What is measured and heard at a tick, and how far it is believed."""

from __future__ import annotations

from operator import le

import numpy as np

from ...devices.cia301 import AlState
from ...devices.image import ProcessImage
from ...devices.safety_plc import SafetySignals
from ...safety import Monitor, Observation, Verdict
from .machine import Foreseeing, Machine
from .modes import RENDERING, Mode
from .sections import Arming

REST_SHARE, SWING_SHARE = 0.02, 0.04
"""Measured speed, as a share of the largest allowed one, below which a motor is at rest, and the link behind
its spring: a hand that holds on pulls at the springs of motors that stand."""
LEAST_REST, LEAST_SWING = 0.01, 0.02
"""No less than that counts as motion [rad/s or m/s]: drives measure speeds to some 0.002."""
REST_S = 0.1
"""For so long: a link that swings on its spring is slow where it turns round, and the slowest take 0.15 s
from one end to the other."""
INTRUDER_SILENT_S = 0.25
"""For so long a second master must be silent before a reset: slower than masters usually send."""

OPERATING = int(AlState.OP)


class Senses:
    """Takes each tick what the devices report, and has it judged.

    Attributes:
        seen: the observation that the monitor judged last.
        monitor: its judge.
    """

    def __init__(
        self, image: ProcessImage, machine: Machine, signals: SafetySignals, arming: Arming, rate: float
    ) -> None:
        """``arming``: whether a safety operator is needed, who may override the handle's dead-man switch."""
        self.seen = Observation()
        self.monitor = Monitor(machine.thresholds)
        self._image, self._machine, self._signals = image, machine, signals
        self._supervisor, self._guarded = arming.by == "supervisor", arming.scanner == "always"
        self._foreseeing = machine if isinstance(machine, Foreseeing) else None
        self._still, self._still_limit = 0, round(REST_S * rate)
        self._rest, self._swing = (
            tuple(max(least, share * speed) for speed in machine.thresholds.speed)
            for share, least in ((REST_SHARE, LEAST_REST), (SWING_SHARE, LEAST_SWING))
        )
        self._silence = round(INTRUDER_SILENT_S * rate)
        self._intruded = -self._silence

    @property
    def slow(self) -> bool:
        """Whether every axis, motor and link, is slow at this tick."""
        return self._still > 0

    @property
    def at_rest(self) -> bool:
        """Whether every axis is measured to stand, motor and link, and has stood for a while."""
        return self._still >= self._still_limit

    @property
    def held(self) -> bool:
        """Whether the switch is pressed that must be let go before a reset, and pressed anew after it."""
        seen = self.seen
        return seen.supervised if seen.overriding else seen.dead_man

    @property
    def trust(self) -> float:
        """How far the measured wrench is believed, 0 to 1."""
        return self.monitor.trust.wrench

    def estimate(self, elapsed: int, mode: Mode) -> None:
        """Take the latched process image.

        Args:
            elapsed: periods between this measurement and the one before.
            mode: of the machine.
        """
        machine = self._machine
        machine.plausibility.accept(elapsed, mode.powered and mode is not Mode.ENABLING)
        machine.estimate()
        slow = all(map(le, map(abs, machine.velocity), self._rest))
        slow = slow and all(map(le, machine.plausibility.speed, self._swing))
        self._still = self._still + 1 if slow else 0

    def judge(self, tick: int, skipped: int, mode: Mode) -> Verdict:
        """What the monitor says to what was estimated; see ``Inputs`` for tick and skipped ticks."""
        self._observe(tick, skipped, mode)
        return self.monitor.judge(self.seen)

    def listen(self, tick: int) -> int:
        """Frames of this tick that only a master sends, and that this one did not."""
        heard = self._image.intruding
        if heard:
            self._intruded = tick
        return heard

    def intruded(self, tick: int) -> bool:
        """Whether a second master was heard lately."""
        return tick - self._intruded < self._silence

    def _observe(self, tick: int, skipped: int, mode: Mode) -> None:
        image, seen, machine = self._image, self.seen, self._machine
        rendering = mode in RENDERING
        seen.skipped = skipped
        if image.calm:
            seen.discarded = seen.foreign = 0
            seen.missed = seen.faults = seen.lost = ()
        else:
            # one disturbance of the bus doubles or delays the answers of all devices: a tick counts once
            seen.discarded, seen.foreign = int(image.discarded > 0), self.listen(tick)
            seen.missed, seen.faults = image.missed.tolist(), image.emcy.tolist()
            seen.lost = np.logical_or(image.lost, image.al_state != OPERATING).tolist()
        found = machine.plausibility.findings
        seen.rejected, seen.mismatched, seen.frozen = found.rejected, found.mismatched, found.frozen
        seen.contradicted, seen.stale = found.contradicted, found.stale
        seen.unbalanced = found.unbalanced
        seen.astray = machine.astray if rendering and True in machine.astray else ()
        seen.overload = machine.overload
        if self._foreseeing:
            seen.ahead = self._foreseeing.ahead if rendering else ""
            seen.pressed = self._foreseeing.pressed if mode is Mode.HOLDING else ""
        seen.position, seen.velocity = machine.position, machine.velocity
        seen.way = machine.plausibility.way
        seen.armed = mode.powered
        people = self._signals.state()
        seen.dead_man, seen.e_stop, seen.sto = people.dead_man, people.emergency_stop, people.sto
        seen.field_clear = people.field_clear
        seen.supervised = people.supervised or not self._supervisor
        seen.overriding = people.overriding and self._supervisor
        # who holds the handle stands in the field
        seen.guarded = seen.overriding or self._guarded
        seen.wrench, seen.inertial = machine.raw_wrench, machine.inertial
        seen.solved = machine.solved or not rendering  # else nothing was solved
