"""CAN interfaces, as `ip -json -details link show` describes them."""

from __future__ import annotations

from typing import Any

import pytest
from hapticd.configs.quantities import BitRate
from hapticd.runtime.core.sections import PythonCanBus, SocketCanBus
from hapticd.runtime.doctor.can import can_line, can_lines
from hapticd.runtime.doctor.line import Line, State


def can(**changes: Any) -> dict[str, Any]:
    """A healthy CAN FD interface with changes; a value None removes its key."""
    data = {
        "ctrlmode": ["FD"],
        "state": "ERROR-ACTIVE",
        "berr_counter": {"tx": 0, "rx": 0},
        "restart_ms": 0,
        "bittiming": {"bitrate": 1000000, "sample_point": "0.800"},
        "data_bittiming": {"bitrate": 5000000, "sample_point": "0.750"},
    }
    link = {"ifname": "can0", "flags": ["NOARP", "UP", "LOWER_UP", "ECHO"], "mtu": 72, "txqlen": 1000}
    link |= {key: value for key, value in changes.items() if key in link}
    data |= {key: value for key, value in changes.items() if key in data}
    return {**link, "linkinfo": {"info_kind": "can", "info_data": data}}


VIRTUAL = {"ifname": "vcan0", "flags": ["UP"], "mtu": 72, "linkinfo": {"info_kind": "vcan"}}


def test_a_healthy_interface_says_its_bit_timing() -> None:
    line = can_line(can())
    assert line.check == "can_can0"
    assert line.state is State.PASS
    assert line.found == "ERROR-ACTIVE, 1 Mbit/s at 80.0% and 5 Mbit/s at 75.0%"
    assert line.fix == ""


@pytest.mark.parametrize(
    ("changes", "state", "found", "fix"),
    [
        ({"flags": ["NOARP", "ECHO"]}, State.FAIL, "is down", "bitrate 1000000 dbitrate 5000000 fd on"),
        ({"state": "BUS-OFF"}, State.FAIL, "off the bus", "ip link set can0 down; sudo ip link set can0 up"),
        ({"mtu": 16}, State.FAIL, "not in CAN FD mode (mtu 16)", "fd on"),
        (
            {"state": "ERROR-PASSIVE", "berr_counter": {"tx": 128, "rx": 3}},
            State.WARN,
            "ERROR-PASSIVE: 128 errors sending, 3 receiving",
            "termination",
        ),
        (
            {"data_bittiming": {"bitrate": 5000000, "sample_point": "0.5"}},
            State.WARN,
            "samples at 50.0% of a bit",
            "sample-point 0.8 dsample-point 0.75 fd on",
        ),
        ({"txqlen": 10}, State.WARN, "only 10 frames", "sudo ip link set can0 txqueuelen 1000"),
        ({"flags": [], "mtu": 16, "txqlen": 10}, State.FAIL, "is down", "fd on"),  # the worst is said
    ],
)
def test_what_is_wrong_is_said_with_the_command(
    changes: dict[str, Any], state: State, found: str, fix: str
) -> None:
    line = can_line(can(**changes))
    assert line.state is state
    assert found in line.found
    assert fix in line.fix


def test_a_virtual_interface_needs_its_mtu_only() -> None:
    assert can_line(VIRTUAL).state is State.PASS
    line = can_line({**VIRTUAL, "mtu": 16})
    assert line.state is State.FAIL
    assert line.fix == "sudo ip link set vcan0 down; sudo ip link set vcan0 mtu 72 up"


def test_without_a_configuration_every_can_interface_is_looked_at() -> None:
    ethernet = {"ifname": "eth0", "flags": ["UP"], "mtu": 1500}
    assert [line.check for line in can_lines([ethernet, can(), VIRTUAL], None)] == ["can_can0", "can_vcan0"]
    (line,) = can_lines([ethernet], None)
    assert line.state is State.PASS
    assert "no interface" in line.found


def test_a_configuration_asks_for_its_own_interface() -> None:
    assert [line.check for line in can_lines([can(), VIRTUAL], SocketCanBus(interface="vcan0"))] == [
        "can_vcan0"
    ]
    (line,) = can_lines([VIRTUAL], SocketCanBus(interface="can7", data_bitrate=BitRate(2e6)))
    assert line.state is State.FAIL
    assert "ip link set can7 up type can bitrate 1000000 dbitrate 2000000 fd on" in line.fix
    assert "ip link add dev can7 type vcan" in line.fix


@pytest.mark.parametrize(
    ("rates", "found"),
    [
        ((1e6, 5e6), ""),
        ((None, None), ""),
        ((5e5, 5e6), "has bitrate 1 Mbit/s, not 0.5 Mbit/s as [bus] says"),
        ((1e6, 8e6), "has data_bitrate 5 Mbit/s, not 8 Mbit/s as [bus] says"),
        ((5e5, 8e6), "has bitrate 1 Mbit/s, not 0.5 Mbit/s and data_bitrate 5 Mbit/s, not 8 Mbit/s as"),
    ],
)
def test_other_bit_rates_than_the_configuration_s_fail_with_the_command(
    rates: tuple[float | None, float | None], found: str
) -> None:
    nominal, data = (None if rate is None else BitRate(rate) for rate in rates)
    line = can_line(can(), SocketCanBus(interface="can0", bitrate=nominal, data_bitrate=data))
    assert line.state is (State.FAIL if found else State.PASS)
    assert found in line.found
    if nominal and data and found:
        assert line.fix == (
            "sudo ip link set can0 down; sudo ip link set can0 up type can "
            f"bitrate {nominal:.0f} dbitrate {data:.0f} fd on"
        )


def test_a_virtual_interface_has_no_bit_rates_to_be_wrong() -> None:
    bus = SocketCanBus(interface="vcan0", bitrate=BitRate(5e5), data_bitrate=BitRate(2e6))
    assert can_line(VIRTUAL, bus).state is State.PASS


def python_can_line(rate: float = 250.0, devices: int = 12, **changes: Any) -> Line:
    bus = PythonCanBus(**{"interface": "virtual", "channel": "x", **changes})
    (line,) = can_lines([can()], bus, devices, rate)
    return line


def test_an_interface_of_python_can_is_loaded_and_not_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("can.interfaces.virtual.VirtualBus.__init__", lambda *_: 1 / 0)
    monkeypatch.setattr("hapticd.devices.python_can._known_settings", lambda _: {"fd"})
    line = python_can_line()
    assert (line.check, line.state) == ("can_virtual", State.PASS)
    assert "was not opened" in line.found


@pytest.mark.parametrize(
    ("changes", "state", "found", "fix"),
    [
        ({"interface": "pcam"}, State.FAIL, "no such interface", 'Did you mean "pcan"?'),
        ({"interface": "slcan"}, State.FAIL, "no CAN FD", "Take one that does"),
        ({"settings": {"prot": 1}}, State.FAIL, "no setting 'prot'", "It has: "),
        ({"bitrate": BitRate(1e6)}, State.FAIL, "takes no bitrate", "Leave it out"),
        (
            {"rate": 1000.0},
            State.WARN,
            "python-can takes about 234 us of a tick of 1000 us",
            "at most 641 Hz, or use SocketCAN",
        ),
        ({"rate": 600.0}, State.PASS, "", ""),
        ({"rate": 1000.0, "devices": 6}, State.PASS, "", ""),
    ],
)
def test_what_is_wrong_with_an_interface_of_python_can_is_said(
    changes: dict[str, Any], state: State, found: str, fix: str
) -> None:
    line = python_can_line(**changes)
    assert line.state is state
    assert found in line.found
    assert fix in line.fix


def test_a_package_that_is_missing_is_named_with_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hapticd.devices.python_can._installed", lambda package: False)
    line = python_can_line(interface="udp_multicast", channel="239.74.163.2")
    assert line.state is State.WARN
    assert "msgpack is missing" in line.found
    assert "-m pip install 'python-can[multicast]'" in line.fix
