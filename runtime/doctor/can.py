"""CAN interfaces: of the kernel, as ``ip -json -details link`` tells them, or of python-can."""

from __future__ import annotations

from typing import Any

import can

from ...devices.errors import AdapterError
from ...devices.python_can import install_command, missing_packages, prepare
from ...devices.socket_adapter import CANFD_MTU, up_command
from ..configuration.bus import proposed_rates, rate, restart_command, slowness, told_rate, whole, wrong_rates
from ..core.sections import PythonCanBus, SocketCanBus
from .line import Line, State

WHY = "The daemon's frames need CAN FD; a bus that is down, passive or wrongly timed loses them."
WHY_PYTHON = "The daemon's bus is an interface of python-can, which needs its driver and CAN FD."
WHY_SLOW = "python-can moves frames one by one; what it takes of a tick makes ticks late, and answers, too."
SAMPLE_POINTS = (0.7, 0.9)
"""Where in a bit the usual controllers sample; outside, devices of other makers often disagree."""
SHORTEST_QUEUE = 64
"""Frames that may wait to be sent: one tick's, at bring-up, of the largest machine the wire can carry."""


def can_lines(
    links: list[dict[str, Any]],
    bus: SocketCanBus | PythonCanBus | None,
    devices: int = 0,
    loop_rate: float = 0.0,
) -> list[Line]:
    """A line for the bus that a configuration wants, or else for each CAN interface that there is.

    Args:
        links: of the host.
        bus: of the configuration; None where there is no configuration, or its bus is simulated.
        devices: how many there are on that bus.
        loop_rate: of its ticks [Hz].
    """
    if isinstance(bus, PythonCanBus):
        return [python_can_line(bus, devices, loop_rate)]
    found = [link for link in links if kind(link) in ("can", "vcan", "vxcan")]
    if bus is not None:
        name = bus.interface
        found = [link for link in found if link["ifname"] == name]
        if not found:
            up = up_command(name, *proposed_rates(bus))
            fix = f"plug the adapter in, then: {up}    # a virtual one: {up_virtual(name)}"
            return [Line(f"can_{name}", State.FAIL, "there is no such CAN interface", WHY, fix)]
    if not found:
        return [Line("can", State.PASS, "no interface; the simulated plant needs none", WHY)]
    return [can_line(link, bus) for link in found]


def can_line(link: dict[str, Any], bus: SocketCanBus | None = None) -> Line:
    """The worst that can be said of one interface of the kernel."""
    wanted = bus or SocketCanBus(interface=str(link["ifname"]))
    name = wanted.interface
    virtual = f"sudo ip link set {name} down; sudo ip link set {name} mtu {CANFD_MTU} up"
    restart = restart_command(wanted) if kind(link) == "can" else virtual
    state, text, fix = State.PASS, _timing(link), ""
    for judged, problem, remedy in (
        (State.FAIL, _dead(link), restart),
        (State.FAIL, _not_fd(link), restart),
        (State.FAIL, wrong_rates(link, wanted), restart),
        (State.WARN, _errors(link), f"check cable, termination and bit rates, then: {restart}"),
        (
            State.WARN,
            _sampling(link),
            f"{restart.replace(' fd on', ' sample-point 0.8 dsample-point 0.75 fd on')}",
        ),
        (State.WARN, _queue(link), f"sudo ip link set {name} txqueuelen 1000"),
    ):
        if problem:
            state, text, fix = judged, problem, remedy
            break
    return Line(f"can_{name}", state, text, WHY, fix)


def python_can_line(bus: PythonCanBus, devices: int, loop_rate: float) -> Line:
    """What can be said of an interface of python-can without opening it, which might disturb a machine.

    Args:
        bus: of the configuration.
        devices: how many there are on it.
        loop_rate: of its ticks [Hz].
    """
    check = f"can_{bus.interface}"
    rates = (whole(bus.bitrate), whole(bus.data_bitrate))
    try:
        prepare(bus.interface, *rates, bus.settings)
    except AdapterError as error:
        return Line(check, State.FAIL, error.reason, WHY_PYTHON, error.remedy)
    missing = missing_packages(bus.interface)
    if missing:
        found = f"{', '.join(missing)} is missing, which this interface may need"
        return Line(check, State.WARN, found, WHY_PYTHON, install_command(bus.interface))
    slow = slowness(bus, devices, loop_rate)
    if slow:
        return Line(check, State.WARN, slow[0], WHY_SLOW, slow[1])
    return Line(check, State.PASS, f"python-can {can.__version__} can load it; it was not opened", WHY_PYTHON)


def up_virtual(name: str) -> str:
    """The command that makes a virtual CAN FD interface."""
    return f"sudo ip link add dev {name} type vcan && sudo ip link set {name} mtu {CANFD_MTU} up"


def kind(link: dict[str, Any]) -> str:
    """Kind of a link: "can", "vcan", ...; "" where it has none."""
    return str(link.get("linkinfo", {}).get("info_kind", ""))


def _data(link: dict[str, Any]) -> dict[str, Any]:
    data: dict[str, Any] = link.get("linkinfo", {}).get("info_data", {})
    return data


def _dead(link: dict[str, Any]) -> str:
    if "UP" not in link.get("flags", []):
        return "is down"
    state = _data(link).get("state", "")
    return "is off the bus after too many errors" if state == "BUS-OFF" else ""


def _not_fd(link: dict[str, Any]) -> str:
    return "" if link.get("mtu") == CANFD_MTU else f"is not in CAN FD mode (mtu {link.get('mtu')})"


def _errors(link: dict[str, Any]) -> str:
    state = _data(link).get("state", "ERROR-ACTIVE")
    if state == "ERROR-ACTIVE":
        return ""
    counter = _data(link).get("berr_counter", {})
    return f"{state}: {counter.get('tx', '?')} errors sending, {counter.get('rx', '?')} receiving"


def _sampling(link: dict[str, Any]) -> str:
    for timing in ("bittiming", "data_bittiming"):
        point = float(_data(link).get(timing, {}).get("sample_point", SAMPLE_POINTS[0]))
        if not SAMPLE_POINTS[0] <= point <= SAMPLE_POINTS[1]:
            return f"samples at {point:.1%} of a bit ({_timing(link)})"
    return ""


def _queue(link: dict[str, Any]) -> str:
    length = int(link.get("txqlen", SHORTEST_QUEUE))
    return "" if length >= SHORTEST_QUEUE else f"only {length} frames may wait to be sent"


def _timing(link: dict[str, Any]) -> str:
    if kind(link) != "can":
        return "up, virtual, CAN FD"
    data = _data(link)
    parts = []
    for name in ("bittiming", "data_bittiming"):
        told, point = told_rate(link, name), data.get(name, {}).get("sample_point")
        if told:
            parts.append(f"{rate(told)} at {float(point or 0.0):.1%}")
    return f"{data.get('state', 'up')}, {' and '.join(parts)}"
