"""What happens and people should know: one catalogue of codes, each with its severity and its English.

An event is made where its cause is seen and travels as a code with values; it becomes words where somebody
reads it.
"""

from __future__ import annotations

from enum import Enum, StrEnum, unique

import msgspec

from ...safety import TRIP_WORDS


class Severity(StrEnum):
    """What an event means to the person at the machine."""

    NOTE = "note"
    """All is as it should be."""
    REFUSAL = "refusal"
    """What a person asked for is not done."""
    WARNING = "warning"
    """Something is not as it should be; what runs goes on."""
    STOP = "stop"
    """The machine is brought to rest."""
    FAILURE = "failure"
    """The session cannot go on."""


Value = str | int | float | list[str]


class Event(msgspec.Struct, frozen=True):
    """Something that happened; ``str`` gives its English.

    Attributes:
        code: stable name in ``EventKind``.
        severity: what it means to people.
        values: what is particular to this one, by the names in the English of its kind.
    """

    code: str
    severity: Severity
    values: dict[str, Value]

    def __str__(self) -> str:
        return _WORDS[self.code].format_map(
            {name: _List(value) if isinstance(value, list) else value for name, value in self.values.items()}
        )


class _List(list[str]):
    """Formats as its items, with the format's text between them."""

    def __format__(self, between: str) -> str:
        return between.join(self)


UNARMABLE = "what runs goes on, and the machine is not armed again"
"""What follows where a session is not recorded as a whole."""
_TAKEN_OVER = "the simulated person is yours now: the script has let go of dead-man switch and hand"


@unique
class EventKind(Enum):
    """The catalogue: code, severity, and English with the names of values in braces.

    A kind that is called with its values makes an event; nothing is put into words yet.
    """

    # the machine's modes
    READY = ("ready", Severity.NOTE, "READY: all devices answer; press the dead-man switch to start")
    BRING_UP_FAILED = ("bring_up_failed", Severity.FAILURE, "FAILED: {why}")
    ENABLING = ("enabling", Severity.NOTE, "ENABLING: dead-man pressed; drives switch on")
    ENGAGING = ("engaging", Severity.NOTE, "ENGAGING: drives enabled; the operator's wrench fades in")
    ENGAGED = ("engaged", Severity.NOTE, "ACTIVE: engaged")
    TRIPPED = ("tripped", Severity.STOP, "{mode}: " + TRIP_WORDS)
    ENDING = ("ending", Severity.NOTE, "{mode}: " + TRIP_WORDS)
    HELD = ("held", Severity.NOTE, "HOLDING: at rest, held under power")
    SWITCHED_OFF = (
        "switched_off",
        Severity.NOTE,
        "STOPPED: drives switch off; release the dead-man switch and reset",
    )
    RESET = ("reset", Severity.NOTE, "READY: reset; press the dead-man switch to start")

    ANNOUNCED = ("announced", Severity.NOTE, "{what}")
    EXCHANGING = ("exchanging", Severity.NOTE, "twin {twin}: the machine comes to rest for it")
    EXCHANGED = ("exchanged", Severity.NOTE, "twin {twin}: it is rendered from now on")

    # what a person asks for
    ARMED = ("armed", Severity.NOTE, "armed by command: press the dead-man switch to start")
    NOT_ARMED = ("not_armed", Severity.REFUSAL, "not armed: a stop is latched; reset it first")
    ARMING_EXPIRED = (
        "arming_expired",
        Severity.REFUSAL,
        "the command to arm expired after {seconds:g} s; give it again",
    )
    ARMING_REVOKED = ("arming_revoked", Severity.NOTE, "stop commanded: the command to arm is revoked")
    NOTHING_TO_STOP = ("nothing_to_stop", Severity.NOTE, "stop commanded: no drive has power")
    NOT_STARTED = ("not_started", Severity.REFUSAL, "not started: {why:; }")
    NOT_RESET = ("not_reset", Severity.REFUSAL, "reset refused: {why}")
    NOT_EXCHANGED = ("not_exchanged", Severity.REFUSAL, "twin {twin}: not exchanged: {why}")
    TYPED = ("typed", Severity.NOTE, "typed: {what:; }")
    TAKEN_OVER = ("taken_over", Severity.NOTE, _TAKEN_OVER)
    TAKEN_OVER_ENDLESS = (
        "taken_over_endless",
        Severity.NOTE,
        _TAKEN_OVER + "; the session goes on until you quit",
    )
    SUSPENDING = ("suspending", Severity.NOTE, "Ctrl-Z: the machine stops, then this session is suspended")
    NOT_SUSPENDED = (
        "not_suspended",
        Severity.NOTE,
        "Ctrl-Z: the machine stops; no shell could resume this session",
    )

    # devices and the bus
    DEVICE_ERROR = (
        "device_error",
        Severity.WARNING,
        "{device} says EMCY {error:04X}h, register {register:02X}h, vendor {vendor}",
    )
    DEVICE_ERROR_GONE = ("device_error_gone", Severity.NOTE, "{device} says EMCY 0000h: its error is gone")
    AXIS_DROPPED = ("axis_dropped", Severity.STOP, "{axis} is not measured: torque off, brake closed")
    STO_UNCONFIRMED = (
        "sto_unconfirmed",
        Severity.WARNING,
        "the safety PLC does not confirm the STO: press the emergency stop",
    )
    NOT_FINITE = ("not_finite", Severity.WARNING, "not finite, sent as zero: {fields:, }")
    BUS_LOSSES = ("bus_losses", Severity.WARNING, "bus: {losses:, }")
    BUS_RISK = ("bus_risk", Severity.WARNING, "warning: {what}")
    BUS_CLOCK = ("bus_clock", Severity.NOTE, "ticks follow the clock of the bus")
    NO_BUS_CLOCK = ("no_bus_clock", Severity.WARNING, "no clock on the bus: running free")

    # the program and its host
    PROCESSORS_AWAKE = ("processors_awake", Severity.NOTE, "the processors are kept awake")
    PROCESSORS_MAY_SLEEP = (
        "processors_may_sleep",
        Severity.NOTE,
        "the processors may sleep between ticks as far as the host lets them",
    )
    NOT_REALTIME = ("not_realtime", Severity.WARNING, "warning: {what}")
    OVERSTAYED = (
        "overstayed",
        Severity.WARNING,
        "warning: {where} took {us:.0f} us; between ticks it may take {budget_us:.0f} us",
    )
    LATE_TICK = ("late_tick", Severity.WARNING, "warning: a late tick: {cause} took {us:.0f} us")
    WORK_FAILED = ("work_failed", Severity.WARNING, "warning: {work} failed and was dropped: {error}")
    UNRECORDED = ("unrecorded", Severity.WARNING, f"not recorded any more: {UNARMABLE}")
    PLANT_FROZEN = (
        "plant_frozen",
        Severity.FAILURE,
        "the simulated plant froze: no answer for {seconds:g} s",
    )
    INTERNAL_ERROR = ("internal_error", Severity.FAILURE, "internal error: {error}")

    def __init__(self, code: str, severity: Severity, words: str) -> None:
        self.code, self.severity, self.words = code, severity, words

    def __call__(self, **values: Value) -> Event:
        """An event of this kind."""
        return Event(self.code, self.severity, values)


_WORDS = {kind.code: kind.words for kind in EventKind}
