"""What simulated drives share: the CiA 402 state machine as the drive sees it, brake, STO, faults."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..binding import pointer
from ..devices.cia402 import MODE, State
from ..devices.device import Device
from ._plant import lib
from .attributes import Stored
from .node import SimNode
from .peers import Peers


class SimDrive(SimNode):
    """A drive. It moves its axis only in OP, operation enabled, in its mode and without STO.

    Attributes:
        state: of CiA 402.
        fault: code of a fault whose cause is present (603Fh), 0 = none; set it to inject one.
        error_code: 603Fh, stays until the fault is reset.
        controlword: as received.
        mode: mode of operation (6060h and 6061h).
        deaf: the controlword has no effect; set it to inject that.
        welded: nor has the loss of valid outputs.
        position, velocity: what the encoder reports; the plant sets them.
    """

    kind = lib.PEER_DRIVE
    says = ("statusword", "mode", "error_code")
    own_mode: int
    moved_by: ClassVar[str]
    """The output that its axis is moved with."""

    state = Stored(State, "drive")
    fault = Stored(int, "drive")
    error_code = Stored(int, "drive")
    mode = Stored(int, "drive")
    deaf = Stored(bool, "drive")
    welded = Stored(bool, "drive")
    controlword: int
    position: float
    velocity: float

    def __init__(self, device: Device, peers: Peers, index: int) -> None:
        super().__init__(device, peers, index)
        core = self._core
        core.told, core.drive.target = self._place("controlword"), self._place(self.moved_by)
        core.drive.own = self.own_mode

    def reset(self) -> None:
        """Power-up: not ready to switch on."""
        self.state = State.NOT_READY_TO_SWITCH_ON
        self.controlword = self._core.drive.obeyed = 0
        self.error_code = 0
        super().reset()

    @property
    def sto(self) -> bool:
        """Whether STO acts on this drive."""
        return bool(lib.peers_sto(self._peers.core))

    @property
    def powered(self) -> bool:
        """Whether it moves its axis; otherwise the brake is closed."""
        return bool(lib.peers_powered(self._peers.core, self.index))

    @property
    def brake(self) -> bool:
        """Whether the brake is closed."""
        return not self.powered

    @property
    def statusword(self) -> int:
        """6041h."""
        return int(lib.peers_statusword(self._peers.core, self.index))

    def _configure(self) -> None:
        super()._configure()
        self.mode = int(self.objects.read(MODE))


class Drives:
    """Some drives side by side, as the mechanics see them.

    Attributes:
        command: what their axes are moved with, 0 without power, (n,).
        braked: which brakes are closed, (n,).
    """

    def __init__(self, drives: Sequence[SimDrive]) -> None:
        """At least one, all of one network.

        Raises:
            NetworkError: they are of several groups, whose fields do not lie side by side.
        """
        n = len(drives)
        self._peers = drives[0]._peers
        devices = [drive.index for drive in drives]
        self._columns = {name: self._peers.column(devices, name) for name in drives[0].fields}
        self.command, self.braked = np.zeros(n), np.zeros(n, np.bool_)
        self._arguments = (
            pointer(np.array(devices, np.int32), "const int32_t", n),
            n,
            pointer(self.command, "double", n),
            pointer(self.braked, "uint8_t", n),
        )

    def __getitem__(self, field: str) -> NDArray[Any]:
        """What they report or were told, (n,); a view."""
        return self._columns[field]

    def update(self) -> None:
        """Take what they do now."""
        lib.peers_drives(self._peers.core, *self._arguments)
