"""Modes of the machine, and what a person may command."""

from __future__ import annotations

from enum import IntEnum, IntFlag

from ...configs.members import at_hand


@at_hand
class Mode(IntEnum):
    """What the machine is doing."""

    BRINGUP = 0
    """Devices are reset, checked, configured and started; drives have no power."""
    READY = 1
    """Devices answer, drives are off, waiting for a press of the dead-man switch."""
    ENABLING = 2
    """Drives walk to operation enabled and hold the posture."""
    ENGAGING = 3
    """The operator's wrench fades in."""
    ACTIVE = 4
    """The twin is rendered."""
    STOPPING = 5
    """A stop is latched and the machine comes to rest."""
    HOLDING = 6
    """Stopped and held under power (R2)."""
    STOPPED = 7
    """Stopped: the drives are told to take the torque off, and watched until every one says that it is."""
    FAILED = 8
    """Bring-up failed; nothing will move."""

    @property
    def powered(self) -> bool:
        """Whether drives may have power."""
        return self in POWERED


# tuples of members: to look a member up in its class takes longer than to look through one of these
POWERED = (Mode.ENABLING, Mode.ENGAGING, Mode.ACTIVE, Mode.STOPPING, Mode.HOLDING)
"""Modes in which drives may have power."""
UNPREPARED = (Mode.BRINGUP, Mode.FAILED)
"""Modes in which devices do not answer as they should, and no drive was ever switched on."""
WAITING = (Mode.READY, Mode.STOPPED)
"""Modes that a person ends."""
STANDING = (Mode.READY, Mode.HOLDING, Mode.STOPPED)
"""Modes in which nothing may move."""
STARTING = (Mode.ENABLING, Mode.ENGAGING)
"""Modes on the way to rendering the twin."""
RENDERING = (Mode.ENGAGING, Mode.ACTIVE)
"""Modes in which the controller computes the commands."""


@at_hand
class Command(IntFlag):
    """Commands of a person, applied at the start of a tick and logged with it."""

    NONE = 0
    STOP = 1
    RESET = 2
    ARM = 4
    END = 8
    """The session ends: come to rest, brakes closed."""
    UNRECORDED = 16
    """Nobody writes the log any more, or records are lost: what runs goes on, and is not armed again."""
    TWIN = 7 << 5
    """The number, from 1 on, of the digital twin that is to be rendered; see ``exchange``."""


TWIN_BIT = 5
MOST_TWINS = Command.TWIN >> TWIN_BIT
"""The log keeps the commands of a tick in a byte."""


def exchange(number: int) -> Command:
    """The command that asks for the twin of a number, 1 to ``MOST_TWINS``."""
    return Command(number << TWIN_BIT)


def twin_number(commands: Command) -> int:
    """The twin that commands ask for; 0 for none."""
    return (commands & Command.TWIN) >> TWIN_BIT


def together(earlier: Command, later: Command) -> Command:
    """Commands of one tick: of twins, the last that was asked for."""
    return (earlier & ~Command.TWIN if later & Command.TWIN else earlier) | later
