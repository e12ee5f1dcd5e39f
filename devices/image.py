"""The process image: the inputs and outputs of all devices, latched and composed once per tick."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..binding import bind
from ._wire import ffi, lib
from .device import Quantity, Word
from .dictionary import WIRE_TYPES
from .errors import FrameError, NetworkError
from .frames import Frames
from .network import Network, Place

_STATUS = np.dtype(
    [
        ("missed", np.int32),
        ("heartbeat_age", np.int32),
        ("emcy", np.uint16),
        ("fresh", np.bool_),
        ("al_state", np.uint8),
        ("nmt_state", np.uint8),
        ("lost", np.bool_),
        ("running", np.bool_),
        ("struck", np.uint8),
    ]
)
COUNTERS: tuple[str, ...] = tuple(name for name, _ in ffi.typeof("image_counters").fields)
_TALLY = np.dtype([(name, np.int64) for name in COUNTERS])


class Emergency(NamedTuple):
    """An EMCY message.

    Attributes:
        device: index into the network's devices.
        code: error code of CiA 301, 0x00xx = reset.
        error_register: object 1001h.
        vendor: five bytes of the manufacturer's own.
    """

    device: int
    code: int
    error_register: int
    vendor: bytes

    @property
    def gone(self) -> bool:
        """Whether it says that an error is gone."""
        return not self.code & 0xFF00


class ProcessImage:
    """Views of one tick's inputs and outputs; every array is a view that stays valid.

    Quantities are float64 in SI units, `image["joints.position"]`: (devices,), or (devices, components)
    where a field has several. Words are uint32, `image.word("joints.statusword")`: (devices,).
    A device that missed a tick keeps its last inputs.

    Attributes:
        network: the layout.
        expected: number of devices.
        fresh: (devices,) bool, its TPDO of this tick arrived.
        missed: (devices,) consecutive ticks without a fresh TPDO.
        al_state: (devices,) `AlState` of the last fresh TPDO.
        nmt_state: (devices,) `NmtState` of the last heartbeat, 255 = never heard.
        heartbeat_age: (devices,) ticks since the last heartbeat.
        lost: (devices,) bool, it rebooted or left operational after its first fresh TPDO.
        emcy: (devices,) code of the last emergency, 0 = none or reset; an error that is reset within its
            tick stands for that tick.
        counters: (16,) int64, events since set-up, in the order of `COUNTERS`.
        raw: (raw_size,) bytes as on the wire: TPDOs, then the payloads of the output frames.
    """

    def __init__(self, network: Network) -> None:
        self.network = network
        self.expected = len(network.devices)
        self._core = ffi.new("image *")
        self._inputs, self._outputs = (
            {kind: network.blank(kind, output=output) for kind in (Quantity, Word)}
            for output in (False, True)
        )
        self.raw: NDArray[np.uint8] = np.zeros(network.raw_size, np.uint8)
        tally, status = np.zeros(1, _TALLY), np.zeros(self.expected, _STATUS)
        self.counters: NDArray[np.int64] = tally.view(np.int64)
        self.missed: NDArray[np.int32] = status["missed"]
        self.heartbeat_age: NDArray[np.int32] = status["heartbeat_age"]
        self.emcy: NDArray[np.uint16] = status["emcy"]
        self.fresh: NDArray[np.bool_] = status["fresh"]
        self.al_state: NDArray[np.uint8] = status["al_state"]
        self.nmt_state: NDArray[np.uint8] = status["nmt_state"]
        self.lost: NDArray[np.bool_] = status["lost"]
        self._bad = np.zeros(len(network.outputs), np.uint8)
        self._bind(status, tally)
        self._latch = lib.image_latch
        self._compose = lib.image_compose
        self.reset()

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """The quantity "group.field", (devices,) or (devices, components).

        Raises:
            NetworkError: there is no such quantity.
        """
        return self._view(name, Quantity)

    def word(self, name: str) -> NDArray[np.uint32]:
        """The word "group.field", (devices,).

        Raises:
            NetworkError: there is no such word.
        """
        return self._view(name, Word)

    @property
    def working_counter(self) -> int:
        """Devices whose TPDO of this tick echoed the expected counter."""
        return int(self._core.working_counter)

    @property
    def calm(self) -> bool:
        """Whether this tick has nothing to tell of the bus.

        Every device answered from OP, none was lost, none reports an error, and no frame was discarded or
        intruding.
        """
        return bool(lib.image_calm(self._core))

    @property
    def discarded(self) -> int:
        """Frames of this tick that were dropped as stale, ahead or repeated."""
        return int(self._core.discarded)

    @property
    def intruding(self) -> int:
        """Frames of this tick that came from a second sender or a second master."""
        return int(self._core.intruding)

    @property
    def emergencies(self) -> list[Emergency]:
        """The EMCY messages of this tick, at most 16."""
        if not self._core.emergencies:  # nearly every tick
            return []
        events = self._core.emergency[0 : self._core.emergencies]
        return [Emergency(e.device, e.code, e.error_register, bytes(e.vendor)) for e in events]

    @property
    def not_finite(self) -> list[str]:
        """The outputs that were NaN or infinite at the last `compose`, as "device.field"."""
        return [self.network.field_at(self.network.outputs[i].raw) for i in np.flatnonzero(self._bad)]

    def reset(self) -> None:
        """Forgets what was heard of the devices; values and counters stay."""
        lib.image_reset(self._core)

    def latch(self, frames: Frames, counter: int) -> int:
        """Takes the frames of one tick; never fails, whatever they are.

        Args:
            frames: as received.
            counter: cycle counter of the last SYNC; the lowest 16 bits count.

        Returns:
            The working counter.
        """
        return int(self._latch(self._core, frames.pointer, counter & 0xFFFF))

    def compose(self, frames: Frames, counter: int, operational: bool) -> int:
        """Appends the output frames, SYNC last.

        Args:
            frames: to append to.
            counter: cycle counter of this tick; the lowest 16 bits are sent.
            operational: whether the outputs are valid. If not, they go out as zeros.

        Returns:
            The number of outputs that were not finite; they went out as zero, see `not_finite`.

        Raises:
            FrameError: no room in `frames`.
        """
        result = int(self._compose(self._core, frames.pointer, counter & 0xFFFF, operational))
        if result < 0:
            raise FrameError("no room for the output frames of this tick")
        return result

    def _view(self, name: str, kind: type) -> NDArray[Any]:
        field = self.network.fields.get(name)
        if field is None or field.kind is not kind:
            known = ", ".join(n for n, f in self.network.fields.items() if f.kind is kind)
            raise NetworkError("", f"there is no {kind.__name__.lower()} {name!r}; there are {known}")
        return field.of((self._outputs if field.output else self._inputs)[field.kind])

    def _bind(self, status: NDArray[np.void], tally: NDArray[np.void]) -> None:
        core, network = self._core, self.network
        core.devices = len(network.devices)
        core.outputs = len(network.outputs)
        core.output_frames = len(network.output_frames)
        core.raw_outputs = network.raw_size - network.raw_inputs
        bind(
            lib,
            core,
            values=self._inputs[Quantity],
            words=self._inputs[Word],
            output_values=self._outputs[Quantity],
            output_words=self._outputs[Word],
            output_bad=self._bad,
            raw_in=self.raw[: network.raw_inputs],
            raw_out=self.raw[network.raw_inputs :],
            status=status,
            counters=tally,
        )
        self._bind_tables()

    def _bind_tables(self) -> None:
        core, network = self._core, self.network
        inputs = [place for place in network.inputs if place.field]
        devices, frames = [], []
        ffi.memmove(core.device_of_node, bytes([lib.IMAGE_NO_DEVICE] * 128), 128)
        for i, device in enumerate(network.devices):
            own = [k for k, place in enumerate(inputs) if place.device == i]
            devices.append(
                {
                    "raw": network.tpdo_raw[i],
                    "first": own[0] if own else 0,
                    "entries": len(own),
                    "node": device.node,
                    "length": network.tpdo_length[i],
                }
            )
            core.device_of_node[device.node] = i
        for frame in network.output_frames:
            frames.append({"id": frame.can_id, "raw": frame.raw - network.raw_inputs, "length": frame.length})
        bind(
            lib,
            core,
            device=ffi.new("image_device[]", devices),
            output_frame=ffi.new("image_output_frame[]", frames),
            input=ffi.new("image_entry[]", [self._entry(p, self._tpdo_start(p)) for p in inputs]),
            output=ffi.new("image_entry[]", [self._entry(p, network.raw_inputs) for p in network.outputs]),
        )

    def _tpdo_start(self, place: Place) -> int:
        return self.network.tpdo_raw[place.device]

    def _entry(self, place: Place, start: int) -> dict[str, Any]:
        """A row of the C tables; offsets count from `start` in the raw image."""
        field = place.field
        return {
            "scale": field.scale if isinstance(field, Quantity) else 1.0,
            "shift": field.shift if isinstance(field, Quantity) else 0.0,
            "target": self.network.target(place),
            "offset": place.raw - start,
            "type": WIRE_TYPES[place.mapped.data_type][0],
            "word": isinstance(field, Word),
        }
