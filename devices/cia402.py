"""The power drive state machine of CiA 402, and walking a group of drives through it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..binding import bind
from ..configs.members import at_hand
from ._wire import ffi, lib
from .cia301 import Address
from .errors import (
    DriveError,
    DriveFaultError,
    DriveModeError,
    LeftStateError,
    TransitionError,
    UnheardError,
)
from .image import ProcessImage


@at_hand
class State(IntEnum):
    """States, with the name of the standard."""

    UNKNOWN = 0
    NOT_READY_TO_SWITCH_ON = 1
    SWITCH_ON_DISABLED = 2
    READY_TO_SWITCH_ON = 3
    SWITCHED_ON = 4
    OPERATION_ENABLED = 5
    QUICK_STOP_ACTIVE = 6
    FAULT_REACTION_ACTIVE = 7
    FAULT = 8

    def __str__(self) -> str:
        return self.name.replace("_", " ").lower()


# Statusword (6041h): mask and value of each state
STATUS: Final[dict[State, tuple[int, int]]] = {
    State.NOT_READY_TO_SWITCH_ON: (0x4F, 0x00),
    State.SWITCH_ON_DISABLED: (0x4F, 0x40),
    State.READY_TO_SWITCH_ON: (0x6F, 0x21),
    State.SWITCHED_ON: (0x6F, 0x23),
    State.OPERATION_ENABLED: (0x6F, 0x27),
    State.QUICK_STOP_ACTIVE: (0x6F, 0x07),
    State.FAULT_REACTION_ACTIVE: (0x4F, 0x0F),
    State.FAULT: (0x4F, 0x08),
}
STATUS_MASK: Final = 0x6F
VOLTAGE_ENABLED: Final = 0x0010

# Objects of a drive
ERROR_CODE: Final[Address] = (0x603F, 0)
CONTROLWORD: Final[Address] = (0x6040, 0)
STATUSWORD: Final[Address] = (0x6041, 0)
MODE: Final[Address] = (0x6060, 0)
"""Mode of operation."""
MODE_DISPLAY: Final[Address] = (0x6061, 0)
POSITION: Final[Address] = (0x6064, 0)
VELOCITY: Final[Address] = (0x606C, 0)
TARGET_TORQUE: Final[Address] = (0x6071, 0)
MAX_TORQUE: Final[Address] = (0x6072, 0)
RATED_TORQUE: Final[Address] = (0x6076, 0)
TORQUE: Final[Address] = (0x6077, 0)
ENCODER_INCREMENTS: Final[Address] = (0x608F, 1)
ENCODER_TURNS: Final[Address] = (0x608F, 2)
GEAR_MOTOR_TURNS: Final[Address] = (0x6091, 1)
GEAR_SHAFT_TURNS: Final[Address] = (0x6091, 2)
TARGET_VELOCITY: Final[Address] = (0x60FF, 0)

# Modes of operation
CYCLIC_SYNCHRONOUS_VELOCITY: Final = 9
CYCLIC_SYNCHRONOUS_TORQUE: Final = 10

# Commands in the controlword (6040h)
DISABLE_VOLTAGE: Final = 0x0000
QUICK_STOP: Final = 0x0002
SHUTDOWN: Final = 0x0006
SWITCH_ON: Final = 0x0007
ENABLE_OPERATION: Final = 0x000F
FAULT_RESET: Final = 0x0080


@dataclass(frozen=True, slots=True)
class Transition:
    """A transition that a controlword asks for; `number` is the standard's."""

    number: int
    source: State
    target: State
    controlword: int


TRANSITIONS: Final = (
    Transition(2, State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, SHUTDOWN),
    Transition(3, State.READY_TO_SWITCH_ON, State.SWITCHED_ON, SWITCH_ON),
    Transition(4, State.SWITCHED_ON, State.OPERATION_ENABLED, ENABLE_OPERATION),
    Transition(5, State.OPERATION_ENABLED, State.SWITCHED_ON, SWITCH_ON),
    Transition(6, State.SWITCHED_ON, State.READY_TO_SWITCH_ON, SHUTDOWN),
    Transition(7, State.READY_TO_SWITCH_ON, State.SWITCH_ON_DISABLED, DISABLE_VOLTAGE),
    Transition(8, State.OPERATION_ENABLED, State.READY_TO_SWITCH_ON, SHUTDOWN),
    Transition(9, State.OPERATION_ENABLED, State.SWITCH_ON_DISABLED, DISABLE_VOLTAGE),
    Transition(10, State.SWITCHED_ON, State.SWITCH_ON_DISABLED, DISABLE_VOLTAGE),
    Transition(12, State.QUICK_STOP_ACTIVE, State.SWITCH_ON_DISABLED, DISABLE_VOLTAGE),
    Transition(15, State.FAULT, State.SWITCH_ON_DISABLED, FAULT_RESET),
)
# The drive makes these by itself; meanwhile the controlword stays 0.
AUTOMATIC: Final = (
    Transition(1, State.NOT_READY_TO_SWITCH_ON, State.SWITCH_ON_DISABLED, DISABLE_VOLTAGE),
    Transition(14, State.FAULT_REACTION_ACTIVE, State.FAULT, DISABLE_VOLTAGE),
)
TARGETS: Final = {
    State.SWITCH_ON_DISABLED: DISABLE_VOLTAGE,
    State.READY_TO_SWITCH_ON: SHUTDOWN,
    State.SWITCHED_ON: SWITCH_ON,
    State.OPERATION_ENABLED: ENABLE_OPERATION,
}


def _decoding_table() -> NDArray[np.uint8]:
    table = np.full(STATUS_MASK + 1, State.UNKNOWN, np.uint8)
    for state, (mask, value) in STATUS.items():
        for word in range(STATUS_MASK + 1):
            if word & mask == value:
                table[word] = state
    return table


_STATE_OF: Final = _decoding_table()


def decode(statusword: int) -> State:
    """The state that a statusword reports; UNKNOWN for a pattern that the standard does not list."""
    return State(int(_STATE_OF[statusword & STATUS_MASK]))


def next_transition(state: State, target: State) -> Transition | None:
    """The next transition on the way to one of `TARGETS`, or None where there is no way."""
    steps = [t for t in (*TRANSITIONS, *AUTOMATIC) if t.source is state]
    direct = next((t for t in steps if t.target is target), None)
    if direct or state in (State.UNKNOWN, target):
        return direct
    # every other way starts upwards: out of fault, to switch on disabled, and on from there
    upwards = (1, 2, 3, 4, 12, 14, 15)
    return next((t for t in steps if t.number in upwards), None)


WITHOUT_TORQUE: Final = (State.SWITCH_ON_DISABLED, State.FAULT)
"""States in which a drive rests without torque."""
FAULTED: Final = (State.FAULT_REACTION_ACTIVE, State.FAULT)


@dataclass(slots=True)
class _Walk:
    """One drive on its way: the transition it is asked to make, and since how many ticks it is not there.

    Of these, the last `unheard` ticks were without an answer.
    """

    transition: Transition | None = None
    ticks: int = 0
    unheard: int = 0
    arrived: bool = False

    def arrive(self) -> None:
        """It is there; should it leave, a new walk begins."""
        self.transition, self.ticks, self.arrived = None, 0, True


class PowerStage:
    """Takes the drives of some groups together to a state and holds them there, one step per tick.

    A drive that leaves the state it was told to hold is never brought back silently: that is an error, and
    so is one in another mode of operation than its own, which is found before it is enabled. Only answers
    of the present tick count: a drive that did not answer is nowhere.

    Attributes:
        target: the state that was requested last.
        ready: whether all drives were seen there by the last step.
    """

    def __init__(self, image: ProcessImage, groups: Sequence[str], deadline: int) -> None:
        """Binds to the image.

        Args:
            image: the process image.
            groups: groups of drives, with the words statusword, error_code, controlword and mode.
            deadline: ticks that each transition may take, and that a drive may be unheard without a break.

        Raises:
            NetworkError: a group that is none, or has no such words.
        """
        self._deadline = deadline
        self._image = image
        self._words = [
            tuple(image.word(f"{group}.{name}") for name in ("statusword", "error_code", "controlword"))
            for group in groups
        ]
        self._modes = [image.word(f"{group}.mode") for group in groups]
        self._indices = [image.network.groups[group] for group in groups]
        self._devices = [[image.network.devices[i] for i in indices] for indices in self._indices]
        self._own_modes = [[int(d.settings()[MODE]) for d in devices] for devices in self._devices]
        self._groups = ffi.new("drives_group[]", [{"n": len(devices)} for devices in self._devices])
        for g, own in enumerate(self._own_modes):
            words, modes = np.array(own, np.int64).astype(np.uint32), self._modes[g]
            bind(lib, self._groups, {}, g, statusword=self._words[g][0], mode=modes, own_mode=words)
        self.request(State.SWITCH_ON_DISABLED)

    def request(self, target: State, reset_faults: bool = False) -> None:
        """Asks for a state; the walk begins with the next step.

        Args:
            target: one of `TARGETS`.
            reset_faults: whether a drive in fault may be reset. If not, a fault is an error, unless
                the drives are to be switched off anyway.

        Raises:
            ValueError: a state that is no target.
        """
        if target not in TARGETS:
            raise ValueError(f"{target} cannot be a target; choose one of {', '.join(map(str, TARGETS))}")
        self.target = target
        self.ready = False
        off = target is State.SWITCH_ON_DISABLED
        self._holding = self._groups, len(self._groups), *STATUS[target], off
        self._dropped = [[False for _ in devices] for devices in self._devices]
        self._reset_faults = reset_faults
        self._walks = [[_Walk() for _ in devices] for devices in self._devices]
        if off:
            for _, _, controlword in self._words:
                controlword[:] = DISABLE_VOLTAGE

    @property
    def enabling(self) -> bool:
        """Whether any drive was told to enable its operation: from then on it may give torque."""
        return any(ENABLE_OPERATION in words[2].tolist() for words in self._words)

    @property
    def live(self) -> str:
        """A drive that is not known to be without torque at this tick, for people; "" where all are."""
        for name, state, fresh, _, _ in self._drives():
            if not fresh:
                return f"{name} does not answer"
            if state not in WITHOUT_TORQUE:
                return f"{name} reports {state}"
        return ""

    @property
    def unfit(self) -> str:
        """A drive that must not be enabled as it is at this tick, for people; "" where all may be."""
        for name, state, fresh, mode, own in self._drives():
            if not fresh:
                return f"{name} does not answer"
            if state is not State.SWITCH_ON_DISABLED:
                return f"{name} reports {state}"
            if mode != own:
                return f"{name} is in mode {mode} (6061h) instead of {own}"
        return ""

    def drop(self, index: int) -> None:
        """Switches one drive off until the next request, whatever it reports and the others do.

        Args:
            index: of the drive, counted through all groups.
        """
        g = 0
        while index >= len(self._devices[g]):
            index -= len(self._devices[g])
            g += 1
        self._dropped[g][index] = True
        self._words[g][2][index] = DISABLE_VOLTAGE

    def step(self) -> bool:
        """Looks at the statuswords and writes the controlwords; call once per tick.

        An error of one drive keeps none from being switched off; on the way up it keeps all where they are.

        Returns:
            Whether all drives are in the target state.

        Raises:
            DriveFaultError: a drive is in fault.
            TransitionError: a transition took too long, or led elsewhere.
            UnheardError: a drive did not answer for too long.
            LeftStateError: a drive left the target state by itself.
            DriveModeError: a drive is in another mode of operation than its own.
        """
        held, self.ready = self.ready, False
        if held and self._all_fresh() and lib.drives_there(*self._holding):
            self.ready = True
            return True
        there, errors = True, list[DriveError]()
        controlwords = [words[2].tolist() for words in self._words]
        for g, walks in enumerate(self._walks):
            for i, walk in enumerate(walks):
                if self._dropped[g][i]:
                    controlwords[g][i] = DISABLE_VOLTAGE
                    continue
                try:
                    arrived, controlwords[g][i] = self._step_drive(g, i, walk)
                except DriveError as error:
                    errors.append(error)
                else:
                    there = there and arrived
        if not errors or self.target is State.SWITCH_ON_DISABLED:
            for words, wanted in zip(self._words, controlwords, strict=True):
                words[2][:] = wanted
        if errors:
            raise errors[0]
        self.ready = there
        return there

    def _all_fresh(self) -> bool:
        image = self._image
        if image.working_counter == image.expected:
            return True
        return all(image.fresh[i] for indices in self._indices for i in indices)

    def _drives(self) -> Iterator[tuple[str, State, bool, int, int]]:
        """Name, state, whether it answered at this tick, mode of operation, and the mode it should be in."""
        for g, indices in enumerate(self._indices):
            for i, index in enumerate(indices):
                state = decode(int(self._words[g][0][i]))
                fresh = bool(self._image.fresh[index])
                yield self._devices[g][i].name, state, fresh, int(self._modes[g][i]), self._own_modes[g][i]

    def _step_drive(self, g: int, i: int, walk: _Walk) -> tuple[bool, int]:
        """Whether the drive is there, and its controlword."""
        statusword, error_code, controlword = (int(words[i]) for words in self._words[g])
        device = self._devices[g][i]
        state = decode(statusword)
        where = (device.name, device.node, str(state), statusword)
        if not self._image.fresh[self._indices[g][i]]:
            self._miss(where, walk)
            return False, controlword
        walk.unheard = 0
        switching_off = self.target is State.SWITCH_ON_DISABLED
        if state in FAULTED:
            if not switching_off and (walk.arrived or not self._reset_faults):
                raise DriveFaultError(*where, error_code)
            if switching_off and not self._reset_faults and state is State.FAULT:
                walk.arrive()
                return True, DISABLE_VOLTAGE
        mode, own = int(self._modes[g][i]), self._own_modes[g][i]
        if mode != own and not switching_off:
            raise DriveModeError(*where, mode, own)
        if state is self.target:
            walk.arrive()
            return True, TARGETS[self.target]
        if walk.arrived and not (switching_off and state in FAULTED):
            raise LeftStateError(*where, str(self.target))
        return False, self._advance(where, state, walk)

    def _miss(self, where: tuple[str, int, str, int], walk: _Walk) -> None:
        """A drive without an answer in this tick may be anywhere, but not for long.

        One that missed the very tick in which its transition should have ended is given the next to say so.
        """
        walk.ticks += 1
        walk.unheard += 1
        if walk.unheard > self._deadline:
            raise UnheardError(*where, walk.unheard)

    def _advance(self, where: tuple[str, int, str, int], state: State, walk: _Walk) -> int:
        """The controlword for a drive that is under way."""
        under_way = walk.transition
        faulted = self.target is State.SWITCH_ON_DISABLED and state in FAULTED  # it leaves every way
        if under_way is None or state is under_way.target or (faulted and under_way.source not in FAULTED):
            walk.transition = next_transition(state, self.target)
            walk.ticks = 0
            under_way = walk.transition
            if under_way is None:
                raise TransitionError(*where, 0, f"there is no way to {self.target}")
            if under_way.number == 15:
                return DISABLE_VOLTAGE  # the reset is a rising edge: one tick without it first
        if state is not under_way.source:
            raise TransitionError(*where, under_way.number, f"expected {under_way.target}")
        walk.ticks += 1
        if walk.ticks > self._deadline:
            why = "" if where[3] & VOLTAGE_ENABLED else ", and has no voltage (is STO acting?)"
            raise TransitionError(*where, under_way.number, f"not within {self._deadline} ticks{why}")
        return under_way.controlword
