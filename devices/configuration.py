"""The SDO script that makes one device ready: who are you, what do you map, these are your settings."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping
from typing import Final

from . import sdo
from .cia301 import (
    HEARTBEAT_TIME,
    OUTPUT_WATCHDOG,
    RPDO_MAPPING,
    SERIAL,
    SLOT_FRAME,
    SLOT_OFFSET,
    TPDO,
    TPDO_COB_ID,
    TPDO_MAPPING,
    TPDO_TRANSMISSION,
    Address,
)
from .device import Device
from .dictionary import Mapped, Value
from .errors import MismatchError
from .network import Slot

Script = Generator[bytes, bytes, None]

EVERY_SYNC: Final = 1


def configure(device: Device, slot: Slot | None, heartbeat_ms: int, watchdog_ms: int) -> Script:
    """Checks and configures a device that is in PREOP.

    Args:
        device: what it should be.
        slot: where it finds its outputs, or None.
        heartbeat_ms: period of its heartbeat.
        watchdog_ms: how long it keeps its outputs without a new SYNC.

    Yields:
        SDO requests; it is sent the responses.

    Raises:
        MismatchError: it is not what it should be, or did not keep a setting.
        SdoError: a transfer failed.
        EdsError: an object that its EDS does not have, or a value that the object cannot hold.
    """
    dictionary = device.dictionary
    yield from _expect(
        device, dictionary.identity, f"Another device has this node id, or {device.eds} is not its EDS"
    )
    if device.serial is not None:
        yield from _expect(
            device,
            {SERIAL: device.serial},
            "It was exchanged: check its calibration, then enter the new serial number",
        )
    yield from _expect(
        device,
        _mapping(TPDO_MAPPING, dictionary.tpdo) | _mapping(RPDO_MAPPING, dictionary.rpdo),
        f"Let the device map what {device.eds} says, or use the EDS that says what it maps",
    )
    yield from _expect(
        device,
        {TPDO_COB_ID: TPDO + device.node, **device.facts()},
        "Correct the configuration or the device: every value in SI units depends on it",
    )
    settings: dict[Address, Value] = {
        HEARTBEAT_TIME: heartbeat_ms,
        TPDO_TRANSMISSION: EVERY_SYNC,
        **device.settings(),
    }
    if slot:
        settings |= {SLOT_FRAME: slot.frame, SLOT_OFFSET: slot.offset, OUTPUT_WATCHDOG: watchdog_ms}
    for address, value in settings.items():
        yield from sdo.download(device.node, *address, dictionary.encode(address, value))
    yield from _expect(device, settings, "It did not keep the setting: is it write-protected?")


def _expect(device: Device, values: Mapping[Address, Value], remedy: str) -> Script:
    dictionary = device.dictionary
    for address, value in values.items():
        wanted = dictionary.encode(address, value)
        data = yield from sdo.upload(device.node, *address, len(wanted))
        expected = dictionary.decode(address, wanted)
        got = dictionary.decode(address, data)
        if got != expected:
            raise MismatchError(device.name, device.node, *address, expected, got, remedy)


def _mapping(index: int, mapped: Iterable[Mapped]) -> dict[Address, Value]:
    """What a mapping record should say; nothing where nothing is mapped."""
    entries: dict[Address, Value] = {(index, i): m.entry for i, m in enumerate(mapped, 1)}
    return {(index, 0): len(entries), **entries} if entries else {}
