"""Re-runs a recorded session through the same cycle and compares what it does, bit for bit."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import islice
from typing import Any

import msgspec

from ...configs.words import counted
from ...devices.errors import DeviceError, FrameError
from ...models import ModelError
from ..configuration.session import Session, build, fingerprint
from ..core.modes import Command
from ..core.tick import Inputs
from ..errors import ConfigError, LogModelError
from .log import Log, environment
from .record import NO_TIMING, Record, RecordWriter, differences, parse

KEPT = 20
"""Differing fields of the first differing tick that are reported."""


class Difference(msgspec.Struct, frozen=True):
    """A field that came out otherwise."""

    tick: int
    field: str
    recorded: Any
    replayed: Any


class Verification(msgspec.Struct, frozen=True):
    """What a replay found.

    Attributes:
        ticks: replayed.
        differing_ticks: how many differ.
        first: the fields of the first differing tick, the most telling one first.
        speed_x: session time per wall-clock time.
        environment: what differs between this computer and the recording's; bit-for-bit equality is not to
            be expected where this is not empty.
        missing_ticks: that the recorder lost; what follows them cannot come out the same.
    """

    ticks: int
    differing_ticks: int
    first: list[Difference]
    speed_x: float
    environment: dict[str, tuple[str, str]]
    missing_ticks: int = 0


def replay(log: Log, progress: Callable[[int], None] = lambda _: None) -> Verification:
    """Re-run every tick of a recording; ``progress`` is called with the number of ticks done.

    Raises:
        LogModelError: this program lays the process image out differently than the recording's did.
        LogError: the recording is damaged.
    """
    try:
        session = build(log.loaded)
    except (ConfigError, ModelError, DeviceError) as error:
        raise LogModelError(
            log.path, f"keeps a machine that is refused here:\n{error}\n", log.its_version
        ) from error
    here = fingerprint(session)
    for name, what in (("config", "configuration"), ("model", "model"), ("layout", "process image")):
        if log.hashes.get(name) != here[name]:
            raise LogModelError(
                log.path,
                f"was recorded with another {what} than the one it is replayed with",
                "use the version of hapticd and of the device descriptions it was recorded with",
            )
    cycle, inputs = session.cycle, Inputs()
    writer = RecordWriter(cycle)
    if writer.fixed.dtype != log.dtype:
        raise LogModelError(log.path, "keeps other fields of a tick", log.its_version)
    ticks = differing = missing = 0
    last = -1
    first: list[Difference] = []
    start = time.monotonic()
    for record in log.records():
        fixed = record.fixed
        damage = _unpack(record, inputs)
        inputs.tick, inputs.skipped = int(fixed["tick"]), int(fixed["skipped"])
        missing += max(0, inputs.tick - inputs.skipped - last - 1)
        last = inputs.tick
        inputs.commands = Command(int(fixed["commands"]))
        cycle.run(inputs)
        data = writer.write(inputs, NO_TIMING)
        if not record.same_as(data):
            differing += 1
            first = first or damage + _explain(record, data, session)
        ticks += 1
        progress(ticks)
    seconds = max(time.monotonic() - start, 1e-9)
    return Verification(
        ticks=ticks,
        differing_ticks=differing,
        first=first,
        speed_x=round(ticks / session.config.loop.rate / seconds, 2),
        environment=_environment(log),
        missing_ticks=missing,
    )


def _unpack(record: Record, inputs: Inputs) -> list[Difference]:
    """The recorded frames as inputs; bytes that are no frames any more are a difference by themselves."""
    try:
        inputs.frames.unpack(record.frames_in)
    except FrameError as error:
        inputs.frames.clear()
        return [Difference(int(record.fixed["tick"]), "frames received", str(error), "none")]
    return []


def _explain(recorded: Record, data: bytes, session: Session) -> list[Difference]:
    replayed = parse(data, recorded.fixed.dtype)
    assert replayed is not None
    tick = int(recorded.fixed["tick"])
    found = differences(recorded, replayed, session.network)
    return [Difference(tick, *difference) for difference in islice(found, KEPT)]


def _environment(log: Log) -> dict[str, tuple[str, str]]:
    return {
        name: (log.session.get(name, ""), value)
        for name, value in environment().items()
        if log.session.get(name, "") != value
    }


def describe(found: Verification) -> str:
    """The result for people."""
    lines = [
        f"{counted(found.ticks, 'tick')}, {found.differing_ticks} differ ({found.speed_x:g} times real time)"
    ]
    if found.first:
        lead = found.first[0]
        lines.append(
            f"first at tick {lead.tick}: {lead.field} recorded {lead.recorded}, replayed {lead.replayed}"
        )
        lines += [f"    also {d.field}: {d.recorded} / {d.replayed}" for d in found.first[1:]]
    if found.missing_ticks:
        lost = counted(found.missing_ticks, "tick")
        lines.append(f"note: {lost} not in the recording; what follows cannot come out the same")
    for name, (there, here) in found.environment.items():
        lines.append(f"note: {name} was '{there}', here '{here}'; last bits may differ for that reason")
    return "\n".join(lines)
