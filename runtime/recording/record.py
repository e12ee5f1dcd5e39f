"""What the log keeps of a tick: a fixed part, then the frames of both directions as they were."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...devices.network import Network
from ...devices.safety_plc import GROUP
from ..core.cycle import Cycle
from ..core.stages import NO_STAGES, Stage
from ..core.tick import Inputs

Timing = tuple[int, int, bytes]
"""Lateness and compute time [ns], durations of the stages."""
NO_TIMING: Timing = (0, 0, NO_STAGES)
"""Timing in lockstep and replay."""

TIMING = ("lateness_ns", "compute_ns", "stage_ns")
"""Durations: the only fields that a replay does not reproduce."""
INPUTS = ("tick", "skipped", "commands", "in_bytes")
"""Fields that a replay takes from the log instead of computing them."""

HEAD = (
    ("tick", "<u8", "Q"),
    ("skipped", "<u4", "I"),
    ("commands", "u1", "B"),
    ("mode", "u1", "B"),
    ("reaction", "u1", "B"),
    ("latched", "u1", "B"),
    ("reason", "S24", "24s"),
    ("working_counter", "<u2", "H"),
    ("digest", "<u4", "I"),
    ("frames", "<u2", "H"),
    ("discarded", "<u2", "H"),
    ("silent", "<u2", "H"),
    ("in_bytes", "<u2", "H"),
    ("out_bytes", "<u2", "H"),
    ("lateness_ns", "<i8", "q"),
    ("compute_ns", "<i8", "q"),
    ("stage_ns", f"({len(Stage)},)<u4", f"{len(NO_STAGES)}s"),
    ("gain", "<f8", "d"),
    ("trust", "<f8", "d"),
)
"""Name, type and struct code of the scalars that every record begins with.

``frames`` were received, ``discarded`` of them as stale, ahead or repeated; the safety controllers were
``silent`` for so many ticks.
"""
LONGEST_SILENCE = 0xFFFF
_HEAD = struct.Struct("<" + "".join(code for _, _, code in HEAD))
_NAMES = [name for name, _, _ in HEAD]
_TIMED = slice(
    struct.calcsize("<" + "".join(code for _, _, code in HEAD[: _NAMES.index(TIMING[0])])),
    struct.calcsize("<" + "".join(code for _, _, code in HEAD[: _NAMES.index(TIMING[-1]) + 1])),
)
"""Bytes of a record that hold its durations."""


def layout(state: np.dtype[np.void], axes: int, raw_bytes: int) -> np.dtype[np.void]:
    """Structure of the fixed part for a machine: scalars, admitted commands, its state, the process image."""
    head = [(name, kind) for name, kind, _ in HEAD]
    return np.dtype([*head, ("admitted", "<f8", axes), ("state", state), ("raw", "u1", raw_bytes)])


def head(fixed: np.void) -> dict[str, Any]:
    """The scalars that a record begins with, from its fixed part; by name numpy takes ten times as long."""
    data: Any = fixed  # a buffer, which its type conceals
    return dict(zip(_NAMES, _HEAD.unpack_from(data), strict=True))


def describe(dtype: np.dtype[np.void]) -> str:
    """The structure as JSON, for readers that are not this program."""
    return json.dumps(dtype.descr)


class RecordWriter:
    """Fills the one record buffer of a session.

    Attributes:
        fixed: the fixed part of the tick, (1,).
    """

    def __init__(self, cycle: Cycle) -> None:
        machine, image = cycle.machine, cycle.image
        self._cycle = cycle
        self.fixed = np.zeros(1, layout(machine.state, len(machine.axes), len(image.raw)))
        self._bytes = self.fixed.view(np.uint8).data
        self._switches = [k for k, d in enumerate(image.network.devices) if d.group == GROUP]
        self._admitted, self._raw = self.fixed["admitted"][0], self.fixed["raw"][0]
        machine.bind_state(self.fixed["state"])

    @property
    def usual_bytes(self) -> int:
        """About the size of a record: its frames carry the process image, and their headers are shorter."""
        return int(self.fixed.itemsize + 2 * self._raw.size)

    def write(self, inputs: Inputs, timing: Timing) -> bytes:
        """The record of a tick."""
        cycle, latch, verdict = self._cycle, self._cycle.stops.latch, self._cycle.outputs.verdict
        out = cycle.outputs.frames.pack()
        standing = latch.trip.verdict if latch.trip else verdict
        _HEAD.pack_into(
            self._bytes,
            0,
            *(inputs.tick, inputs.skipped, int(inputs.commands)),
            *(cycle.mode, verdict.reaction, latch.reaction, standing.reason.encode()),
            *(cycle.image.working_counter, cycle.digest),
            *(len(inputs.frames), cycle.image.discarded, self._silent(), len(cycle.packed), len(out)),
            *timing,
            *(cycle.phase.gain, cycle.senses.trust),
        )
        self._admitted[:] = cycle.gate.admitted
        cycle.machine.fill()
        self._raw[:] = cycle.image.raw
        return b"".join((self._bytes, cycle.packed, out))

    def _silent(self) -> int:
        """Ticks since every safety controller was heard."""
        image = self._cycle.image
        if image.calm or not self._switches:
            return 0
        return min(LONGEST_SILENCE, int(image.missed[self._switches].max()))


@dataclass(frozen=True, slots=True)
class Record:
    """A record as read: its bytes, the fixed part of them, and the frames of both directions."""

    data: bytes
    fixed: np.void
    frames_in: bytes
    frames_out: bytes

    def same_as(self, data: bytes) -> bool:
        """Whether a replayed record equals this one in everything but its durations."""
        return (
            self.data[: _TIMED.start] == data[: _TIMED.start]
            and self.data[_TIMED.stop :] == data[_TIMED.stop :]
        )


def parse(data: bytes, dtype: np.dtype[np.void]) -> Record | None:
    """A record from its bytes, None where they are not one."""
    size = dtype.itemsize
    if len(data) < size:
        return None
    fixed = np.frombuffer(data, dtype, 1)[0]
    split = size + int(fixed["in_bytes"])
    if len(data) != split + int(fixed["out_bytes"]):
        return None
    return Record(data, fixed, data[size:split], data[split:])


def differences(recorded: Record, replayed: Record, network: Network) -> Iterator[tuple[str, object, object]]:
    """Fields in which a replayed tick differs: name, recorded value, replayed value.

    The inputs' own bytes come first: they name the device and object that was changed.
    """
    fixed = replayed.fixed
    before, after = recorded.fixed["raw"], fixed["raw"]
    for at in np.flatnonzero(before != after):
        yield network.field_at(int(at)), int(before[at]), int(after[at])
    for name in fixed.dtype.names or ():
        if name not in (*TIMING, *INPUTS, "raw", "state", "digest"):
            yield from _compare(name, recorded.fixed[name], fixed[name])
    for name in fixed["state"].dtype.names or ():
        yield from _compare(f"state.{name}", recorded.fixed["state"][name], fixed["state"][name])
    if recorded.frames_out != replayed.frames_out:
        yield "frames sent", recorded.frames_out.hex(), replayed.frames_out.hex()
    yield from _compare("frames received (digest)", recorded.fixed["digest"], fixed["digest"])


def _compare(name: str, before: object, after: object) -> Iterator[tuple[str, object, object]]:
    a, b = np.asarray(before), np.asarray(after)
    if a.tobytes() == b.tobytes():  # bit for bit: NaN equals NaN, -0 differs from 0
        return
    if a.ndim == 0:
        yield name, a.item(), b.item()
        return
    for at in np.ndindex(a.shape):
        if a[at].tobytes() != b[at].tobytes():
            yield f"{name}[{','.join(map(str, at))}]", a[at].item(), b[at].item()
