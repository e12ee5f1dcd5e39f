"""One tick, synchronous and free of clocks: the live loop, lockstep and replay call this same function."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field

import numpy as np

from ..devices.bringup import Bringup, BringupState, Deadlines
from ..devices.cia301 import AlState
from ..devices.cia402 import PowerStage, State
from ..devices.errors import DeviceError
from ..devices.frames import CAPACITY, Frames
from ..devices.image import ProcessImage
from ..devices.safety_plc import SafetyRequest, SafetySignals
from ..safety import (
    PASS,
    DeadMan,
    Gate,
    Monitor,
    Observation,
    Reaction,
    StopLatch,
    Trip,
    Verdict,
    describe,
    refusals,
)
from .machine import Machine
from .modes import Command, Mode
from .sections import Config
from .stages import Mark, Stage

TRANSITION_DEADLINE_S = 0.2
"""Each transition of a drive's CiA 402 state machine."""
RESET_DEADLINE_S = 0.5
"""From a reset command until faults and causes must be gone."""
BRAKING_MARGIN = 1.5
"""How much longer than planned a controlled stop may take before it becomes a ramp."""
DETECTION_SHARE = 0.2
"""Share of the declared stop time that detection may take; the ramp gets the rest."""

OPERATING = int(AlState.OP)
END = "end"
"""Reason of the stop that ends every session; no fault."""


@dataclass(slots=True)
class Inputs:
    """Everything a tick depends on besides the memory.

    Attributes:
        frames: received since the last tick, in the order they are consumed.
        tick: index on the phase grid.
        skipped: ticks before this one that did not run.
        commands: given by a person since the last tick.
    """

    frames: Frames = field(default_factory=lambda: Frames(2 * CAPACITY))
    tick: int = 0
    skipped: int = 0
    commands: Command = Command.NONE


@dataclass(slots=True)
class Outputs:
    """What a tick leaves behind, filled anew by each.

    Attributes:
        frames: to send.
        verdict: the strongest of what the layers said.
        events: sentences for people; none in most ticks.
    """

    frames: Frames = field(default_factory=Frames)
    verdict: Verdict = PASS
    events: list[str] = field(default_factory=list)


class Memory:
    """What a session carries from tick to tick.

    Attributes:
        mode: of the machine.
        latch: the stop that stands.
        stopped_by: the last stop that was more than the end of the session, None after a reset.
        image, machine, gate, monitor, power, signals, bringup: the parts.
        counter: of the last SYNC; commanded: tick of the last commands.
        gain: how far the operator's wrench has faded in.
        trust: how far the measured wrench is believed.
        dropped: one an axis, whether a stop switched its drive off for want of measurements.
        proven: whether the sensors showed rest when the machine was first started: later a hand may pull.
        mark: told when a stage of the tick ends; decides nothing.
        packed, digest: the consumed frames as bytes, and their CRC.
    """

    def __init__(self, config: Config, image: ProcessImage, machine: Machine, mark: Mark) -> None:
        rate = config.loop.rate
        self.image, self.machine, self.mark = image, machine, mark
        self.mode = Mode.BRINGUP
        self.latch = StopLatch()
        self.stopped_by: Trip | None = None
        self.gate = Gate(machine.axes, rate)
        self.monitor = Monitor(machine.thresholds)
        self.dead_man = DeadMan()
        self.signals = SafetySignals(image)
        self.bringup = Bringup(image, Deadlines.at(rate))
        self.power = PowerStage(image, machine.drive_groups, round(TRANSITION_DEADLINE_S * rate))
        self.seen = Observation()
        self.calm = [False] * image.expected
        self.dropped = [False] * len(machine.axes)
        self.proven = False
        self.counter = 0
        self.commanded = -1
        self.needs_command = config.arming.by == "command"
        self.permitted = not self.needs_command
        self.fade = 1.0 / (config.arming.fade * rate)
        self.gain, self.trust = 0.0, 1.0
        self.ramp_limit = round((1.0 - DETECTION_SHARE) * config.safety.stop_time * rate)
        self.hold_limit = round(BRAKING_MARGIN * machine.braking * rate)
        self.ramp = 0
        self.reset_limit = round(RESET_DEADLINE_S * rate)
        self.resetting = 0
        self.recorded = True
        self.failure = ""
        self.packed = b""
        self.digest = 0


def cycle(inputs: Inputs, memory: Memory, outputs: Outputs) -> None:
    """Sense, judge, command: a function of inputs and memory alone, without clock, I/O or randomness."""
    m = memory
    outputs.frames.clear()
    outputs.events.clear()
    m.packed = inputs.frames.pack()
    m.digest = zlib.crc32(m.packed)
    m.image.latch(inputs.frames, m.counter)
    m.mark(Stage.DECODE)
    if m.mode in (Mode.BRINGUP, Mode.FAILED):
        outputs.verdict = PASS
        _bring_up(inputs, m, outputs)
    else:
        _run(inputs, m, outputs)
    m.counter = inputs.tick
    if m.mode is not Mode.FAILED:
        # a device whose watchdog acted wants one SYNC without valid outputs before it may run again
        operational = m.mode is not Mode.BRINGUP and m.resetting != m.reset_limit - 1
        m.image.compose(outputs.frames, m.counter, operational)
    m.mark(Stage.ENCODE)


# ------------------------------------------------------------------------------------- bring-up


def _bring_up(inputs: Inputs, m: Memory, outputs: Outputs) -> None:
    m.gate.deny()
    if m.mode is Mode.FAILED:
        return
    try:
        state = m.bringup.step(inputs.frames, outputs.frames)
    except DeviceError as error:
        m.failure = str(error)
        _enter(m, Mode.FAILED, outputs, m.failure)
        return
    if state is BringupState.READY:
        _enter(m, Mode.READY, outputs, "all devices answer; press the dead-man switch to start")


# ------------------------------------------------------------------------------------- running


def _run(inputs: Inputs, m: Memory, outputs: Outputs) -> None:
    m.machine.plausibility.accept(1 + inputs.skipped, m.mode.powered and m.mode is not Mode.ENABLING)
    m.machine.estimate()
    m.mark(Stage.ESTIMATE)
    seen = _observe(inputs, m)
    verdict = m.monitor.judge(seen)
    m.trust = m.monitor.trust.wrench
    if inputs.commands:
        _obey(inputs, m, outputs)
    _latch(verdict, inputs.tick, m, outputs)
    if m.resetting:
        _reset(verdict, m, outputs)
    press = m.dead_man.pressed_anew(seen.dead_man)
    if m.mode is Mode.READY:
        _ready(inputs, press, verdict, m, outputs)
    m.mark(Stage.SAFETY)
    _control(inputs.tick, m, outputs)
    m.mark(Stage.COMMAND)
    _switch(inputs.tick, m, outputs)
    machine = m.machine
    admitted = m.gate.admit(
        machine.commands,
        machine.position,
        machine.velocity,
        m.mode.powered,
        m.commanded,
        inputs.tick,
        m.dropped,
    )
    if not m.gate.enable and m.power.target is not State.SWITCH_ON_DISABLED:
        m.power.request(State.SWITCH_ON_DISABLED)
    _latch(admitted, inputs.tick, m, outputs)
    m.mark(Stage.SAFETY)
    machine.write(m.gate.admitted)
    outputs.verdict = verdict if verdict.reaction >= admitted.reaction else admitted


def _obey(inputs: Inputs, m: Memory, outputs: Outputs) -> None:
    if inputs.commands & Command.STOP:
        _latch(Verdict(Reaction.RAMP, "operator", "stop commanded"), inputs.tick, m, outputs)
    if inputs.commands & Command.END:
        _latch(Verdict(Reaction.RAMP, END, "the session ends"), inputs.tick, m, outputs)
    if inputs.commands & Command.RESET:
        m.resetting = m.reset_limit
    if inputs.commands & Command.UNRECORDED:
        m.recorded = False


def _observe(inputs: Inputs, m: Memory) -> Observation:
    image, seen, machine = m.image, m.seen, m.machine
    seen.skipped = inputs.skipped
    seen.discarded, seen.foreign = image.discarded, image.intruding
    if image.calm:
        seen.missed = seen.faults = seen.lost = m.calm
    else:
        seen.missed, seen.faults = image.missed.tolist(), image.emcy.tolist()
        seen.lost = np.logical_or(image.lost, image.al_state != OPERATING).tolist()
    found = machine.plausibility.findings
    seen.rejected, seen.mismatched, seen.frozen = found.rejected, found.mismatched, found.frozen
    seen.stale = found.stale
    seen.position, seen.velocity = machine.position, machine.velocity
    seen.armed = m.mode.powered
    seen.dead_man, seen.e_stop, seen.field_clear, seen.sto = m.signals.state()
    seen.wrench, seen.inertial = machine.raw_wrench, machine.inertial
    seen.solved = machine.solved or m.mode not in (Mode.ENGAGING, Mode.ACTIVE)  # else nothing was solved
    return seen


def _latch(verdict: Verdict, tick: int, m: Memory, outputs: Outputs) -> None:
    """A stop while drives have power is latched, and whatever is stronger after it; the strongest stands."""
    if not (m.mode.powered or m.latch.trip) or not m.latch.take(verdict, tick):
        return
    if verdict.reason != END:
        m.stopped_by = m.latch.trip
    if not m.mode.powered:
        outputs.events.append(f"{m.mode.name}: {describe(m.latch.trip)}")
    else:
        if m.mode is not Mode.STOPPING:  # a stronger reason gives a stop no more time
            m.ramp = 0
        _enter(m, Mode.STOPPING, outputs, describe(m.latch.trip))


def _reset(verdict: Verdict, m: Memory, outputs: Outputs) -> None:
    """Faults are acknowledged on every tick of the deadline until the latch lets go."""
    if m.mode.powered:
        held = m.mode is Mode.HOLDING
        why = "release the dead-man switch first" if held else "the machine is not at rest yet"
        outputs.events.append(f"reset refused: {why}")
        m.resetting = 0
        return
    if m.resetting == m.reset_limit:
        m.power.request(State.SWITCH_ON_DISABLED, reset_faults=True)
        m.signals.request(SafetyRequest.RESET)
    m.resetting -= 1
    faults = any(m.seen.faults) or m.seen.sto
    why = m.latch.reset(verdict, m.seen.dead_man, m.power.ready) or (
        "devices report errors" if faults else ""
    )
    if why and any(m.image.lost):
        why = "a device restarted or left its operating state; end this session and start another"
    if not why:
        m.resetting = 0
    elif m.resetting == 0:
        outputs.events.append(f"reset refused: {why}")
    if m.resetting == 0:
        m.signals.request(SafetyRequest(0))
        m.power.request(State.SWITCH_ON_DISABLED)
        if not why:
            m.permitted = not m.needs_command
            m.stopped_by = None
            _enter(m, Mode.READY, outputs, "reset; press the dead-man switch to start")


def _ready(inputs: Inputs, press: bool, verdict: Verdict, m: Memory, outputs: Outputs) -> None:
    if inputs.commands & Command.ARM:
        m.permitted = True
        outputs.events.append("armed by command: press the dead-man switch to start")
    if not press:
        return
    found = _refusals(verdict, m)
    if found:
        outputs.events.append(f"not started: {'; '.join(found)}")
        return
    m.machine.engage()
    m.dropped[:] = [False] * len(m.dropped)
    m.proven = True
    m.power.request(State.OPERATION_ENABLED)
    m.gain = 0.0
    _enter(m, Mode.ENABLING, outputs, "dead-man pressed; drives switch on")


def _refusals(verdict: Verdict, m: Memory) -> list[str]:
    seen = m.seen
    found = refusals(
        operational=m.image.working_counter == m.image.expected and not any(seen.lost),
        faults=sum(map(bool, seen.faults)),
        latched=m.latch.trip is not None,
        e_stop=seen.e_stop,
        field_clear=seen.field_clear,
        sto=seen.sto,
        permitted=m.permitted,
        sensors_valid=m.trust == 1.0 and seen.inertial,
        inside_limits=m.machine.inside_limits,
        recorded=m.recorded,
    )
    if not m.proven:
        found += m.machine.unrest
    return found or ([verdict.detail] if verdict.reaction.stops else [])


def _control(tick: int, m: Memory, outputs: Outputs) -> None:
    """The commands of this tick, and the modes that follow from the motion."""
    machine = m.machine
    if m.mode is Mode.ENGAGING:
        m.gain = min(1.0, m.gain + m.fade)
        if m.gain == 1.0:
            _enter(m, Mode.ACTIVE, outputs, "engaged")
    if m.mode in (Mode.ENGAGING, Mode.ACTIVE):
        machine.update(m.gain, m.trust)
        m.commanded = tick
        return
    if not m.mode.powered:
        return
    if m.mode is not Mode.ENABLING:
        _drop(m, outputs)
    at_rest = machine.brake(m.dropped) or all(m.dropped)
    m.commanded = tick
    if m.mode is not Mode.STOPPING:
        return
    m.ramp += 1
    reaction = m.latch.reaction
    if reaction is Reaction.HOLD and not all(m.dropped):
        if at_rest:
            _enter(m, Mode.HOLDING, outputs, "at rest, held under power")
        elif m.ramp >= m.hold_limit:
            late = "the controlled stop did not come to rest in time"
            _latch(Verdict(Reaction.RAMP, "stop_timeout", late), tick, m, outputs)
    elif reaction is Reaction.OFF or at_rest or m.ramp >= m.ramp_limit:
        if reaction is Reaction.OFF:
            m.signals.request(SafetyRequest.STO)
        _enter(m, Mode.STOPPED, outputs, "torque off, brakes closed; release the dead-man switch and reset")


def _drop(m: Memory, outputs: Outputs) -> None:
    """Switch off, until the next start, the drives of axes that nothing reliable is known of."""
    for i, trusted in enumerate(m.monitor.trust.axes):
        if not (trusted or m.dropped[i]):
            m.dropped[i] = True
            m.power.drop(i)
            outputs.events.append(f"{m.machine.axes[i].name} is not measured: torque off, brake closed")


def _switch(tick: int, m: Memory, outputs: Outputs) -> None:
    """Walk the drives towards what the mode needs."""
    if not m.mode.powered and m.power.target is not State.SWITCH_ON_DISABLED:
        m.power.request(State.SWITCH_ON_DISABLED)
    try:
        ready = m.power.step()
    except DeviceError as error:
        _latch(Verdict(Reaction.RAMP, "drive_state", str(error)), tick, m, outputs)
        return
    if m.mode is Mode.ENABLING and ready:
        _enter(m, Mode.ENGAGING, outputs, "drives enabled; the operator's wrench fades in")


def _enter(m: Memory, mode: Mode, outputs: Outputs, why: str) -> None:
    m.mode = mode
    outputs.events.append(f"{mode.name}: {why}")
