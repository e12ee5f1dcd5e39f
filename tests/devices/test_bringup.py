from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest
from hapticd.devices.bringup import REQUESTS_PER_TICK, Bringup, BringupState, Deadlines
from hapticd.devices.cia301 import AlState
from hapticd.devices.device import Device
from hapticd.devices.errors import (
    ConfigurationTimeoutError,
    DeviceError,
    MismatchError,
    MissingDevicesError,
    SilentDeviceError,
    StartError,
    TransferError,
)
from hapticd.sim.node import SimNode
from msgspec.structs import replace

if TYPE_CHECKING:
    from ..conftest import Rig


def test_bring_up_ends_with_all_devices_in_safeop(rig: Rig) -> None:
    rig.bring_up()
    assert {node.al_state for node in rig.nodes.nodes} == {AlState.SAFEOP}
    rig.run(1, operational=False)
    assert rig.image.working_counter == rig.image.expected == 12
    assert not rig.image.missed.any()
    assert not rig.image.lost.any()
    assert rig.counter < 150
    assert {name: rig.count(name) for name in ("foreign", "unknown", "stale", "misses")} == {
        "foreign": 0,
        "unknown": 0,
        "stale": 0,
        "misses": 0,
    }


def test_every_device_is_configured_as_the_layout_says(rig: Rig) -> None:
    rig.bring_up(Bringup(rig.image, rig.deadlines, heartbeat_ms=50, watchdog_ms=15))
    for node, slot in zip(rig.nodes.nodes, rig.network.slots, strict=True):
        assert node.objects.read((0x1017, 0)) == 50
        if slot:
            assert node.objects.read((0x2101, 1)) == slot.frame
            assert node.objects.read((0x2101, 2)) == slot.offset
            assert node.objects.read((0x2102, 0)) == 15


def test_bring_up_works_again_on_devices_that_are_running(enabled: Rig) -> None:
    enabled.bring_up()
    assert {node.al_state for node in enabled.nodes.nodes} == {AlState.SAFEOP}


def test_bring_up_leaves_the_bus_to_sync(rig: Rig) -> None:
    bringup = Bringup(rig.image, rig.deadlines)
    while bringup.state is not BringupState.READY:
        rig.tick(lambda: bringup.step(rig.incoming, rig.outgoing))
        assert len(rig.outgoing) <= REQUESTS_PER_TICK + 2
        assert rig.outgoing[len(rig.outgoing) - 1][0] == 0x080


def test_progress_is_told_in_words(rig: Rig) -> None:
    bringup = Bringup(rig.image, rig.deadlines)
    told = [bringup.progress]
    while bringup.state is not BringupState.READY:
        rig.tick(lambda: bringup.step(rig.incoming, rig.outgoing))
        told.append(bringup.progress)
    assert told[:2] == [
        "resetting",
        "waiting for boot-up: " + ", ".join(d.name for d in rig.network.devices),
    ]
    assert told[3].startswith("configuring: 0 of 12 done; joint1 1008h:00, joint2")
    assert told[-2:] == ["waiting for SAFEOP", "ready"]


def fails(rig: Rig, error: type[DeviceError], match: str, deadlines: Deadlines | None = None) -> DeviceError:
    with pytest.raises(error, match=match) as caught:
        rig.bring_up(Bringup(rig.image, deadlines or rig.deadlines))
    return caught.value


def test_missing_devices_are_all_named(rig: Rig) -> None:
    rig.run(1, operational=False)  # what they sent when they were switched on does not count
    rig.nodes["joint3"].silent = rig.nodes["imu_handle"].silent = True
    error = fails(
        rig,
        MissingDevicesError,
        r"no boot-up message within 20 ticks from joint3 \(node 3\), imu_handle \(node 11\)\. Check power",
    )
    assert isinstance(error, MissingDevicesError)
    assert error.nodes == (3, 11)


def test_a_device_that_boots_but_does_not_answer_is_named(rig: Rig) -> None:
    rig.nodes["ft"].tamper = lambda can_id, data: [(can_id, data)] if can_id > 0x700 else []
    fails(rig, SilentDeviceError, r"ft \(node 9\) gave no answer for object 1008h:00 within 5 ticks")


@pytest.mark.parametrize(
    ("name", "address", "value", "match"),
    [
        (
            "joint2",
            (0x1018, 1),
            7,
            r"joint2 \(node 2\), object 1018h:01: expected .*, got 7 .*Another",
        ),
        ("joint2", (0x1018, 2), 2, r"1018h:02: expected 1 \(0x1\), got 2 \(0x2\)"),
        ("joint2", (0x1018, 3), 9, r"1018h:03: expected 65536 \(0x10000\), got 9"),
        (
            "imu_handle",
            (0x1008, 0),
            "something else",
            r"1008h:00: expected 'hapticd inertial unit', got",
        ),
        ("ppu_y", (0x1A00, 0), 6, r"1A00h:00: expected 7 \(0x7\), got 6.*Let the device map"),
        ("ppu_y", (0x1A00, 3), 0x60640020, r"1A00h:03: expected .*0x60410010.*got .*0x60640020"),
        ("plc", (0x1600, 1), 0x60400010, r"1600h:01: expected .*0x25010008"),
        ("joint5", (0x1800, 1), 0x80000185, r"1800h:01: expected 389 \(0x185\), got .*0x80000185"),
        ("joint5", (0x6076, 0), 90_000, r"6076h:00: expected 100000.*got 90000.*SI units depends"),
        ("joint5", (0x608F, 1), 4096, r"608Fh:01: expected 65536.*got 4096"),
        ("joint5", (0x6091, 1), 99, r"6091h:01: expected 100.*got 99"),
        ("ppu_x", (0x2203, 0), 1000, r"2203h:00: expected 1000000.*got 1000"),
    ],
)
def test_a_device_that_is_not_what_the_configuration_says_is_refused(
    rig: Rig, name: str, address: tuple[int, int], value: int, match: str
) -> None:
    node = rig.nodes[name]
    restore = node.objects.restore

    def restore_wrongly() -> None:
        restore()
        node.objects.write(address, value)

    node.objects.restore = restore_wrongly  # type: ignore[method-assign]
    error = fails(rig, MismatchError, match)
    assert isinstance(error, MismatchError)
    assert (error.index, error.subindex) == address
    assert error.got == value


def test_a_serial_number_is_insisted_on_where_one_is_given(
    make_rig: type[Rig], devices: list[Device]
) -> None:
    with_serial = [replace(devices[0], serial=4711), *devices[1:]]
    rig = make_rig(with_serial)
    rig.bring_up()
    node = rig.nodes["joint1"]
    restore = node.objects.restore

    def exchanged() -> None:
        restore()
        node.objects.write((0x1018, 4), 4712)

    node.objects.restore = exchanged  # type: ignore[method-assign]
    fails(rig, MismatchError, r"1018h:04: expected 4711 \(0x1267\), got 4712 .*exchanged: check")


@pytest.mark.parametrize(
    ("address", "code", "match"),
    [
        ((0x2102, 0), 0x06010002, r"joint1: node 1, object 2102h:00: aborted with 0x06010002 \(.*read only"),
        ((0x6060, 0), 0x06090030, r"6060h:00: aborted with 0x06090030"),
        ((0x1018, 1), 0x08000000, r"1018h:01.*General error.*Does joint_drive\.eds belong to the device"),
    ],
)
def test_an_abort_names_device_object_and_code(
    rig: Rig, address: tuple[int, int], code: int, match: str
) -> None:
    rig.nodes["joint1"].objects.refuse[address] = code
    fails(rig, TransferError, match)


def test_a_setting_that_the_device_does_not_keep_is_noticed(rig: Rig) -> None:
    objects = rig.nodes["joint1"].objects
    objects.set_data = lambda *args, **kwargs: None  # type: ignore[method-assign]
    fails(rig, MismatchError, r"1017h:00: expected 100 .*got 0 .*did not keep the setting")


def after_requests(node: SimNode, count: int, action: Callable[[], None]) -> None:
    """Calls `action` when the SDO server of the node has served `count` requests."""
    served = 0
    request = node.objects.request

    def counting(data: bytes) -> None:
        nonlocal served
        served += 1
        request(data)
        if served == count:
            action()

    node.objects.request = counting  # type: ignore[method-assign]


def test_a_device_that_restarts_meanwhile_is_configured_again(rig: Rig) -> None:
    node = rig.nodes["joint1"]
    after_requests(node, 20, node.reset)
    rig.bring_up()
    assert node.objects.read((0x1017, 0)) == 100


def test_a_device_that_restarts_again_and_again_is_given_up(rig: Rig) -> None:
    node = rig.nodes["ft"]
    request = node.objects.request

    def restarting(data: bytes) -> None:
        request(data)
        node.reset()

    node.objects.request = restarting  # type: ignore[method-assign]
    fails(rig, ConfigurationTimeoutError, r"ft not configured within 500 ticks.*check its supply")


def test_a_device_that_does_not_reach_safeop_is_named(rig: Rig) -> None:
    rig.nodes["imu_handle"].command = lambda command: None  # type: ignore[method-assign]
    fails(rig, StartError, r"not in SAFEOP within 10 ticks after NMT start: imu_handle \(UNKNOWN\)")


def test_garbage_on_the_bus_does_not_disturb_the_bring_up(rig: Rig) -> None:
    bringup = Bringup(rig.image, rig.deadlines)
    while bringup.state is not BringupState.READY:
        for data in (b"", b"\x43", bytes(64)):
            for can_id in (0x581, 0x585, 0x701, 0x77F, 0x181):
                if not (can_id == 0x701 and data == bytes(1)):
                    rig.incoming.append(can_id, data)
        rig.tick(lambda: bringup.step(rig.incoming, rig.outgoing))
    rig.run(1, operational=False)
    assert rig.image.working_counter == 12
