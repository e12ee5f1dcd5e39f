"""The machines of a run, and which of their devices the suite tries."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import msgspec
import pytest

from ..devices.device import Device, Quantity, Word
from ..devices.safety_plc import SafetyPlc
from ..runtime.configuration import config
from ..runtime.errors import ConfigError

MACHINE = "machine_name"
"""Every test of the suite takes this, or the fixture that does."""


@functools.cache
def load(name: str) -> config.Loaded:
    """The configuration of a name or a path, as it is.

    Raises:
        pytest.UsageError: it is none, or simulates nothing.
    """
    try:
        loaded = config.load(name)
    except ConfigError as error:
        raise pytest.UsageError(str(error)) from error
    if loaded.config.simulation is None:
        problem = f"{name}: has no [simulation], and the suite is judged by the simulated plant"
        raise pytest.UsageError(problem)
    return loaded


def unpressed(loaded: config.Loaded, arming: str = "dead-man") -> config.Loaded:
    """The same where nobody presses the dead-man switch but the test."""
    simulation = loaded.config.simulation
    assert simulation is not None
    hand = msgspec.structs.replace(simulation.hand, dead_man=())
    changed = msgspec.structs.replace(
        loaded.config,
        arming=msgspec.structs.replace(loaded.config.arming, by=arming),
        simulation=msgspec.structs.replace(simulation, hand=hand),
    )
    return replace(loaded, config=changed)


def parametrize(metafunc: pytest.Metafunc, names: Sequence[str]) -> None:
    """Over the machines, and with them over what a test asks for of each.

    ``drive_name`` are the first and the last drive of every group, ``part_name`` these and every sensor,
    ``device_name`` these and the safety controller; ``sensor_field`` are the numbers that sensors report.
    """
    asked = [name for name in ROWS if name in metafunc.fixturenames]
    assert len(asked) <= 1, asked
    if not asked:
        metafunc.parametrize(MACHINE, names, scope="module")
        return
    rows = [(name, case) for name in names for case in ROWS[asked[0]](load(name).config.devices.values())]
    ids = [f"{name}-{case if isinstance(case, str) else '.'.join(case)}" for name, case in rows]
    metafunc.parametrize((MACHINE, asked[0]), rows, ids=ids)


def is_drive(device: Device) -> bool:
    """Whether it has a power stage."""
    return Word("controlword") in device.outputs().values()


def _drives(devices: Iterable[Device]) -> list[str]:
    groups: dict[str, list[str]] = {}
    for device in filter(is_drive, devices):
        groups.setdefault(device.group, []).append(device.name)
    return [name for group in groups.values() for name in dict.fromkeys((group[0], group[-1]))]


def _sensors(devices: Iterable[Device]) -> Iterator[Device]:
    return (device for device in devices if not (is_drive(device) or isinstance(device, SafetyPlc)))


def _fields(devices: Iterable[Device]) -> list[tuple[str, str]]:
    """Numbers that sensors report, as (device, field)."""
    found = {
        (device.name, field.field): None
        for device in _sensors(devices)
        for field in device.inputs().values()
        if isinstance(field, Quantity)
    }
    return list(found)


def _parts(devices: Iterable[Device]) -> list[str]:
    devices = list(devices)
    return [*_drives(devices), *(device.name for device in _sensors(devices))]


def _all(devices: Iterable[Device]) -> list[str]:
    devices = list(devices)
    return [*_parts(devices), *(device.name for device in devices if isinstance(device, SafetyPlc))]


ROWS: dict[str, Callable[[Iterable[Device]], list[Any]]] = {
    "drive_name": _drives,
    "sensor_field": _fields,
    "part_name": _parts,
    "device_name": _all,
}
