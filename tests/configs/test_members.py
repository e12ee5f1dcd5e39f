from __future__ import annotations

import pickle
from enum import IntEnum, IntFlag

from hapticd.configs.members import at_hand
from hapticd.devices.cia402 import State
from hapticd.runtime.core.modes import Command, Mode
from hapticd.runtime.core.stages import Stage
from hapticd.safety import Reaction


@at_hand
class Colour(IntEnum):
    RED = 1
    CRIMSON = 1
    BLUE = 2


def test_members_are_what_they_were_and_lie_in_the_class() -> None:
    assert vars(Colour)["BLUE"] is Colour(2) is Colour["BLUE"] is Colour.BLUE
    assert Colour.CRIMSON is Colour.RED and list(Colour) == [1, 2]
    assert str(Mode.ACTIVE) == str(Mode(4)) and Mode.ACTIVE.name == "ACTIVE"
    assert pickle.loads(pickle.dumps(Mode.ACTIVE)) is Mode.ACTIVE
    assert Command.STOP | Command.END == 9 and isinstance(Command.STOP | Command.END, IntFlag)


def test_what_the_tick_looks_up_is_at_hand() -> None:
    for kind in (State, Mode, Command, Stage, Reaction):
        assert all(vars(kind)[name] is member for name, member in kind.__members__.items())
