"""One tick, synchronous and free of clocks: the live loop, lockstep and replay run this same cycle."""

from __future__ import annotations

import zlib

import numpy as np

from ...devices.image import Emergency, ProcessImage
from ...devices.safety_plc import SafetySignals
from ...safety import (
    OUTPUT_BEYOND_LIMIT,
    PASS,
    Gate,
    Permission,
    Reaction,
    SetPointGate,
    Standstill,
    Verdict,
    overloaded,
    strongest,
)
from .bring_up import BringUp
from .drives import Drives, TorqueOff
from .events import Event, EventKind
from .exchange import Exchange
from .machine import Announcing, Equipped, Machine
from .modes import RENDERING, UNPREPARED, WAITING, Command, Mode, twin_number
from .phase import Phase
from .reset import Reset
from .sections import Config
from .senses import Senses
from .stages import Mark, Stage
from .start import PERMISSION_S, Start
from .stops import END, Stops
from .tick import Inputs, Outputs

NOTHING = np.zeros(0)


class Cycle:
    """Sense, judge, command: what a session carries from tick to tick, and the order of what a tick does.

    A tick is a function of its inputs and of this state alone, without clock, I/O or randomness.

    Attributes:
        image, machine, gate: what is received and sent, the controller, and the last word on its commands.
        set_points: the same for devices with controllers of their own; None where there are none.
        outputs: of the last tick.
        phase, senses, drives, stops, start, reset, bring_up: the parts, each with its own state.
        counter: of the last SYNC.
        packed, digest: the consumed frames as bytes, and their CRC.
    """

    def __init__(self, config: Config, image: ProcessImage, machine: Machine, mark: Mark) -> None:
        """``mark`` is told when a stage of the tick ends; it decides nothing."""
        rate, arming, stop_time = config.loop.rate, config.arming, config.safety.stop_time
        self.image, self.machine, self._mark = image, machine, mark
        self.outputs = Outputs()
        targets = [image[f"{group}.{quantity}"] for group, quantity in machine.outputs]
        self.gate = Gate(machine.axes, rate, targets)
        self.set_points = _set_points(machine, image, rate)
        self._wanted = machine.wanted if isinstance(machine, Equipped) else NOTHING
        standstill = Standstill(machine.play, round(stop_time * rate))
        self.phase = phase = Phase(standstill, arming.fade * rate, self.outputs.events)
        signals = SafetySignals(image)
        self.senses = senses = Senses(image, machine, signals, arming, rate)
        self.drives = drives = Drives(image, machine, phase, rate)
        self.stops = stops = Stops(machine, phase, senses, drives, stop_time, rate)
        permission = Permission(arming.by == "command", round(PERMISSION_S * rate))
        self.start = Start(image, machine, phase, senses, drives, stops, permission)
        self.reset = Reset(image, phase, senses, drives, stops, rate)
        self.bring_up = BringUp(image, phase, senses, rate)
        self._torque_off = TorqueOff(signals, phase, rate)
        self._notes = machine.notes if isinstance(machine, Announcing) else []
        self._exchange = Exchange(machine, phase)
        self.counter = 0
        self._gap = 0
        self._commanded = -1
        self._reported: dict[int, int] = {}
        self.packed = b""
        self.digest = 0

    @property
    def mode(self) -> Mode:
        """Mode of the machine."""
        return self.phase.mode

    def run(self, inputs: Inputs) -> None:
        """One tick; it leaves ``outputs``."""
        outputs, image, phase = self.outputs, self.image, self.phase
        outputs.clear()
        self.packed = inputs.frames.pack()
        self.digest = zlib.crc32(self.packed)
        image.latch(inputs.frames, self.counter)
        self._mark(Stage.DECODE)
        self._relay()
        if inputs.commands and inputs.commands & Command.UNRECORDED and self.start.recorded:
            self.start.recorded = False
            phase.say(EventKind.UNRECORDED())
        if phase.mode in UNPREPARED:
            self._prepare(inputs)
        else:
            self._control(inputs)
        self.counter, self._gap = inputs.tick, inputs.skipped
        if phase.mode is not Mode.FAILED:
            # a device whose watchdog acted wants one SYNC without valid outputs before it may run again
            operational = phase.mode is not Mode.BRINGUP and not self.reset.begins
            if image.compose(outputs.frames, self.counter, operational):
                phase.say(EventKind.NOT_FINITE(fields=list(image.not_finite)))
        self._mark(Stage.ENCODE)

    def _relay(self) -> None:
        """What devices report is said once, however often they repeat it."""
        for report in self.image.emergencies:
            if self._reported.get(report.device, 0) != report.code:
                self._reported[report.device] = report.code
                self.phase.say(_reported(self.image.network.devices[report.device].name, report))

    def _prepare(self, inputs: Inputs) -> None:
        """Drives that came up are ready once every one of them says that it is without torque."""
        phase, tick = self.phase, inputs.tick
        self.gate.deny()
        if self.set_points is not None:
            self.set_points.deny()
        if phase.mode is Mode.FAILED or not self.bring_up.step(tick, inputs.frames, self.outputs.frames):
            return
        self.stops.take(self.drives.walk(), tick)
        if phase.mode is Mode.BRINGUP and self.drives.power.ready:
            phase.enter(Mode.READY, EventKind.READY())
        if phase.mode is Mode.READY:
            self.stops.take(self.bring_up.judge(), tick)

    def _control(self, inputs: Inputs) -> None:
        """What every layer says at a tick is latched where it stops the machine, in this order."""
        tick, phase, stops = inputs.tick, self.phase, self.stops
        # what is measured now was sampled at the last SYNC, before which other ticks may have been skipped
        self.senses.estimate(1 + max(inputs.skipped, self._gap), phase.mode)
        self._mark(Stage.ESTIMATE)
        found = self.senses.judge(tick, inputs.skipped, phase.mode)
        if inputs.commands:
            self._obey(tick, inputs.commands)
        stops.take(found, tick)
        if self.reset.under_way and self.reset.step(tick, found):
            self.start.permission.revoke()
        press = self.start.pressed()
        if phase.mode in WAITING:
            self.start.wait(inputs.commands, press, self.reset.under_way, found)
        elif phase.starting:
            stops.take(self.start.keep_place(), tick)
        stops.take(stops.watch(), tick)
        self._mark(Stage.SAFETY)
        stops.take(self._command(tick), tick)
        self._mark(Stage.COMMAND)
        stops.take(self.drives.walk(), tick)
        admitted = self._admit(tick)
        stops.take(admitted, tick)
        self._mark(Stage.SAFETY)
        self._torque_off.ask(stops.off, self.reset.acknowledging, self.senses.seen.sto)
        if self._notes:
            for what in self._notes:
                phase.say(EventKind.ANNOUNCED(what=what))
            self._notes.clear()
        self._exchange.look()
        self.outputs.verdict = strongest(found, admitted)

    def _obey(self, tick: int, commands: Command) -> None:
        """Of several commands in a tick the safest counts: nobody knows in which order they were meant."""
        if commands & Command.END:
            self.stops.take(Verdict(Reaction.RAMP, END, "the session ends"), tick)
        if commands & Command.STOP:
            if self.reset.under_way:
                self.reset.refuse("stop commanded")
            if self.phase.mode is not Mode.READY:
                self.stops.take(Verdict(Reaction.RAMP, "operator", "stop commanded"), tick)
            elif self.start.permission.revoke():
                self.phase.say(EventKind.ARMING_REVOKED())
            else:
                self.phase.say(EventKind.NOTHING_TO_STOP())
        elif commands & Command.RESET:
            self.reset.begin()
        if commands & Command.TWIN:
            self._exchange.ask(twin_number(commands))

    def _command(self, tick: int) -> Verdict:
        """The commands of this tick, and the modes that follow from the motion."""
        phase = self.phase
        if phase.mode is Mode.ENGAGING:
            phase.fade_in()
        verdict = PASS
        if phase.mode in RENDERING:
            self.machine.update(phase.gain, self.senses.trust)
        elif phase.mode.powered:
            verdict = self.stops.brake()
        else:
            return PASS
        self._commanded = tick
        return verdict

    def _admit(self, tick: int) -> Verdict:
        """What the gate says to the commands; without its leave no drive stays on."""
        machine = self.machine
        admitted = self.gate.admit(
            machine.commands,
            machine.position,
            machine.velocity,
            self.phase.mode.powered,
            self._commanded,
            tick,
            self.stops.dropped,
        )
        if admitted.reason == OUTPUT_BEYOND_LIMIT:
            admitted = overloaded(self.senses.seen, admitted)
        if not self.gate.enable:
            self.drives.disable()
        if self.set_points is not None:
            admitted = strongest(admitted, self.set_points.admit(self._wanted, self.gate.enable))
        return admitted


def _set_points(machine: Machine, image: ProcessImage, rate: float) -> SetPointGate | None:
    """The gate of the devices that have controllers of their own."""
    if not (isinstance(machine, Equipped) and machine.equipment):
        return None
    own = machine.equipment
    return SetPointGate(
        [point for each in own for point in each.points],
        rate,
        [image[f"{each.group}.{each.measured}"][each.row] for each in own],
        [image[f"{each.group}.{each.target}"][each.row] for each in own],
        [image.word(f"{each.group}.enable")[each.row : each.row + 1] for each in own],
    )


def _reported(device: str, report: Emergency) -> Event:
    """What a device said in an EMCY message."""
    if report.gone:
        return EventKind.DEVICE_ERROR_GONE(device=device)
    vendor, register = report.vendor.hex(" "), report.error_register
    return EventKind.DEVICE_ERROR(device=device, error=report.code, register=register, vendor=vendor)
