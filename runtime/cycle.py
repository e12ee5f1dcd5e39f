"""One tick, synchronous and free of clocks: the live loop, lockstep and replay call this same function."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
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
    Permission,
    Reaction,
    Standstill,
    StopLatch,
    Trip,
    Verdict,
    describe,
    refusal,
    refusals,
    strayed,
)
from .machine import Machine
from .modes import Command, Mode
from .sections import Config
from .stages import Mark, Stage

TRANSITION_DEADLINE_S = 0.2
"""Each transition of a drive's CiA 402 state machine."""
RESET_DEADLINE_S = 0.5
"""From a reset command until faults and causes must be gone."""
QUIET_S = 0.02
"""For so long nothing must stand against a reset before the latch lets go."""
INTRUDER_SILENT_S = 0.25
"""For so long a second master must be silent before a reset: slower than masters usually send."""
PERMISSION_S = 30.0
"""From the command to arm until it expires."""
REST_SHARE = 0.02
"""Measured speed, as a share of the largest allowed one, below which an axis is at rest."""
LURCH_SHARE = 0.1
"""Share of an axis' play that it may be off its place when its drive gets torque: so much of the whole torque
of the hold would pull at once."""
UNSEEN_TICKS = 5
"""Ticks of engaging after which whatever moved while the drives had no torque has been measured."""
BRAKING_MARGIN = 1.5
"""How much longer than planned a controlled stop may take before it becomes a ramp."""
DETECTION_SHARE = 0.2
"""Share of the declared stop time that detection may take; the ramp gets the rest."""

OPERATING = int(AlState.OP)
NO_REQUEST = SafetyRequest(0)
STANDING = (Mode.READY, Mode.HOLDING, Mode.STOPPED)
"""Modes in which nothing may move."""
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
        image, machine, gate, monitor, standstill, power, signals, bringup: the parts.
        permission: to arm by a press.
        place: where the axes stood when the dead-man switch was pressed, and where their hold began.
        foreign: tick of the last frame of a second master; intruders: such frames during bring-up.
        recorded: whether somebody writes the log.
        asked: what the safety PLC is asked for; unconfirmed: ticks of an STO that it does not confirm.
        gap: ticks that were skipped before the last SYNC.
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
        self.gap = 0
        self.commanded = -1
        self.permission = Permission(config.arming.by == "command", round(PERMISSION_S * rate))
        self.fade = 1.0 / (config.arming.fade * rate)
        self.gain, self.trust = 0.0, 1.0
        self.ramp_limit = round((1.0 - DETECTION_SHARE) * config.safety.stop_time * rate)
        self.hold_limit = round(BRAKING_MARGIN * machine.braking * rate)
        self.ramp = 0
        self.standstill = Standstill(machine.play, round(config.safety.stop_time * rate))
        self.unseen = UNSEEN_TICKS * self.fade
        self.lurch = tuple(LURCH_SHARE * play for play in machine.play)
        self.place: tuple[Sequence[float], Sequence[float]] = ((), ())
        self.rest = tuple(REST_SHARE * speed for speed in machine.thresholds.speed)
        self.reset_limit, self.quiet_limit = round(RESET_DEADLINE_S * rate), max(1, round(QUIET_S * rate))
        self.resetting = self.quiet = 0
        self.acknowledging = False
        self.asked = NO_REQUEST
        self.sto_limit = round(TRANSITION_DEADLINE_S * rate)
        self.unconfirmed = 0
        self.silence = round(INTRUDER_SILENT_S * rate)
        self.foreign = -self.silence
        self.intruders = 0
        self.recorded = True
        self.failure = ""
        self.packed = b""
        self.digest = 0

    @property
    def at_rest(self) -> bool:
        """Whether every axis is measured to stand."""
        return all(abs(v) <= most for v, most in zip(self.machine.velocity, self.rest, strict=True))

    @property
    def starting(self) -> bool:
        """Whether what moved while the drives had no torque may not have been measured yet."""
        return self.mode in (Mode.ENABLING, Mode.ENGAGING) and self.gain < self.unseen

    @property
    def secured(self) -> bool:
        """Whether no drive has power: none was ever switched on, or every one says now that it is off."""
        never = self.mode in (Mode.BRINGUP, Mode.FAILED)
        return never or not (self.mode.powered or self.power.live)


def cycle(inputs: Inputs, memory: Memory, outputs: Outputs) -> None:
    """Sense, judge, command: a function of inputs and memory alone, without clock, I/O or randomness."""
    m = memory
    outputs.frames.clear()
    outputs.events.clear()
    m.packed = inputs.frames.pack()
    m.digest = zlib.crc32(m.packed)
    m.image.latch(inputs.frames, m.counter)
    m.mark(Stage.DECODE)
    if inputs.commands and inputs.commands & Command.UNRECORDED and m.recorded:
        m.recorded = False
        outputs.events.append("not recorded any more: what runs goes on, and the machine is not armed again")
    if m.mode in (Mode.BRINGUP, Mode.FAILED):
        outputs.verdict = PASS
        _bring_up(inputs, m, outputs)
    else:
        _run(inputs, m, outputs)
    m.counter, m.gap = inputs.tick, inputs.skipped
    if m.mode is not Mode.FAILED:
        # a device whose watchdog acted wants one SYNC without valid outputs before it may run again
        operational = m.mode is not Mode.BRINGUP and m.resetting != m.reset_limit - 1
        m.image.compose(outputs.frames, m.counter, operational)
    m.mark(Stage.ENCODE)


# ------------------------------------------------------------------------------------- bring-up


def _bring_up(inputs: Inputs, m: Memory, outputs: Outputs) -> None:
    tick = inputs.tick
    m.gate.deny()
    if m.mode is Mode.FAILED:
        return
    if m.image.intruding:
        m.intruders += m.image.intruding
        m.foreign = tick
    try:
        state = m.bringup.step(inputs.frames, outputs.frames)
    except DeviceError as error:
        m.failure = str(error)
        outputs.frames.clear()
        _enter(m, Mode.FAILED, outputs, m.failure)
        return
    if state is BringupState.READY:
        _first_look(tick, m, outputs)


def _first_look(tick: int, m: Memory, outputs: Outputs) -> None:
    """Drives that came up are ready once every one of them says that it is without torque."""
    _switch(tick, m, outputs)
    if m.mode is Mode.BRINGUP and m.power.ready:
        _enter(m, Mode.READY, outputs, "all devices answer; press the dead-man switch to start")
    if m.mode is Mode.READY and m.intruders:
        heard = f"{m.intruders} frames that only a master sends during bring-up"
        _latch(Verdict(Reaction.RAMP, "second_master", heard), tick, m, outputs)


# ------------------------------------------------------------------------------------- running


def _run(inputs: Inputs, m: Memory, outputs: Outputs) -> None:
    # what is measured now was sampled at the last SYNC, before which other ticks may have been skipped
    elapsed = 1 + max(inputs.skipped, m.gap)
    m.machine.plausibility.accept(elapsed, m.mode.powered and m.mode is not Mode.ENABLING)
    m.machine.estimate()
    m.mark(Stage.ESTIMATE)
    seen = _observe(inputs, m)
    verdict = m.monitor.judge(seen)
    m.trust = m.monitor.trust.wrench
    if seen.foreign:
        m.foreign = inputs.tick
    if inputs.commands:
        _obey(inputs, m, outputs)
    _latch(verdict, inputs.tick, m, outputs)
    if m.resetting:
        _reset(inputs.tick, verdict, m, outputs)
    press = m.dead_man.pressed_anew(seen.dead_man)
    if m.mode in (Mode.READY, Mode.STOPPED):
        _wait(inputs.commands, press, verdict, m, outputs)
    elif m.starting:
        _keep_place(inputs.tick, m, outputs)
    if m.mode in STANDING:
        _stand(inputs.tick, m, outputs)
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
    _ask(m, outputs)
    outputs.verdict = verdict if verdict.reaction >= admitted.reaction else admitted


def _obey(inputs: Inputs, m: Memory, outputs: Outputs) -> None:
    """Of several commands in a tick the safest counts: nobody knows in which order they were meant."""
    tick, commands = inputs.tick, inputs.commands
    if commands & Command.END:
        _latch(Verdict(Reaction.RAMP, END, "the session ends"), tick, m, outputs)
    if commands & Command.STOP:
        if m.resetting:
            _refuse_reset("stop commanded", m, outputs)
        if m.mode is not Mode.READY:
            _latch(Verdict(Reaction.RAMP, "operator", "stop commanded"), tick, m, outputs)
        elif m.permission.revoke():
            outputs.events.append("stop commanded: the command to arm is revoked")
        else:
            outputs.events.append("stop commanded: no drive has power")
    elif commands & Command.RESET and not m.resetting:
        m.resetting = m.reset_limit


def _observe(inputs: Inputs, m: Memory) -> Observation:
    image, seen, machine = m.image, m.seen, m.machine
    seen.skipped = inputs.skipped
    # one disturbance of the bus doubles or delays the answers of all devices: a tick counts once
    seen.discarded, seen.foreign = int(image.discarded > 0), image.intruding
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
    """A stop is latched, and whatever is stronger after it; the strongest stands.

    While no drive has power, what would merely hold the machine (R2) forbids to start as long as it lasts;
    what would switch it off is latched all the same, for it may be gone when somebody presses. A machine
    whose drives just switch on, or got torque so lately that what moved before is not measured yet, has
    nothing to ramp down, and a ramp or a hold might pull at what moved: they switch off again.
    """
    if not (m.mode.powered or m.latch.trip) and verdict.reaction < Reaction.RAMP:
        return
    if not m.latch.take(verdict, tick):
        return
    if verdict.reason != END:
        m.stopped_by = m.latch.trip
    if m.mode.powered and not m.starting:
        if m.mode is not Mode.STOPPING:  # a stronger reason gives a stop no more time
            m.ramp = 0
        _enter(m, Mode.STOPPING, outputs, describe(m.latch.trip))
    else:
        _enter(m, Mode.STOPPED, outputs, describe(m.latch.trip))


def _reset(tick: int, verdict: Verdict, m: Memory, outputs: Outputs) -> None:
    """Faults are acknowledged on every tick of the deadline until the latch lets go.

    The safety PLC is asked to let go only once nothing else stands against it.
    """
    if m.mode.powered:
        held = m.mode is Mode.HOLDING
        why = "release the dead-man switch first" if held else "the machine is not at rest yet"
        outputs.events.append(f"reset refused: {why}")
        m.resetting, m.acknowledging = 0, False
        return
    if m.resetting == m.reset_limit:
        m.power.request(State.SWITCH_ON_DISABLED, reset_faults=True)
        m.quiet = 0
    m.resetting -= 1
    why = _against_reset(tick, verdict, m)
    m.acknowledging = not why
    if not why and m.seen.sto:
        why = "the safety PLC holds the torque off"
    m.quiet = 0 if why else m.quiet + 1
    if m.quiet >= m.quiet_limit and not m.latch.reset(verdict, m.seen.dead_man, m.at_rest):
        _end_reset(m)
        m.permission.revoke()
        m.stopped_by = None
        _enter(m, Mode.READY, outputs, "reset; press the dead-man switch to start")
    elif m.resetting == 0:
        _refuse_reset(why or "it was not quiet for long enough", m, outputs)


def _against_reset(tick: int, verdict: Verdict, m: Memory) -> str:
    """What stands against a reset besides an STO, for people; "" where nothing does."""
    seen, live = m.seen, m.power.live
    why = f"{live}; it may have power" if live else refusal(verdict, seen.dead_man, m.at_rest)
    if not why and tick - m.foreign < m.silence:
        why = "a second master was heard just now"
    if not why and any(seen.faults):
        why = "devices report errors"
    if not why and not m.power.ready:
        why = "a drive has not left its fault"
    if why and any(m.image.lost):
        why = "a device restarted or left its operating state; end this session and start another"
    return why


def _refuse_reset(why: str, m: Memory, outputs: Outputs) -> None:
    _end_reset(m)
    outputs.events.append(f"reset refused: {why}")


def _end_reset(m: Memory) -> None:
    m.resetting = 0
    m.acknowledging = False
    m.power.request(State.SWITCH_ON_DISABLED)


def _ask(m: Memory, outputs: Outputs) -> None:
    """What the safety PLC is asked for: an R4 stands as long as its latch, but for the acknowledgement."""
    wanted = NO_REQUEST
    if m.acknowledging:
        wanted = SafetyRequest.RESET
    elif m.latch.trip and m.latch.reaction is Reaction.OFF:
        wanted = SafetyRequest.STO
        m.unconfirmed = 0 if m.seen.sto else m.unconfirmed + 1
        if m.unconfirmed == m.sto_limit:
            outputs.events.append("the safety PLC does not confirm the STO: press the emergency stop")
    if wanted is not m.asked:
        m.asked = wanted
        m.signals.request(wanted)


def _wait(commands: Command, press: bool, verdict: Verdict, m: Memory, outputs: Outputs) -> None:
    """Without power: whether a command permits, and a press starts."""
    if m.permission.expired():
        outputs.events.append(f"the command to arm expired after {PERMISSION_S:g} s; give it again")
    if commands & (Command.STOP | Command.END):
        return
    if commands & Command.ARM:
        if m.mode is Mode.READY:
            m.permission.give()
            outputs.events.append("armed by command: press the dead-man switch to start")
        else:
            outputs.events.append("not armed: a stop is latched; reset it first")
    if not press:
        return
    found = _refusals(verdict, m)
    if found:
        outputs.events.append(f"not started: {'; '.join(found)}")
        return
    position = tuple(m.machine.position)
    m.place = position, position
    m.machine.engage()
    m.dropped[:] = [False] * len(m.dropped)
    m.proven = True
    m.power.request(State.OPERATION_ENABLED)
    m.gain = 0.0
    _enter(m, Mode.ENABLING, outputs, "dead-man pressed; drives switch on")


def _keep_place(tick: int, m: Memory, outputs: Outputs) -> None:
    """Between the press and the first torque, the machine must stay where it was pressed.

    As long as no drive may give torque, the hold begins anew where the axes are measured, so that what
    moved a little is not pulled back. What left its play slipped through its brakes, and is not started;
    neither is what was displaced just as its drive got torque, and no ramp may pull at it.
    """
    machine, position = m.machine, tuple(m.machine.position)
    pressed, held = m.place
    enabling = m.power.enabling
    if enabling:
        axis = strayed(position, held, m.lurch)
    else:
        machine.engage()
        m.place = pressed, position
        axis = strayed(position, pressed, machine.play)
    if axis >= 0:
        name, by = machine.axes[axis].name, position[axis] - pressed[axis]
        reaction = Reaction.OFF if enabling else Reaction.RAMP
        detail = f"{name} moved by {by:.3g} between the press and the first torque"
        _latch(Verdict(reaction, "moved", detail), tick, m, outputs)


def _stand(tick: int, m: Memory, outputs: Outputs) -> None:
    """What should stand is watched: brakes slip, and what is held may be pushed away."""
    axis = m.standstill.moved(m.machine.position, m.at_rest)
    if axis >= 0:
        held = m.mode is Mode.HOLDING
        name, reaction = m.machine.axes[axis].name, Reaction.RAMP if held else Reaction.OFF
        detail = f"{name} was pushed away" if held else f"{name} moves, though its brake should hold it"
        _latch(Verdict(reaction, "moved", detail), tick, m, outputs)


def _refusals(verdict: Verdict, m: Memory) -> list[str]:
    seen = m.seen
    found = refusals(
        operational=m.image.working_counter == m.image.expected and not any(seen.lost),
        faults=sum(map(bool, seen.faults)),
        unfit=m.power.unfit,
        latched=m.latch.trip is not None,
        resetting=m.resetting > 0,
        e_stop=seen.e_stop,
        field_clear=seen.field_clear,
        sto=seen.sto,
        permitted=m.permission.given,
        sensors_valid=m.trust == 1.0 and seen.inertial,
        inside_limits=m.machine.inside_limits,
        at_rest=m.at_rest,
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
        _enter(m, Mode.STOPPED, outputs, "drives switch off; release the dead-man switch and reset")


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
        # whoever does not switch off, or does not say so, loses its torque by the safety PLC
        disobeys = m.power.target is State.SWITCH_ON_DISABLED and m.power.live
        reaction = Reaction.OFF if disobeys else Reaction.RAMP
        _latch(Verdict(reaction, "drive_state", str(error)), tick, m, outputs)
        return
    if m.mode is Mode.ENABLING and ready:
        _enter(m, Mode.ENGAGING, outputs, "drives enabled; the operator's wrench fades in")


def _enter(m: Memory, mode: Mode, outputs: Outputs, why: str) -> None:
    m.mode = mode
    if mode in STANDING:
        m.standstill.start()
    outputs.events.append(f"{mode.name}: {why}")
