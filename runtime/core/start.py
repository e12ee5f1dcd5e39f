"""Starts: who permits them, what forbids them, and that nothing moves before the first torque."""

from __future__ import annotations

from collections.abc import Sequence

from ...devices.image import ProcessImage
from ...safety import PASS, DeadMan, Permission, Reaction, Verdict, refusals, strayed
from .drives import Drives
from .events import EventKind
from .machine import Machine
from .modes import Command, Mode
from .phase import Phase
from .senses import Senses
from .stops import Stops

PERMISSION_S = 30.0
"""From the command to arm until it expires."""
LURCH_SHARE = 0.1
"""Share of an axis' play that it may be off its place when its drive gets torque: so much of the whole torque
of the hold would pull at once."""


class Start:
    """From a press of the dead-man switch to the first torque.

    Attributes:
        permission: to arm by a press.
        recorded: whether somebody writes the log.
        refused: why the last press started nothing; "" where it did, or nobody pressed.
    """

    def __init__(
        self,
        image: ProcessImage,
        machine: Machine,
        phase: Phase,
        senses: Senses,
        drives: Drives,
        stops: Stops,
        permission: Permission,
    ) -> None:
        self._image, self._machine, self._phase = image, machine, phase
        self._senses, self._drives, self._stops = senses, drives, stops
        self.permission = permission
        self.recorded = True
        self.refused = ""
        self._dead_man, self._supervisor = DeadMan(), DeadMan()
        self._lurch = tuple(LURCH_SHARE * play for play in machine.play)
        # where the axes stood when the dead-man switch was pressed, and where their hold began
        self._pressed: Sequence[float] = ()
        self._held: Sequence[float] = ()
        self._first = True

    def pressed(self) -> bool:
        """Whether the dead-man switch that counts is pressed at this tick; call once a tick."""
        seen = self._senses.seen
        dead_man = self._dead_man.pressed_anew(seen.dead_man)
        supervisor = self._supervisor.pressed_anew(seen.supervised)
        return supervisor if seen.overriding else dead_man

    def wait(self, commands: Command, press: bool, resetting: bool, verdict: Verdict) -> None:
        """Without power: whether a command permits, and a press starts.

        Args:
            commands: of this tick.
            press: whether the dead-man switch is pressed at it.
            resetting: whether a reset is under way.
            verdict: of the monitor.
        """
        phase, permission = self._phase, self.permission
        if permission.expired():
            phase.say(EventKind.ARMING_EXPIRED(seconds=PERMISSION_S))
        if commands & (Command.STOP | Command.END):
            return
        if commands & Command.ARM:
            if phase.mode is Mode.READY:
                permission.give()
                phase.say(EventKind.ARMED())
            else:
                phase.say(EventKind.NOT_ARMED())
        if not press:
            return
        found = self._refusals(resetting, verdict)
        self.refused = "; ".join(found)
        if found:
            phase.say(EventKind.NOT_STARTED(why=found))
        else:
            self._begin()

    def keep_place(self) -> Verdict:
        """Between the press and the first torque, the machine must stay where it was pressed.

        As long as no drive may give torque, the hold begins anew where the axes are measured, so that what
        moved a little is not pulled back. What left its play slipped through its brakes, and is not started;
        neither is what was displaced just as its drive got torque, and no ramp may pull at it.
        """
        machine, position = self._machine, tuple(self._machine.position)
        enabling = self._drives.power.enabling
        if enabling:
            axis = strayed(position, self._held, self._lurch)
        else:
            machine.engage()
            self._held = position
            axis = strayed(position, self._pressed, machine.play)
        if axis < 0:
            return PASS
        name, by = machine.axes[axis].name, position[axis] - self._pressed[axis]
        reaction = Reaction.OFF if enabling else Reaction.RAMP
        return Verdict(reaction, "moved", f"{name} moved by {by:.3g} between the press and the first torque")

    def _begin(self) -> None:
        self._pressed = self._held = tuple(self._machine.position)
        self._machine.engage()
        self._stops.forget_dropped()
        self._first = False
        self._drives.enable()
        self._phase.enable()

    def _refusals(self, resetting: bool, verdict: Verdict) -> list[str]:
        image, senses, seen = self._image, self._senses, self._senses.seen
        found = refusals(
            operational=image.working_counter == image.expected and not any(seen.lost),
            faults=sum(map(bool, seen.faults)),
            unfit=self._drives.power.unfit,
            latched=self._stops.latch.trip is not None,
            resetting=resetting,
            e_stop=seen.e_stop,
            supervised=seen.supervised,
            guarded=seen.guarded,
            field_clear=seen.field_clear,
            sto=seen.sto,
            permitted=self.permission.given,
            sensors_valid=senses.trust == 1.0 and seen.inertial,
            inside_limits=self._machine.inside_limits,
            at_rest=senses.at_rest,
            recorded=self.recorded,
        )
        # at the first start nobody holds the handle; later a hand may pull
        found += self._machine.unrest(first=self._first)
        return found or ([verdict.detail] if verdict.reaction.stops else [])
